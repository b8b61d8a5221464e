// Which pairs of features may meet in the steps to come.
#include <algorithm>
#include <bitset>
#include <cmath>

#include "models/rigid/rigid_features.hpp"
#include "models/rigid/rigid_world.hpp"

namespace proxarm::models {
namespace {

// More pairs than this are worth a smaller reach: a pair costs some 15 ns at each of the poses that a step looks at.
constexpr std::size_t kFewPairs = 192;

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

}  // namespace

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

// Which triangles come near a part of the tool, and what of the part comes near them.
class RigidWorld::NearFaces {
 public:
  NearFaces(const Part& part, const TriangleFeatures& mesh, const View& at, double near) noexcept
      : part_(&part), mesh_(&mesh), at_(at), near_(near), middle_T_(0.5 * (part.box.low + part.box.high)) {
    middle_ = at * middle_T_;
    half_T_ = 0.5 * (part.box.high - part.box.low) + Vec3::Constant(near);
    spread_ = at.R.cwiseAbs();
    half_ = spread_ * half_T_;
    collect();
  }

  [[nodiscard]] bool all() const noexcept { return all_; }  // or there is no room for more
  [[nodiscard]] std::span<const std::uint32_t> faces() const noexcept { return {faces_.data(), count_}; }
  // Whether a box of T comes near any of the triangles.
  [[nodiscard]] bool meets(const Vec3& low, const Vec3& high) const noexcept {
    return (low.array() <= region_.high.array() + near_).all() && (high.array() >= region_.low.array() - near_).all();
  }
  // Whether any place on the triangles is as high over a face of the tool as −near.
  [[nodiscard]] bool rises_to(const Solid::Face& face) const noexcept {
    const Vec3 middle = 0.5 * (region_.low + region_.high), half = 0.5 * (region_.high - region_.low);
    return face.normal.dot(middle) + face.normal.cwiseAbs().dot(half) - face.offset >= -near_;
  }

 private:
  // The tool's box and one along the axes of W, by the six axes of both.
  [[nodiscard]] bool reaches(const Vec3& low, const Vec3& high) const noexcept {
    const Vec3 way = 0.5 * (low + high) - middle_, half = 0.5 * (high - low);
    if ((way.cwiseAbs() - half - half_).maxCoeff() > 0.0) return false;
    // Around a sphere there is less room than in its box.
    if (part_->solid.points.size() == 1) return distance2_to_box(middle_, {low, high}) <= near_ * near_;
    return ((at_.R.transpose() * way).cwiseAbs() - spread_.transpose() * half - half_T_).maxCoeff() <= 0.0;
  }

  void collect() noexcept {
    constexpr std::size_t depth = 64;  // each level halves the number of faces
    const std::vector<TriangleMesh::NodePair>& nodes = mesh_->mesh().structure().nodes;
    std::array<std::uint32_t, depth> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const TriangleMesh::NodePair& pair = nodes[stack[--top]];
      for (std::size_t k = 0; k < 2; ++k) {
        const Vec3 low(pair.low(k, 0), pair.low(k, 1), pair.low(k, 2));
        const Vec3 high(pair.high(k, 0), pair.high(k, 1), pair.high(k, 2));
        if (!reaches(low, high)) continue;
        if (pair.count[k] == 0) stack[top++] = pair.first[k];
        for (std::uint32_t f = pair.first[k]; f < pair.first[k] + pair.count[k]; ++f) take(f);
      }
    }
  }

  void take(std::uint32_t face) noexcept {
    const TriangleMesh& mesh = mesh_->mesh();
    Vec3 low = at_.to_T(mesh.corner(face, 0)), high = low;
    for (const std::size_t k : {1U, 2U}) {
      const Vec3 corner = at_.to_T(mesh.corner(face, k));
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    const Vec3 top = middle_T_ + half_T_, bottom = middle_T_ - half_T_;
    if ((low.array() > top.array()).any() || (high.array() < bottom.array()).any()) return;
    if (part_->solid.radius > 0.0 && !near_round(0.5 * (low + high), 0.5 * (high - low).norm())) return;
    if (count_ == faces_.size()) {
      all_ = false;
      return;
    }
    faces_[count_++] = face;
    // Beyond the tool's own box nothing of it comes near.
    low = low.cwiseMax(bottom);
    high = high.cwiseMin(top);
    region_.low = count_ == 1 ? low : region_.low.cwiseMin(low);
    region_.high = count_ == 1 ? high : region_.high.cwiseMax(high);
  }

  // Whether a ball of T may come near a sphere or a capsule.
  [[nodiscard]] bool near_round(const Vec3& centre, double radius) const noexcept {
    const Solid& solid = part_->solid;
    const double most = near_ + radius;
    if (solid.edges.empty()) return (centre - solid.points.front()).squaredNorm() <= most * most;
    return distance2_to_segment(centre, edge_of(solid, 0)) <= most * most;
  }

  const Part* part_;
  const TriangleFeatures* mesh_;
  View at_;
  double near_;
  Vec3 middle_T_, half_T_;  // of the part's box, and so much around it
  Vec3 middle_, half_;      // the same in W, along its axes
  Mat3 spread_;
  Bounds region_;  // in T, of the triangles' part within the tool's box
  std::array<std::uint32_t, 2048> faces_;
  std::size_t count_ = 0;
  bool all_ = true;
};

template <typename Add>
bool RigidWorld::pairs_with(const Part& part, const TriangleFeatures& other, double side, const View& at, double reach,
                            Add add) const noexcept {
  const Solid& own = part.solid;
  const TriangleMesh& mesh = other.mesh();
  const double near = reach + own.radius, near2 = near * near;
  const bool round = own.radius > 0.0;
  const NearFaces close(part, other, at, near);
  for (std::uint32_t i = 0; i < own.points.size(); ++i) {
    if (!close.meets(own.points[i], own.points[i])) continue;
    const Vec3 p = at * own.points[i];
    for (const std::uint32_t face : close.faces()) {
      if (std::abs(TriangleMesh::height(mesh.face(face), p)) <= near) add(Kind::point_face, i, face);
      if (!round) continue;
      for (const std::uint32_t v : other.vertices_of(face)) {
        if ((p - other.vertex(v)).squaredNorm() <= near2) add(Kind::point_point, i, v);
      }
      for (const std::uint32_t e : other.edges_of(face)) {
        if (distance2_to_segment(p, other.edge(e).line) <= near2) add(Kind::point_edge, i, e);
      }
    }
  }
  if (own.edges.empty()) return close.all();
  // Faces and edges of the tool that come near.
  std::bitset<most_edges> rising, crossing;
  for (std::uint32_t i = 0; i < own.faces.size(); ++i) rising[i] = close.rises_to(own.faces[i]);
  for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
    const Vec3 &from = own.points[own.edges[i].from], &to = own.points[own.edges[i].to];
    crossing[i] = close.meets(from.cwiseMin(to), from.cwiseMax(to));
  }
  for (const std::uint32_t face : close.faces()) {
    for (const std::uint32_t v : other.vertices_of(face)) {
      const Vec3 y = at.to_T(other.vertex(v));
      double out = -std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
        if (rising[i]) out = std::max(out, own.faces[i].normal.dot(y) - own.faces[i].offset);
      }
      if (std::abs(out) <= near) {
        for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
          if (rising[i] && std::abs(own.faces[i].normal.dot(y) - own.faces[i].offset) <= near) {
            add(Kind::face_point, i, v);
          }
        }
      }
      if (!round) continue;
      for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
        if (distance2_to_segment(y, edge_of(own, i)) <= near2) add(Kind::edge_point, i, v);
      }
    }
    for (const std::uint32_t e : other.edges_of(face)) {
      EdgeLine line = other.edge(e).line;
      // A valley of a closed mesh is touched by nothing sharp.
      if (side != 0.0 && !round && !line.open && other.edge(e).ridge != (side > 0.0)) continue;
      line.from = at.to_T(line.from);
      line.to = at.to_T(line.to);
      double out = -std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < own.faces.size(); ++i) {
        if (!rising[i]) continue;
        const Solid::Face& f = own.faces[i];
        out = std::max(out, std::min(f.normal.dot(line.from), f.normal.dot(line.to)) - f.offset);
      }
      if (out > near) continue;
      for (std::uint32_t i = 0; i < own.edges.size(); ++i) {
        if (crossing[i] && distance2_of_segments(edge_of(own, i), line) <= near2) add(Kind::edges, i, e);
      }
    }
  }
  return close.all();
}

void RigidWorld::gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept {
  const Entry& e = shared_->entries[entry];
  const View at = view(pose);
  const double around = shared_->reach + reach;
  if (distance2_to_box(at.x, e.bounds) > around * around) return;
  if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape)) {
    const Solid& first = shared_->parts.front().solid;
    const Vec3 inside = first.points.empty() ? Vec3(Vec3::Zero()) : first.points.front();
    if ((*mesh)->mesh().closed() && !held_[entry].known) {
      held_[entry].side = (*mesh)->mesh().encloses(at * inside) ? -1.0 : 1.0;
      held_[entry].known = true;
    }
  }
  for (std::size_t part = 0; part < shared_->parts.size(); ++part) {
    const Solid& own = shared_->parts[part].solid;
    if (const Bounds& box = shared_->parts[part].box; box.finite()) {
      const double near = 0.5 * (box.high - box.low).norm() + own.radius + reach;
      if (distance2_to_box(at * Vec3(0.5 * (box.low + box.high)), e.bounds) > near * near) continue;
    }
    const auto add = [&](Kind kind, std::uint32_t i, std::uint32_t j) {
      if (pair_count_ == most_pairs) {
        crowded_ = true;
        return;
      }
      Pair& pair = pairs_[pair_count_++];
      pair = {};
      pair.kind = kind;
      pair.part = static_cast<std::uint16_t>(part);
      pair.entry = entry;
      pair.own = i;
      pair.other = j;
    };
    if (const Solid* solid = std::get_if<Solid>(&e.object.shape)) {
      pairs_with(own, *solid, at, reach, add);
    } else if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&e.object.shape)) {
      if (!pairs_with(shared_->parts[part], **mesh, held_[entry].side, at, reach, add)) crowded_ = true;
    } else {
      with_flat_or_hollow(e.object, [&](const auto& shape) {
        for (std::uint32_t i = 0; i < own.points.size(); ++i) {
          if (touch(shape, at * own.points[i], own.radius).gap <= reach) add(Kind::point_field, i, 0);
        }
        for (std::uint32_t i = 0; i < own.rims.size(); ++i) {
          if (touch(shape, at * own.rims[i].centre, own.rims[i].radius).gap <= reach) add(Kind::rim_field, i, 0);
        }
      });
    }
  }
}

// As far around as steps like this one need for a while; among many triangles only as far as this one needs, since each
// pair costs in every step. Where even those don't find room, the step is taken in parts that need less.
void RigidWorld::gather_for(const ToolPose& q, double far) noexcept {
  const double least = 3.0 * far + 1e-6;
  double reach = 3.0 * far + std::max(8.0 * far, 0.01 * shared_->reach) + 1e-6;
  if (!shared_->dense) return gather(q, reach);
  if (gathered_reach_ > 0.0) {
    const double wider = pair_count_ < kFewPairs / 4 ? 2.0 : 1.0;
    reach = std::clamp(wider * gathered_reach_, least, reach);
  }
  gather(q, reach);
  while (!(pair_count_ <= kFewPairs) && reach > least) {
    reach = std::max(least, 0.5 * reach);
    gather(q, reach);
  }
  for (int k = 0; k < 9 && crowded_; ++k) {
    reach *= 0.5;
    gather(q, reach);
  }
}

void RigidWorld::gather(const ToolPose& pose, double reach) noexcept {
  // The sides and forces of what touched are kept.
  std::array<Pair, ContactProblem::most> kept;
  std::size_t kept_count = 0;
  for (std::size_t i = 0; i < pair_count_ && kept_count < kept.size(); ++i) {
    if (pairs_[i].pressed) kept[kept_count++] = pairs_[i];
  }
  pair_count_ = pressed_count_ = 0;
  crowded_ = false;
  for (std::size_t entry = 0; entry < shared_->entries.size(); ++entry) {
    gather_entry(static_cast<std::uint16_t>(entry), pose, reach);
  }
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

}  // namespace proxarm::models
