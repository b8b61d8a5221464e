#include "scenes/compiler/layer_touches.hpp"

#include <algorithm>
#include <cmath>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::Vec3;

// The normals along which an object can be pressed.
struct Normals {
  std::vector<Vec3> lines_W;
  bool any_direction = false;  // `lines_W` represents all directions
  bool together = false;       // several normals act at once, as in the corner of a cavity
};

Normals everywhere() {
  Normals all{.lines_W = {}, .any_direction = true, .together = false};
  for (int i = 0; i < 3; ++i) all.lines_W.emplace_back(Vec3::Unit(i));
  for (const double y : {-1.0, 1.0}) {
    for (const double z : {-1.0, 1.0}) all.lines_W.push_back(Vec3(1.0, y, z).normalized());
  }
  return all;
}

struct NormalsOf {
  Normals operator()(const PlaneShape& s) const {
    return {.lines_W = {s.normal.normalized()}, .any_direction = false, .together = false};
  }
  Normals operator()(const BoxShape& s) const {
    const models::Mat3 R = s.pose_W.linear();
    return {.lines_W = {R.col(0), R.col(1), R.col(2)}, .any_direction = false, .together = s.inside_out};
  }
  template <class Round>
  Normals operator()(const Round& /*shape*/) const {
    return everywhere();
  }
};

bool turns(const Object& object) {
  return object.motion && (object.motion->driven || object.motion->turn_rad_per_s != 0.0);
}

// Projects the lines to the scene's space and drops duplicates.
std::vector<Vec3> within(const Space& space, const std::vector<Vec3>& lines_W) {
  constexpr double least = 1e-6, same = 1.0 - 1e-9;
  const auto axes = space.axes.leftCols(space.dimensions);
  std::vector<Vec3> lines;
  for (const Vec3& line : lines_W) {
    const Vec3 n = axes * (axes.transpose() * line);
    if (n.norm() < least) continue;
    const Vec3 unit = n.normalized();
    const auto known = [&](const Vec3& other) { return std::abs(other.dot(unit)) > same; };
    if (std::none_of(lines.begin(), lines.end(), known)) lines.push_back(unit);
  }
  return lines;
}

struct Layered {
  const Object* object;
  Normals normals;

  [[nodiscard]] PressedLayer along(const Vec3& n) const {
    return {object->name, object->layer->stiffness_N_per_m, object->friction, n};
  }
};

std::vector<Layered> layered_objects(const Scene& scene) {
  std::vector<Layered> all;
  for (const Object& object : scene.objects) {
    if (!object.layer) continue;
    Normals normals = turns(object) ? everywhere() : std::visit(NormalsOf{}, object.shape);
    normals.lines_W = within(scene.space, normals.lines_W);
    if (!normals.lines_W.empty()) all.push_back({&object, std::move(normals)});
  }
  return all;
}

// True if two solids may overlap, judged by their bounding spheres. A moving object is assumed to be anywhere.
bool may_overlap(const Object& a, const Object& b) {
  if (a.motion || b.motion || is_inside_out(a.shape) || is_inside_out(b.shape)) return true;
  const auto* plane_a = std::get_if<PlaneShape>(&a.shape);
  const auto* plane_b = std::get_if<PlaneShape>(&b.shape);
  if (plane_a && plane_b) {
    constexpr double opposite = -1.0 + 1e-9;
    const Vec3 n = plane_a->normal.normalized();
    return n.dot(plane_b->normal.normalized()) > opposite || n.dot(plane_b->point_m - plane_a->point_m) < 0.0;
  }
  if (plane_b) return may_overlap(b, a);
  const double size_b = size_of(b.shape);
  if (plane_a) return plane_a->normal.normalized().dot(middle_of(b.shape) - plane_a->point_m) < size_b;
  return (middle_of(a.shape) - middle_of(b.shape)).norm() < size_of(a.shape) + size_b;
}

using Touches = std::vector<LayersTogether>;

void add_singles(const std::vector<Layered>& all, Touches& to) {
  for (const Layered& layered : all) {
    for (const Vec3& n : layered.normals.lines_W) to.push_back({layered.along(n)});
  }
}

void add_corners(const Layered& cavity, Touches& to) {
  const std::vector<Vec3>& n = cavity.normals.lines_W;
  for (std::size_t i = 0; cavity.normals.together && i < n.size(); ++i) {
    for (std::size_t j = i + 1; j < n.size(); ++j) to.push_back({cavity.along(n[i]), cavity.along(n[j])});
  }
  if (cavity.normals.together && n.size() == 3)
    to.push_back({cavity.along(n[0]), cavity.along(n[1]), cavity.along(n[2])});
}

void add_pair(const Layered& a, const Layered& b, Touches& to) {
  if (b.normals.any_direction && !a.normals.any_direction) return add_pair(b, a, to);
  for (const Vec3& n : b.normals.lines_W) {
    if (a.normals.any_direction) {
      to.push_back({a.along(n), b.along(n)});
      continue;
    }
    for (const Vec3& m : a.normals.lines_W) to.push_back({a.along(m), b.along(n)});
  }
}

// Adds triples of flat faces only. For a round shape, the pairs already represent its triples.
void add_triple(const Layered& a, const Layered& b, const Layered& c, Touches& to) {
  if (a.normals.any_direction || b.normals.any_direction || c.normals.any_direction) return;
  for (const Vec3& l : a.normals.lines_W) {
    for (const Vec3& m : b.normals.lines_W) {
      for (const Vec3& n : c.normals.lines_W) to.push_back({a.along(l), b.along(m), c.along(n)});
    }
  }
}

double stiffness(const LayersTogether& touch) {
  double sum = 0.0;
  for (const PressedLayer& layer : touch) sum += layer.stiffness_N_per_m;
  return sum;
}

}  // namespace

std::vector<LayersTogether> layer_touches(const Scene& scene, std::size_t most) {
  constexpr std::size_t most_objects = 24;  // more objects would give thousands of triples
  const std::vector<Layered> all = layered_objects(scene);
  Touches touches;
  add_singles(all, touches);
  const std::size_t count = std::min(all.size(), most_objects);
  for (std::size_t i = 0; i < count; ++i) {
    add_corners(all[i], touches);
    for (std::size_t j = i + 1; j < count; ++j) {
      if (!may_overlap(*all[i].object, *all[j].object)) continue;
      add_pair(all[i], all[j], touches);
      for (std::size_t k = j + 1; k < count; ++k) {
        if (may_overlap(*all[i].object, *all[k].object) && may_overlap(*all[j].object, *all[k].object))
          add_triple(all[i], all[j], all[k], touches);
      }
    }
  }
  if (touches.size() <= most) return touches;
  std::stable_sort(touches.begin(), touches.end(), [](const LayersTogether& a, const LayersTogether& b) {
    return a.size() != b.size() ? a.size() < b.size() : stiffness(a) > stiffness(b);
  });
  touches.resize(most);
  return touches;
}

}  // namespace proxarm::scenes
