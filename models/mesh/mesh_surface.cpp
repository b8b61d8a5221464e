#include "models/mesh/mesh_surface.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "models/mesh/mesh_walk.hpp"
#include "models/surfaces/friction_plane.hpp"

namespace proxarm::models {

MeshSurface::MeshSurface(std::shared_ptr<const TriangleMesh> mesh, double friction, std::vector<double> of_face)
    : mesh_(std::move(mesh)), mu_(friction), friction_of_face_(std::move(of_face)), lift_(mesh_->lift_m()) {
  const auto is_friction = [](double mu) { return std::isfinite(mu) && mu >= 0.0; };
  if (!is_friction(friction) || !std::all_of(friction_of_face_.begin(), friction_of_face_.end(), is_friction)) {
    throw std::invalid_argument("a friction coefficient must be finite and not negative");
  }
  if (!friction_of_face_.empty() && friction_of_face_.size() != mesh_->size()) {
    throw std::invalid_argument("friction by face needs one for each");
  }
}

void MeshSurface::set_lift(double lift_m) noexcept {
  if (lift_m == lift_) return;
  lift_ = lift_m;
  near_radius_ = clearance_ = -1.0;  // remembered data was measured with the lift before the change
  held_.side = 0;
}

bool MeshSurface::is_clear(const Vec3& p, const Vec3& q) const noexcept {
  const double clear2 = clearance_ > 0.0 ? clearance_ * clearance_ : 0.0;
  return (p - clear_at_).squaredNorm() < clear2 && (q - clear_at_).squaredNorm() < clear2;
}

void MeshSurface::find_clearance(const Vec3& q) noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  // Half of the true distance is cheap to find. For the exact distance, every face at about that distance would have to
  // be tested.
  const double distance = mesh_->distance_at_least(q, std::numeric_limits<double>::infinity(), nearest_face_, 0.5);
  // Rounding may add a few u of the coordinates to the distance. One lift (64 u S) covers the mesh's coordinates, and
  // the last term covers the coordinates of q. Two more lifts ensure that a proxy within the clearance touches nothing.
  clearance_ = distance * (1.0 - 16.0 * u) - 3.0 * lift_ - 16.0 * u * q.lpNorm<1>();
  clear_at_ = q;
}

void MeshSurface::Near::add(std::uint32_t index, const TriangleMesh::Face& of) noexcept {
  const auto i = static_cast<Eigen::Index>(count);
  const double trusted = of.trust > 1.0 ? 0.0 : 1.0;
  x[i] = trusted * of.normal.x();
  y[i] = trusted * of.normal.y();
  z[i] = trusted * of.normal.z();
  offset[i] = trusted * of.offset;
  face[count++] = index;
}

void MeshSurface::Near::finish() noexcept {
  for (std::size_t i = count; i % kTogether != 0; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    x[k] = y[k] = z[k] = 0.0;
    offset[k] = 1e30;
  }
}

bool MeshSurface::has_near(const Vec3& x) const noexcept {
  return near_radius_ > 0.0 && (x - near_centre_).squaredNorm() < near_radius_ * near_radius_;
}

// Gathers the faces around a path that begins at x and leads by `move`. The ball reaches farther ahead of x than behind
// x. It shrinks as long as it contains more than kNear faces, but never so far that it doesn't contain the path. Faces
// within a margin of 64 lifts are included, because a face counts as touched within a few lifts.
void MeshSurface::come_near(const Vec3& x, const Vec3& move) noexcept {
  const double margin = 64.0 * lift_, reach = 1.001 * move.norm();
  double radius = std::max(4.0 * reach, 0.5 * mesh_->mean_edge_m());
  for (int tries = 0; tries < 3 && radius >= reach; ++tries, radius *= 0.4) {
    const Vec3 centre = reach > 0.0 ? Vec3(x + (0.5 * radius / reach) * move) : x;
    near_.count = 0;
    bool full = false;
    mesh_->within(centre, radius + margin, [&](std::uint32_t f) {
      full = near_.count == kNear;
      if (!full) near_.add(f, mesh_->face(f));
      return !full;
    });
    if (full) continue;
    near_.finish();
    near_centre_ = centre;
    near_radius_ = radius;
    return;
  }
  near_radius_ = -1.0;
}

TriangleMesh::Hit MeshSurface::first_hit(const Vec3& x, const Vec3& y) noexcept {
  if (!has_near(x) || !has_near(y)) {
    const Vec3 move = y - x;
    if (!(move.norm() < 4.0 * mesh_->mean_edge_m())) return mesh_->first_hit(x, y);
    come_near(x, move);
    if (!has_near(x) || !has_near(y)) return mesh_->first_hit(x, y);
  }
  TriangleMesh::Hit hit;
  const double size_x = x.lpNorm<1>(), size_y = y.lpNorm<1>();
  maybe_between(x, y, 0.0, [&](std::uint32_t f) { mesh_->test(f, mesh_->face(f), x, y, size_x, size_y, hit); });
  return hit;
}

bool MeshSurface::parts(const Vec3& x, const Vec3& y, Vec3& normal) noexcept {
  if (x == y) return false;
  const TriangleMesh::Hit hit = first_hit(x, y);
  if (!hit.any()) return false;
  normal = mesh_->side(hit.face, x) < 0 ? Vec3(-mesh_->face(hit.face).normal) : mesh_->face(hit.face).normal;
  return true;
}

void MeshSurface::keep_side(const Contact<3>& contact) noexcept {
  const auto index = static_cast<std::uint32_t>(contact.feature);
  const TriangleMesh::Face& face = mesh_->face(index);
  const int side = contact.normal == face.normal ? 1 : -1;
  if (index == held_.face && side == held_.side) return;
  held_.face = index;
  held_.side = side;
  held_.surface = FlatSurface<3>::of_unit(face.corner + lift_ * contact.normal, contact.normal);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& a = mesh_->corner(index, k);
    held_.out[k] = (mesh_->corner(index, (k + 1) % 3) - a).cross(face.normal).normalized();
    held_.rim[k] = held_.out[k].dot(a);
  }
}

// Makes the usual step without a walk: the face that held the proxy alone in the last step holds it again. Returns true
// only if the walk would find the same result, bit for bit. This is so if, by more than rounding, this face blocks the
// path to p, the step on it stays within its sides, and no other face is touched or crossed.
bool MeshSurface::glides(const Vec3& p, const Vec3& q, Vec3& r) noexcept {
  if (held_.side == 0 || !has_near(q)) return false;
  const TriangleMesh::Face& face = mesh_->face(held_.face);
  const FaceStep<3> step = step_on_face(held_.surface, friction(held_.face), p, q);
  if (!step.touches || !has_near(step.r)) return false;
  const double from = held_.side * TriangleMesh::height(face, q), to = held_.side * TriangleMesh::height(face, p);
  const double end = held_.side * TriangleMesh::height(face, step.r);
  if (!(from > 0.5 * lift_ && from < 2.0 * lift_ && end > 0.5 * lift_ && to < -lift_)) return false;
  // The path to p passes the face's plane before this fraction, which is twice the fraction at which the computed
  // height is zero.
  const double through = 2.0 * from / (from - to);
  const double inside = -lift_ - 1e-15 * (q.lpNorm<1>() + step.r.lpNorm<1>() + through * p.lpNorm<1>());
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& out = held_.out[k];
    const double past_q = out.dot(q) - held_.rim[k], past_p = out.dot(p) - held_.rim[k];
    const double past_r = out.dot(step.r) - held_.rim[k];
    if (!(past_q < inside && past_r < inside && past_q + through * (past_p - past_q) < inside)) return false;
  }
  bool alone = true;
  maybe_between(q, step.r, 6.0 * lift_, [&](std::uint32_t f) { alone = alone && f == held_.face; });
  if (!alone) return false;
  count_ = 1;
  contacts_[0] = {0, static_cast<std::int32_t>(held_.face), step.slips, held_.surface.normal()};
  last_move_ = step.r - q;
  r = step.r;
  return true;
}

Vec3 MeshSurface::operator()(double /*K*/, const Vec3& p, const Vec3& q) noexcept {
  count_ = 0;
  if (is_clear(p, q)) return p;
  Vec3 r;
  if (glides(p, q, r)) return r;
  Walk walk(*this, p, q);
  r = walk.run();
  if (count_ == 1) keep_side(contacts_[0]);
  return r;
}

}  // namespace proxarm::models
