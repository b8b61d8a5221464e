// Which pairs of features may meet in the steps to come.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_features.hpp"
#include "models/rigid/rigid_world.hpp"

namespace proxarm::models {
namespace {

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
      pairs_with(own, **mesh, at, reach, add);
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
