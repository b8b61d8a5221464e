#include "models/rigid/rigid_world.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace proxarm::models {
namespace {

// How far in front of a mesh's faces its surface is: a face has no inside from which a tool could be brought back, so
// rounding must not take a tool in contact through it. Coordinates below a metre are rounded by 1e-16 m, and what is
// left of the iteration is as small; this is a thousand times that, and a tenth of what a gap may be short of.
constexpr double kLift_m = 1e-13;
// Which side of a face a feature within this of it was on, rounding may have turned round: if it touched, it stays
// there.
constexpr double kFront_m = 1e-9;
// A part of a step moves no point of the tool by more than this share of the least thickness of what may meet; features
// that were up to twice as far behind another one may come to lie before it, as where an edge leaves the end of one
// edge for the next, but never those of a far side.
constexpr double kPart = 0.2;
// A step may take so many poses; a local problem that has no solution, or none that is found, costs a hundred times
// what one at hand does. What is left then counts as unresolved: the tool goes as far as the parts of the step got.
constexpr int kBudget = 400, kHard = 40;
constexpr double kGap_m = 1e-12;  // what a gap may be short of

EdgeLine edge_of(const Solid& solid, std::uint32_t i) noexcept {
  const Solid::Edge& e = solid.edges[i];
  return {solid.points[e.from], solid.points[e.to], e.left, e.right, false};
}

const TriangleMesh::Face& face_of(const TriangleFeatures& mesh, std::uint32_t i) noexcept {
  return mesh.mesh().face(i);
}

// The least extent of a solid; features on its far side are that far away.
double thickness(const Solid& solid) {
  double least = std::numeric_limits<double>::infinity();
  if (solid.radius > 0.0) return solid.radius;
  for (const Solid::Face& face : solid.faces) {
    double low = face.offset;
    for (const Vec3& p : solid.points) low = std::min(low, face.normal.dot(p));
    least = std::min(least, face.offset - low);
  }
  if (solid.rims.size() == 2) {
    least = std::min(2.0 * solid.rims[0].radius, (solid.rims[0].centre - solid.rims[1].centre).norm());
  }
  return least;
}

double distance2_of_segments(const EdgeLine& a, const EdgeLine& b) noexcept {
  const Vec3 d1 = a.to - a.from, d2 = b.to - b.from, r = a.from - b.from;
  const double A = d1.squaredNorm(), E = d2.squaredNorm(), f = d2.dot(r), c = d1.dot(r), B = d1.dot(d2);
  const double denominator = A * E - B * B;
  double s = denominator > 1e-14 * A * E ? std::clamp((B * f - c * E) / denominator, 0.0, 1.0) : 0.0;
  double t = (B * s + f) / E;
  if (t < 0.0) {
    t = 0.0;
    s = std::clamp(-c / A, 0.0, 1.0);
  } else if (t > 1.0) {
    t = 1.0;
    s = std::clamp((B - c) / A, 0.0, 1.0);
  }
  return (r + s * d1 - t * d2).squaredNorm();
}

double distance2_to_segment(const Vec3& p, const EdgeLine& edge) noexcept {
  const Vec3 along = edge.to - edge.from;
  const double s = std::clamp(along.dot(p - edge.from) / along.squaredNorm(), 0.0, 1.0);
  return (p - edge.from - s * along).squaredNorm();
}

double distance2_to_box(const Vec3& p, const Bounds& box) noexcept {
  return (box.low - p).cwiseMax(p - box.high).cwiseMax(0.0).squaredNorm();
}

Bounds bounds_of(const RigidObject& object) {
  Bounds bounds;
  if (const Solid* solid = std::get_if<Solid>(&object.shape)) {
    bounds.low = bounds.high = solid->points.front();
    for (const Vec3& p : solid->points) {
      bounds.low = bounds.low.cwiseMin(p);
      bounds.high = bounds.high.cwiseMax(p);
    }
    bounds.low.array() -= solid->radius;
    bounds.high.array() += solid->radius;
  } else if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape)) {
    bounds = (*mesh)->mesh().bounds();
  }
  return bounds;
}

}  // namespace

RigidWorld::RigidWorld(const Tool& tool, std::vector<RigidObject> objects) {
  auto shared = std::make_shared<Shared>();
  shared->thinness = std::numeric_limits<double>::infinity();
  for (const ToolPart& part : tool.parts) {
    Solid solid = std::visit([&part](const auto& shape) { return solid_of(shape, part.X_TP); }, part.shape);
    if (part.friction && !(*part.friction >= 0.0 && std::isfinite(*part.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    shared->thinness = std::min(shared->thinness, thickness(solid));
    shared->reach = std::max(shared->reach, solid.reach);
    shared->parts.push_back({std::move(solid), part.friction});
  }
  if (tool.parts.empty()) {
    Solid point;
    point.points = {Vec3::Zero()};
    shared->parts.push_back({std::move(point), {}});
  }
  for (RigidObject& object : objects) {
    if (!(object.friction >= 0.0 && std::isfinite(object.friction))) {
      throw std::invalid_argument("a friction must be finite and not negative");
    }
    if (const Solid* solid = std::get_if<Solid>(&object.shape)) {
      shared->thinness = std::min(shared->thinness, thickness(*solid));
    }
    shared->moves = shared->moves || object.motion || object.driven;
    const Bounds bounds = bounds_of(object);
    shared->entries.push_back({std::move(object), bounds});
  }
  frames_.resize(shared->entries.size());
  shared_ = std::move(shared);
  set_time({0.0, 0.0});
}

void RigidWorld::set_time(const StepTime& time) noexcept {
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const RigidObject& object = shared_->entries[i].object;
    if (!object.motion) continue;
    frames_[i].before = object.motion->at(time.time_s - time.period_s);
    frames_[i].now = object.motion->at(time.time_s);
    frames_[i].moved = true;
  }
  time_s_ = time.time_s;
}

void RigidWorld::drive(std::int32_t object, const Pose& X) noexcept {
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (shared_->entries[i].object.object != object || !shared_->entries[i].object.driven) continue;
    frames_[i].before = frames_[i].now;
    frames_[i].now = X;
    frames_[i].moved = true;
  }
}

double RigidWorld::motion(const ToolPose& a, const ToolPose& b) const noexcept {
  const Twist xi = difference(a, b);
  return xi.head<3>().norm() + shared_->reach * xi.tail<3>().norm();
}

RigidWorld::View RigidWorld::view(const ToolPose& pose, const Frame& frame, bool before) const noexcept {
  View out{pose.orientation.toRotationMatrix(), pose.position};
  if (frame.moved) {
    const Pose& X = before ? frame.before : frame.now;
    out.R = X.linear().transpose() * out.R;
    out.x = X.linear().transpose() * (out.x - X.translation());
  }
  return out;
}

double RigidWorld::friction(const Pair& pair) const noexcept {
  const RigidObject& object = shared_->entries[pair.entry].object;
  double mu = object.friction;
  if (!object.friction_of_face.empty()) {
    if (pair.kind == Kind::point_face) mu = object.friction_of_face[pair.other];
  }
  const std::optional<double>& own = shared_->parts[pair.part].friction;
  return own ? std::sqrt(*own * mu) : mu;
}

// -- candidates -------------------------------------------------------------------------------------------------------

template <typename Add>
void RigidWorld::pairs_with(const Solid& own, const Solid& other, const View& at, double reach,
                            Add add) const noexcept {
  const double radii = own.radius + other.radius, near = reach + radii, near2 = near * near;
  const bool round = radii > 0.0;
  const auto own_edge = [&](std::uint32_t i) {
    EdgeLine edge = edge_of(own, i);
    edge.from = at * edge.from;
    edge.to = at * edge.to;
    return edge;
  };
  for (std::uint32_t i = 0; i < own.points.size(); ++i) {
    const Vec3 p = at * own.points[i];
    for (std::uint32_t j = 0; j < other.faces.size(); ++j) {
      const Solid::Face& face = other.faces[j];
      if (std::abs(face.normal.dot(p) - face.offset) <= near) add(Kind::point_face, i, j);
    }
    if (!round) continue;
    for (std::uint32_t j = 0; j < other.points.size(); ++j) {
      if ((p - other.points[j]).squaredNorm() <= near2) add(Kind::point_point, i, j);
    }
    for (std::uint32_t j = 0; j < other.edges.size(); ++j) {
      if (distance2_to_segment(p, edge_of(other, j)) <= near2) add(Kind::point_edge, i, j);
    }
  }
  for (std::uint32_t j = 0; j < other.points.size(); ++j) {
    const Vec3 y = at.R.transpose() * (other.points[j] - at.x);
    for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
      const Solid::Face& face = own.faces[i];
      if (std::abs(face.normal.dot(y) - face.offset) <= near) add(Kind::face_point, i, j);
    }
    if (!round) continue;
    for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
      if (distance2_to_segment(y, edge_of(own, i)) <= near2) add(Kind::edge_point, i, j);
    }
  }
  for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
    const EdgeLine edge = own_edge(i);
    for (std::uint32_t j = 0; j < other.edges.size(); ++j) {
      if (distance2_of_segments(edge, edge_of(other, j)) <= near2) add(Kind::edges, i, j);
    }
  }
}

template <typename Add>
void RigidWorld::pairs_with(const Solid& own, const TriangleFeatures& other, const View& at, double reach,
                            Add add) const noexcept {
  const TriangleMesh& mesh = other.mesh();
  const double near = reach + own.radius, near2 = near * near;
  const bool round = own.radius > 0.0;
  for (std::uint32_t i = 0; i < own.points.size(); ++i) {
    const Vec3 p = at * own.points[i];
    mesh.within(p, near, [&](std::uint32_t face) {
      if (std::abs(TriangleMesh::height(mesh.face(face), p)) <= near) add(Kind::point_face, i, face);
      if (!round) return true;
      for (const std::uint32_t v : other.vertices_of(face)) {
        if ((p - other.vertex(v)).squaredNorm() <= near2) add(Kind::point_point, i, v);
      }
      for (const std::uint32_t e : other.edges_of(face)) {
        if (distance2_to_segment(p, other.edge(e).line) <= near2) add(Kind::point_edge, i, e);
      }
      return true;
    });
  }
  if (own.edges.empty()) return;
  // The edges and vertices that come near any face or edge of the tool, seen from a sphere around it.
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : own.points) middle += p / static_cast<double>(own.points.size());
  double size = 0.0;
  for (const Vec3& p : own.points) size = std::max(size, (p - middle).norm());
  mesh.within(at * middle, size + near, [&](std::uint32_t face) {
    for (const std::uint32_t v : other.vertices_of(face)) {
      const Vec3 y = at.R.transpose() * (other.vertex(v) - at.x);
      double out = -std::numeric_limits<double>::infinity();
      for (const Solid::Face& f : own.faces) out = std::max(out, f.normal.dot(y) - f.offset);
      if (std::abs(out) <= near) {
        for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
          if (std::abs(own.faces[i].normal.dot(y) - own.faces[i].offset) <= near) add(Kind::face_point, i, v);
        }
      }
      if (!round) continue;
      for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
        if (distance2_to_segment(y, edge_of(own, i)) <= near2) add(Kind::edge_point, i, v);
      }
    }
    for (const std::uint32_t e : other.edges_of(face)) {
      EdgeLine line = other.edge(e).line;
      line.from = at.R.transpose() * (line.from - at.x);
      line.to = at.R.transpose() * (line.to - at.x);
      double out = -std::numeric_limits<double>::infinity();
      for (const Solid::Face& f : own.faces) {
        out = std::max(out, std::min(f.normal.dot(line.from), f.normal.dot(line.to)) - f.offset);
      }
      if (out > near) continue;
      for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
        if (distance2_of_segments(edge_of(own, i), line) <= near2) add(Kind::edges, i, e);
      }
    }
    return true;
  });
}

void RigidWorld::gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept {
  const Entry& e = shared_->entries[entry];
  const View at = view(pose, frames_[entry], false);
  const double around = shared_->reach + reach;
  if (distance2_to_box(at.x, e.bounds) > around * around) return;
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape)) {
    const Solid& first = shared_->parts.front().solid;
    const Vec3 inside = first.points.empty() ? Vec3(Vec3::Zero()) : first.points.front();
    if ((*mesh)->mesh().closed() && !frames_[entry].side_known) {
      frames_[entry].held_side = (*mesh)->mesh().encloses(at * inside) ? -1.0 : 1.0;
      frames_[entry].side_known = true;
    }
  }
  for (std::uint16_t part = 0; part < shared_->parts.size(); ++part) {
    const Solid& own = shared_->parts[part].solid;
    const auto add = [&](Kind kind, std::uint32_t i, std::uint32_t j) {
      if (pair_count_ == most_pairs) {
        overflow_ = true;
        return;
      }
      Pair& pair = pairs_[pair_count_++];
      pair = {};
      pair.kind = kind;
      pair.part = part;
      pair.entry = entry;
      pair.own = i;
      pair.other = j;
    };
    if (const Solid* solid = std::get_if<Solid>(&e.object.shape)) {
      pairs_with(own, *solid, at, reach, add);
    } else if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape)) {
      pairs_with(own, **mesh, at, reach, add);
    } else {
      std::visit(
          [&](const auto& shape) {
            if constexpr (requires { touch(shape, Vec3(), 0.0); }) {
              for (std::uint32_t i = 0; i < own.points.size(); ++i) {
                if (touch(shape, at * own.points[i], own.radius).gap <= reach) add(Kind::point_field, i, 0);
              }
              for (std::uint32_t i = 0; i < own.rims.size(); ++i) {
                if (touch(shape, at * own.rims[i].centre, own.rims[i].radius).gap <= reach) add(Kind::rim_field, i, 0);
              }
            }
          },
          e.object.shape);
    }
  }
}

void RigidWorld::gather(const ToolPose& pose, double reach) noexcept {
  // The sides and forces of what touched are kept.
  std::array<Pair, ContactProblem::most> kept;
  std::size_t kept_count = 0;
  for (std::size_t i = 0; i < pair_count_ && kept_count < kept.size(); ++i) {
    if (pairs_[i].pressed) kept[kept_count++] = pairs_[i];
  }
  pair_count_ = 0;
  overflow_ = false;
  for (std::uint16_t entry = 0; entry < shared_->entries.size(); ++entry) gather_entry(entry, pose, reach);
  gathered_at_ = pose;
  gathered_reach_ = reach;
  for (std::size_t k = 0; k < kept_count; ++k) {
    const Pair& old = kept[k];
    for (std::size_t i = 0; i < pair_count_; ++i) {
      Pair& pair = pairs_[i];
      if (pair.kind != old.kind || pair.part != old.part || pair.entry != old.entry) continue;
      if (pair.own == old.own && pair.other == old.other) pair = old;
    }
  }
}

// -- gaps -------------------------------------------------------------------------------------------------------------

// Of a pair at q(k−1): the height of the tool's feature over the object's, or of the object's point over the tool's
// face.
double RigidWorld::signed_start(const Pair& pair, const View& at) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* solid = std::get_if<Solid>(&object.shape);
  if (pair.kind == Kind::point_face) {
    const Vec3 p = at * own.points[pair.own];
    if (mesh != nullptr) return TriangleMesh::height(face_of(**mesh, pair.other), p);
    const Solid::Face& face = solid->faces[pair.other];
    return face.normal.dot(p) - face.offset;
  }
  if (pair.kind == Kind::face_point) {
    const Vec3& p = mesh != nullptr ? (*mesh)->vertex(pair.other) : solid->points[pair.other];
    const Solid::Face& face = own.faces[pair.own];
    return face.normal.dot(at.R.transpose() * (p - at.x)) - face.offset;
  }
  const EdgeLine a = edge_of(own, pair.own);
  const EdgeLine b = mesh != nullptr ? (*mesh)->edge(pair.other).line : edge_of(*solid, pair.other);
  Vec3 n = (at.R * (a.to - a.from)).cross(b.to - b.from);
  const double size = n.norm();
  if (!(size > 1e-7 * (a.to - a.from).norm() * (b.to - b.from).norm())) return 0.0;
  n /= size;
  if (!b.open) {
    const double outwards = mesh != nullptr && !(*mesh)->edge(pair.other).ridge ? -1.0 : 1.0;
    if (outwards * n.dot(b.left + b.right) < 0.0) n = -n;
  }
  return n.dot(at * a.from - b.from);
}

void RigidWorld::set_sides(const ToolPose& q_old, double far) noexcept {
  from_ = q_old;
  std::uint16_t entry = 0xffff;
  View at{};
  for (std::size_t i = 0; i < pair_count_; ++i) {
    Pair& pair = pairs_[i];
    if (pair.kind != Kind::point_face && pair.kind != Kind::face_point && pair.kind != Kind::edges) continue;
    if (pair.entry != entry) {
      entry = pair.entry;
      at = view(q_old, frames_[entry], true);
    }
    const RigidObject& object = shared_->entries[entry].object;
    const bool is_mesh = std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(object.shape);
    const double own_radius = shared_->parts[pair.part].solid.radius;
    if (pair.kind == Kind::edges) {
      const double radii = own_radius + (is_mesh ? 0.0 : std::get<Solid>(object.shape).radius);
      if (radii > 0.0) continue;
    }
    const double height = signed_start(pair, at);
    const bool near = pair.pressed && std::abs(height) < kFront_m;
    if (!is_mesh) {
      pair.side = pair.pressed || height >= -2.0 * far - kFront_m ? 1.0F : 0.0F;
    } else if (!near) {
      pair.side = static_cast<float>(side_of_mesh(pair, at, height, far));
    }
  }
}

// A closed mesh holds the tool on its side, an open one on that on which the feature is. A feature may have been behind
// without having come through, as beside an edge: its foot wasn't on the face then.
double RigidWorld::side_of_mesh(const Pair& pair, const View& at, double height, double far) const noexcept {
  const auto& mesh = *std::get<std::shared_ptr<const TriangleFeatures>>(shared_->entries[pair.entry].object.shape);
  const double held = frames_[pair.entry].held_side;
  if (pair.kind == Kind::point_face) {
    if (held == 0.0) return height < 0.0 ? -1.0 : 1.0;
    if (held * height >= -kFront_m) return held;
    if (held * height < -2.0 * far - kFront_m) return 0.0;
    const Vec3 p = at * shared_->parts[pair.part].solid.points[pair.own];
    return touch_face(p, 0.0, face_of(mesh, pair.other).normal, 0.0, mesh.mesh().structure().vertices,
                      mesh.mesh().triangle(pair.other), 1.0)
                   .has_value()
               ? 0.0
               : held;
  }
  if (pair.kind == Kind::edges) {
    const TriangleFeatures::Edge& edge = mesh.edge(pair.other);
    if (edge.line.open) return height < 0.0 ? -1.0 : 1.0;
    if (held != 0.0 && edge.ridge != (held > 0.0)) return 0.0;
  }
  return height >= -2.0 * far - kFront_m ? 1.0 : 0.0;
}

// Whether a tool's point that is on the other side of a face than at the beginning has come through the face: the place
// where its way meets the plane is on the triangle. It may have come around.
bool RigidWorld::crossed(const Pair& pair, const Vec3& p) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const auto& mesh = *std::get<std::shared_ptr<const TriangleFeatures>>(shared_->entries[pair.entry].object.shape);
  const TriangleMesh::Face& face = face_of(mesh, pair.other);
  const Vec3 was = view(from_, frames_[pair.entry], true) * own.points[pair.own];
  const double before = TriangleMesh::height(face, was), after = TriangleMesh::height(face, p);
  if (pair.pressed || before * after >= 0.0) return true;
  const Vec3 there = was + before / (before - after) * (p - was);
  return touch_face(there, 0.0, face.normal, 0.0, mesh.mesh().structure().vertices, mesh.mesh().triangle(pair.other),
                    1.0)
      .has_value();
}

template <typename Each>
void RigidWorld::evaluate(const Pair& pair, const View& at, Each each) const noexcept {
  const Solid& own = shared_->parts[pair.part].solid;
  const RigidObject& object = shared_->entries[pair.entry].object;
  const auto emit = [&](std::optional<Touch> t, double lift = 0.0) {
    if (!t) return;
    t->gap -= lift;
    each(*t, 0);
  };
  if (pair.kind == Kind::point_field || pair.kind == Kind::rim_field) {
    std::visit(
        [&](const auto& shape) {
          if constexpr (requires { touch(shape, Vec3(), 0.0); }) {
            if (pair.kind == Kind::point_field) return each(touch(shape, at * own.points[pair.own], own.radius), 0);
            Solid::Rim rim = own.rims[pair.own];
            rim.centre = at * rim.centre;
            rim.u = at.R * rim.u;
            rim.v = at.R * rim.v;
            std::array<Vec3, 4> places;
            const int count = nearest_of_rim(shape, rim, places);
            for (int k = 0; k < count; ++k) each(touch(shape, places[static_cast<std::size_t>(k)], 0.0), k);
          }
        },
        object.shape);
    return;
  }
  const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
  const Solid* solid = std::get_if<Solid>(&object.shape);
  const double lift = mesh != nullptr ? kLift_m : 0.0, other_radius = solid != nullptr ? solid->radius : 0.0;
  const double radii = own.radius + other_radius;
  const auto other_point = [&] { return mesh != nullptr ? (*mesh)->vertex(pair.other) : solid->points[pair.other]; };
  const auto other_edge = [&] {
    return mesh != nullptr ? (*mesh)->edge(pair.other).line : edge_of(*solid, pair.other);
  };
  const auto own_edge = [&] {
    EdgeLine edge = edge_of(own, pair.own);
    edge.from = at * edge.from;
    edge.to = at * edge.to;
    edge.left = at.R * edge.left;
    edge.right = at.R * edge.right;
    return edge;
  };
  const double side = static_cast<double>(pair.side);
  switch (pair.kind) {
    case Kind::point_face: {
      if (side == 0.0) return;
      const Vec3 p = at * own.points[pair.own];
      if (mesh != nullptr) {
        const TriangleMesh::Face& face = face_of(**mesh, pair.other);
        const double height = side * TriangleMesh::height(face, p);
        if (frames_[pair.entry].held_side == 0.0 && own.radius == 0.0 && height < 0.0) {
          // Come through the face, wherever it is now; or come around, and then another face holds it.
          if (crossed(pair, p)) emit(Touch{p, side * face.normal, height}, lift);
          return;
        }
        return emit(touch_face(p, own.radius, face.normal, face.normal.dot(face.corner),
                               (*mesh)->mesh().structure().vertices, (*mesh)->mesh().triangle(pair.other), side),
                    lift);
      }
      const Solid::Face& face = solid->faces[pair.other];
      return emit(touch_face(p, own.radius, face.normal, face.offset, solid->points, solid->corners(face), 1.0));
    }
    case Kind::face_point: {
      if (side == 0.0) return;
      const Solid::Face& face = own.faces[pair.own];
      const Vec3 y = at.R.transpose() * (other_point() - at.x);
      std::optional<Touch> t =
          touch_face(y, other_radius, face.normal, face.offset, own.points, own.corners(face), 1.0);
      if (!t) return;
      const Vec3 foot = y - (t->gap + other_radius) * face.normal;
      return emit(Touch{at * foot, -(at.R * face.normal), t->gap}, lift);
    }
    case Kind::edges: {
      EdgeLine other = other_edge();
      const EdgeLine edge = own_edge();
      if (radii > 0.0) return emit(touch_edges_round(edge, other, radii, own.radius), lift);
      if (side == 0.0) return;
      if (mesh != nullptr && !other.open && !(*mesh)->edge(pair.other).ridge) {
        other.left = -other.left;
        other.right = -other.right;
      }
      const Vec3 n = (edge.to - edge.from).cross(other.to - other.from);
      const double orientation = other.open ? side : n.dot(other.left + other.right) < 0.0 ? -1.0 : 1.0;
      return emit(touch_edges_sharp(edge, other, orientation), lift);
    }
    case Kind::point_point: {
      std::optional<Touch> t = touch_point(at * own.points[pair.own], other_point(), radii);
      if (t) t->point -= own.radius * t->normal;
      return emit(t, lift);
    }
    case Kind::point_edge:
      return emit(touch_round(at * own.points[pair.own], other_edge(), radii, own.radius, false), lift);
    case Kind::edge_point:
      return emit(touch_round(other_point(), own_edge(), radii, own.radius, true), lift);
    case Kind::point_field:
    case Kind::rim_field:
      return;
  }
}

void RigidWorld::find(const ToolPose& pose) noexcept {
  found_count_ = 0;
  std::uint16_t entry = 0xffff;
  View at{};
  for (std::size_t i = 0; i < pair_count_; ++i) {
    const Pair& pair = pairs_[i];
    if (pair.entry != entry) {
      entry = pair.entry;
      at = view(pose, frames_[entry], false);
    }
    evaluate(pair, at, [&](const Touch& t, int which) {
      if (found_count_ == most_found) {
        overflow_ = true;
        return;
      }
      Found& found = found_[found_count_++];
      found.touch = t;
      if (frames_[entry].moved) {
        found.touch.point = frames_[entry].now * t.point;
        found.touch.normal = frames_[entry].now.linear() * t.normal;
      }
      found.pair = static_cast<std::uint16_t>(i);
      found.which = static_cast<std::uint8_t>(which);
      found.working = false;
    });
  }
  drop_deeper();
}

// A point inside of a convex solid, or under a ridge of a mesh, is behind several faces: only the one that it is least
// deep under holds it. The same for an object's point in a part of the tool.
void RigidWorld::drop_deeper() noexcept {
  const auto same_point = [&](const Pair& a, const Pair& b) {
    if (a.kind != b.kind || a.part != b.part || a.entry != b.entry) return false;
    return a.kind == Kind::point_face ? a.own == b.own : a.kind == Kind::face_point && a.other == b.other;
  };
  const auto behind = [&](const Found& deep, const Found& other) {
    // The foot of the deeper one on its face, seen from the other face.
    const Vec3 foot = deep.touch.point - deep.touch.gap * deep.touch.normal;
    return other.touch.normal.dot(foot - (other.touch.point - other.touch.gap * other.touch.normal)) < kGap_m;
  };
  for (std::size_t i = 0; i < found_count_; ++i) {
    if (!(found_[i].touch.gap < -kGap_m)) continue;
    const Pair& pair = pairs_[found_[i].pair];
    if (pair.kind != Kind::point_face && pair.kind != Kind::face_point) continue;
    const bool is_mesh =
        std::holds_alternative<std::shared_ptr<const TriangleFeatures>>(shared_->entries[pair.entry].object.shape);
    for (std::size_t j = 0; j < found_count_; ++j) {
      if (j == i || found_[j].touch.gap < found_[i].touch.gap || !same_point(pair, pairs_[found_[j].pair])) continue;
      // An open mesh's face may hold the point from behind: only one that it has come through counts here.
      if (is_mesh && pair.kind == Kind::point_face) {
        if (frames_[pair.entry].held_side == 0.0 && !(found_[j].touch.gap < 0.0)) continue;
        if (!behind(found_[i], found_[j])) continue;
      }
      found_[i] = found_[--found_count_];
      --i;
      break;
    }
  }
}

// -- a step -----------------------------------------------------------------------------------------------------------

void RigidWorld::linearise(const Found& found, const ToolPose& pose, const ToolPose& q_old, LinearContact& out,
                           Mat3& axes) const noexcept {
  const Pair& pair = pairs_[found.pair];
  const Vec3& n = found.touch.normal;
  axes.col(0) = n;
  axes.col(1) = n.unitOrthogonal();
  axes.col(2) = n.cross(axes.col(1));
  const Vec3 lever = found.touch.point - pose.position;
  for (int k = 0; k < 3; ++k) {
    out.J.row(k).head<3>() = axes.col(k);
    out.J.row(k).tail<3>() = lever.cross(axes.col(k));
  }
  // Where the tool's material point was, and where the object's motion would have carried it.
  const Vec3 y = pose.orientation.conjugate() * lever;
  Vec3 was = q_old * y;
  const Frame& frame = frames_[pair.entry];
  if (frame.moved) was = frame.now * (frame.before.inverse() * was);
  const Vec3 slip = found.touch.point - was;
  out.c << found.touch.gap, axes.col(1).dot(slip), axes.col(2).dot(slip);
  out.mu = friction(pair);
  out.f = pair.pressed && found.which == 0 ? Vec3(axes.transpose() * pair.force_W) : Vec3(Vec3::Zero());
}

// Solves the local problem at a pose. Contacts that neither pressed last time nor are passed on the way to p̂ join when
// a solution passes them.
bool RigidWorld::solve_linear(const ToolPose& pose, const ToolPose& p_hat, const ToolPose& q_old,
                              Twist& delta) noexcept {
  const Twist e = difference(pose, p_hat);
  const auto approach = [&](const Found& found, const Twist& xi) {
    const Vec3 lever = found.touch.point - pose.position;
    return found.touch.gap + found.touch.normal.dot(xi.head<3>() + xi.tail<3>().cross(lever));
  };
  linear_count_ = 0;
  bool solved = true;
  delta = -e;
  for (int round = 0; round < 8; ++round) {
    bool grew = false;
    for (std::size_t i = 0; i < found_count_; ++i) {
      Found& found = found_[i];
      if (found.working) continue;
      const bool wanted = approach(found, delta) < -1e-16 || (round == 0 && pairs_[found.pair].pressed);
      if (!wanted) continue;
      if (linear_count_ == ContactProblem::most) {
        overflow_ = true;
        break;
      }
      found.working = grew = true;
      of_linear_[linear_count_] = static_cast<std::uint16_t>(i);
      linearise(found, pose, q_old, linear_[linear_count_], axes_[linear_count_]);
      ++linear_count_;
    }
    if (!grew) break;
    solved = problem_.solve(e, {linear_.data(), linear_count_}, delta);
    if (!solved) budget_ -= kHard;
  }
  for (std::size_t i = 0; i < pair_count_; ++i) pairs_[i].pressed = false;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    if (linear_[k].state == ContactState::open) continue;
    Pair& pair = pairs_[found_[of_linear_[k]].pair];
    pair.pressed = true;
    if (found_[of_linear_[k]].which == 0) pair.force_W = axes_[k] * linear_[k].f;
  }
  return solved;
}

// From a pose on, until nothing moves.
bool RigidWorld::settle(const ToolPose& p_hat, const ToolPose& q_old, ToolPose& q) noexcept {
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon() * (q.position.lpNorm<1>() + shared_->reach);
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 50; ++k) {
    if (--budget_ < 0) return false;
    find(q);
    Twist delta;
    const bool solved = solve_linear(q, p_hat, q_old, delta);
    if (!delta.allFinite()) return false;
    const double size = delta.head<3>().norm() + shared_->reach * delta.tail<3>().norm();
    if (linear_count_ == 0) {
      const bool there = q == p_hat;
      q = p_hat;
      if (there) return true;
      continue;
    }
    q = moved(q, delta);
    // What is left after this is the last ratio times this.
    if (size <= rounding || (k > 0 && size < 0.1 * last && size / last * size <= 0.1 * rounding)) return solved;
    last = size;
  }
  return false;
}

bool RigidWorld::in_parts(const ToolPose& p_hat, const ToolPose& q_old, int parts, ToolPose& q) noexcept {
  const Twist way = difference(p_hat, q_old);
  const double far = motion(p_hat, q_old);
  ToolPose reached = q_old;
  set_sides(q_old, far / parts);
  for (int k = 1; k <= parts; ++k) {
    const ToolPose p = k == parts ? p_hat : moved(q_old, way * (static_cast<double>(k) / parts));
    ToolPose next = reached;
    if (!settle(p, q_old, next)) {
      q = reached;
      return false;
    }
    reached = next;
    if (k < parts) {
      if (motion(reached, gathered_at_) > 0.5 * gathered_reach_) gather(reached, gathered_reach_);
      set_sides(reached, far / parts);
    }
  }
  q = reached;
  return true;
}

const ToolPose& RigidWorld::step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept {
  count_ = 0;
  unresolved_ = several_ = squeezed_ = false;
  const double far = motion(p_hat, q);
  const bool moves = shared_->moves;
  if (!moves && clearance_ > 0.0 && motion(q, clear_at_) + far < clearance_) {
    q_ = p_hat;
    return q_;
  }
  if (moves || !(motion(q, gathered_at_) + 2.0 * far < gathered_reach_)) {
    // Moving objects come nearer by their own motion, which is at most as far as the tool's reach and p̂ tell here.
    double own_motion = 0.0;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (!frames_[i].moved) continue;
      const Pose change = frames_[i].now * frames_[i].before.inverse();
      own_motion = std::max(own_motion, (change * q.position - q.position).norm() +
                                            shared_->reach * (change.linear() - Mat3::Identity()).norm());
    }
    const double margin = moves ? 0.0 : std::max(8.0 * far, 0.01 * shared_->reach);
    gather(q, 3.0 * (far + own_motion) + margin + 1e-6);
  }
  clearance_ = -1.0;
  if (pair_count_ == 0) {
    clear_at_ = gathered_at_;
    clearance_ = gathered_reach_;
    q_ = p_hat;
    return q_;
  }
  problem_.set_stiffness(K);
  const double limit = std::min(kPart * shared_->thinness, gathered_reach_);
  const int parts = std::isfinite(limit) ? static_cast<int>(std::min(std::ceil(far / limit), 512.0)) : 1;
  budget_ = kBudget + 8 * parts;
  bool fine = in_parts(p_hat, q, std::max(parts, 1), q_);
  if (!fine && budget_ > 0) {
    gather(q, gathered_reach_);
    fine = in_parts(p_hat, q, 8 * std::max(parts, 1), q_);
  }
  unresolved_ = !fine || overflow_;
  report(q);
  return q_;
}

void RigidWorld::report(const ToolPose& q_old) noexcept {
  double deepest = 0.0;
  for (std::size_t k = 0; k < linear_count_; ++k) {
    const Found& found = found_[of_linear_[k]];
    const Pair& pair = pairs_[found.pair];
    deepest = std::min(deepest, found.touch.gap);
    if (linear_[k].state == ContactState::open && found.touch.gap > kGap_m) continue;
    PoseContact& contact = contacts_[count_++];
    contact.object = shared_->entries[pair.entry].object.object;
    contact.part = pair.part;
    contact.feature = static_cast<std::int32_t>(pair.other);
    contact.slips = linear_[k].state == ContactState::slip;
    contact.point_W = found.touch.point;
    contact.normal_W = found.touch.normal;
    contact.force_W = axes_[k] * linear_[k].f;
    contact.gap_m = found.touch.gap;
  }
  squeezed_ = unresolved_ && shared_->moves && deepest < -kGap_m;
  if (count_ == 0 || shared_->moves) return;
  // What sticks stays, bit for bit.
  const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * (q_old.position.lpNorm<1>() + shared_->reach);
  if (motion(q_, q_old) > rounding) return;
  q_ = q_old;
  for (std::size_t k = 0; k < count_; ++k) contacts_[k].slips = false;
}

double RigidWorld::clearance_m(const ToolPose& pose) const noexcept {
  RigidWorld copy(*this);
  double far = 1e-3, least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 16; ++k, far *= 4.0) {
    copy.pair_count_ = 0;
    copy.gather(pose, far);
    for (Frame& frame : copy.frames_) frame.before = frame.now;
    copy.set_sides(pose, 0.0);
    copy.find(pose);
    for (std::size_t i = 0; i < copy.found_count_; ++i) least = std::min(least, copy.found_[i].touch.gap);
    if (least < far) break;
  }
  return least;
}

}  // namespace proxarm::models
