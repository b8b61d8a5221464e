#include "models/mesh_surface.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "models/mesh_walk.hpp"

namespace proxarm::models {

MeshSurface::MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction)
    : mesh_(std::move(mesh)), mu_(friction) {
  if (!std::isfinite(friction) || !(friction >= 0.0)) {
    throw std::invalid_argument("a friction coefficient must be finite and not negative");
  }
  near_.reserve(kNear);
}

bool MeshSurface::is_clear(const Vec3& p, const Vec3& q) const noexcept {
  const double clear2 = clearance_ > 0.0 ? clearance_ * clearance_ : 0.0;
  return (p - clear_at_).squaredNorm() < clear2 && (q - clear_at_).squaredNorm() < clear2;
}

void MeshSurface::find_clearance(const Vec3& q) noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  const double distance = mesh_->distance(q, std::numeric_limits<double>::infinity(), nearest_face_);
  // What rounding may add to a distance: a few u of the coordinates, which the lift (64 u S) exceeds on the mesh's
  // part; two lifts more, so that whoever is clear doesn't touch either.
  clearance_ = distance * (1.0 - 16.0 * u) - 3.0 * mesh_->lift_m() - 16.0 * u * q.lpNorm<1>();
  clear_at_ = q;
}

bool MeshSurface::has_near(const Vec3& x) const noexcept {
  return near_radius_ > 0.0 && (x - near_centre_).squaredNorm() < near_radius_ * near_radius_;
}

// Gathers the faces around x, out to `reach` if they aren't too many. A little further than asked for, because a face
// counts as touched, and a way as tested, within a few lifts.
void MeshSurface::come_near(const Vec3& x, double reach) noexcept {
  const double margin = 64.0 * mesh_->lift_m();
  double radius = std::max(4.0 * reach, 0.5 * mesh_->mean_edge_m());
  for (int tries = 0; tries < 3 && radius >= reach; ++tries, radius *= 0.4) {
    near_.clear();
    bool full = false;
    mesh_->within(x, radius + margin, [&](std::uint32_t f) {
      full = near_.size() == kNear;
      if (!full) near_.push_back({f, mesh_->face(f)});
      return !full;
    });
    if (full) continue;
    near_centre_ = x;
    near_radius_ = radius;
    return;
  }
  near_radius_ = -1.0;
}

TriangleMesh::Hit MeshSurface::first_hit(const Vec3& x, const Vec3& y) noexcept {
  if (!has_near(x) || !has_near(y)) {
    const double reach = (y - x).norm();
    if (!(reach < 4.0 * mesh_->mean_edge_m())) return mesh_->first_hit(x, y);
    come_near(x, reach * 1.001);
    if (!has_near(x) || !has_near(y)) return mesh_->first_hit(x, y);
  }
  TriangleMesh::Hit hit;
  const double size_x = x.lpNorm<1>(), size_y = y.lpNorm<1>();
  for (const Near& near : near_) mesh_->test(near.index, near.face, x, y, size_x, size_y, hit);
  return hit;
}

Vec3 MeshSurface::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  count_ = 0;
  if (is_clear(p, q)) return p;
  Walk walk(*this, p, q);
  return walk.run();
}

}  // namespace proxarm::models
