// How gaps bend, and what that does to the local problem.
//
// The solution's balance K (q ⊟ p̂) = Σ J_iᵀ f_i is linearised in q with the normals, which turn with the pose: each
// contact that presses with f_n adds −f_n ∇²gap to K. From inside of something hollow gaps are concave, so that is
// positive semidefinite. With K̃ = K − Σ f_n ∇²gap and ẽ = K̃⁻¹ K e the local problem is the same as before,
//
//   K̃ (ẽ + δ) = Σ J_iᵀ f_i,
//
// at δ = 0 it is the balance itself, and the outer iteration becomes Newton's (sequential quadratic programming).
//
//   a point in a tube or a sphere   gap = R − ‖P x‖, P across the axis or I:  −∇²gap = Gᵀ(P − m mᵀ)G / ‖P x‖, with
//                                   m = P x/‖P x‖ and G the point's motion in the twist
//   a rim                           its place x(α) is the highest of h = ‖P x(α)‖ (of −nᵀx(α) over a plane):
//                                   h_qq − h_qα h_αα⁻¹ h_αq. Where it conforms, h_αα is next to none: minus the
//                                   clearance of a peg in its tube, −r sin(tilt) over a plane
//
// Left out are the terms of the order of the lever over K that come from rotations not being vectors; they slow the
// iteration by a millionth and don't move its end.
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {
namespace {

// Where a hollow surface bends round at a point of it: across P, by 1/distance. Nothing bends of a plane.
struct Round {
  Mat3 P = Mat3::Zero();
  double curvature = 0.0;  // of the surface through the point, 1/m
};

Round round_at(const FlatSide& /*side*/, const Vec3& /*x*/) noexcept { return {}; }

Round round_at(const HollowSphere& hollow, const Vec3& x) noexcept {
  return {Mat3::Identity(), 1.0 / (x - hollow.centre).norm()};
}

Round round_at(const HollowTube& hollow, const Vec3& x) noexcept {
  const Vec3 along = hollow.to - hollow.from;
  const double s = along.dot(x - hollow.from) / along.squaredNorm();
  if (!hollow.endless && (s < 0.0 || s > 1.0)) {
    return {Mat3::Identity(), 1.0 / (x - (s < 0.0 ? hollow.from : hollow.to)).norm()};
  }
  const Vec3 a = along.normalized();
  return {Mat3::Identity() - a * a.transpose(), 1.0 / (x - hollow.from - s * along).norm()};
}

}  // namespace

// Adds −force ∇²gap to K. False: nothing bends there.
bool RigidWorld::add_bend(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept {
  const Pair& pair = pairs_[found.pair];
  if (pair.kind == Kind::sides || pair.kind == Kind::side_edge) return add_bend_of_sides(found, pose, force, K);
  if (is_flat_rim(pair.kind) && pair.kind != Kind::rim_field) return add_bend_of_rim(found, pose, force, K);
  const bool is_rim = pair.kind == Kind::rim_field;
  if (!is_rim && pair.kind != Kind::point_field) return false;
  const Solid& own = shared_->parts[pair.part].solid;
  const Vec3 m = -found.touch.normal, x = found.touch.point - own.radius * m;
  Round round;
  bool is_tube = false;
  const Placement* on = moves(pair.entry) ? &moving(pair.entry).mover.at() : nullptr;
  with_flat_or_hollow(shared_->entries[pair.entry].object, [&](const auto& shape) {
    round = round_at(shape, on == nullptr ? x : on->back(x));
    is_tube = std::is_same_v<std::decay_t<decltype(shape)>, HollowTube>;
  });
  if (!std::isfinite(round.curvature)) return false;
  if (on != nullptr) round.P = on->R * round.P * on->R.transpose();
  const Mat3 across = round.curvature * (round.P - m * m.transpose());
  const Vec3 lever = x - pose.position;
  Eigen::Matrix<double, 3, 6> G;
  G.leftCols<3>().setIdentity();
  G.rightCols<3>() << 0.0, lever.z(), -lever.y(), -lever.z(), 0.0, lever.x(), lever.y(), -lever.x(), 0.0;
  Mat6 bend = Mat6::Zero();
  if (round.curvature > 0.0) bend = G.transpose() * across * G;
  // Of a rim that is nearly level only the first place is a lowest one, the others are held as they are.
  if (is_rim && (is_tube || found.which == 0)) {
    const Solid::Rim& rim = own.rims[pair.own];
    const Vec3 arm = x - pose * rim.centre, along = (pose.orientation * rim.u.cross(rim.v)).cross(arm);
    const double h_aa = round.curvature > 0.0 ? along.dot(across * along) - m.dot(arm) : -m.dot(arm);
    if (h_aa < -kLevel_m) {
      Twist h_qa = Twist::Zero();
      if (round.curvature > 0.0) h_qa = G.transpose() * (across * along);
      h_qa.tail<3>() += along.cross(m);
      bend -= h_qa * (h_qa / h_aa).transpose();
    }
  }
  if (!(round.curvature > 0.0) && bend.isZero(0.0)) return false;
  K += force * bend;
  return true;
}

// A rim over a face, of either body: nothing bends but the rim, whose lowest place goes around.
bool RigidWorld::add_bend_of_rim(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept {
  const Pair& pair = pairs_[found.pair];
  if (found.which != 0) return false;
  const std::optional<Cylinder>& own = shared_->parts[pair.part].cylinder;
  const bool ours = own && pair.kind != Kind::end_rim;
  const Placement* on = moves(pair.entry) ? &moving(pair.entry).mover.at() : nullptr;
  Vec3 centre, axis;
  if (ours) {
    centre = pose * own->rims[pair.own].centre;
    axis = pose.orientation * own->axis;
  } else {
    const Cylinder& other = *shared_->entries[pair.entry].cylinder;
    centre = other.rims[pair.other].centre;
    axis = other.axis;
    if (on != nullptr) {
      centre = *on * centre;
      axis = on->R * axis;
    }
  }
  // (the tool's point is the face's; where they touch it is the rim's)
  const Vec3 &n = found.touch.normal, x = ours ? found.touch.point : Vec3(found.touch.point - found.touch.gap * n);
  const Vec3 arm = x - centre, along = axis.cross(arm);
  const double h_aa = -std::abs(n.dot(arm));
  if (!(h_aa < -kLevel_m)) return false;
  Twist h_qa = Twist::Zero();
  h_qa.tail<3>() = along.cross(n);
  K -= force * h_qa * (h_qa / h_aa).transpose();
  return true;
}

// Two sides, or a side and an edge, touch where the axes come nearest, D apart, at s and t along them: D's second
// derivatives over the pose and over these, u and v the axes, P across the normal,
//
//   D_qq = GᵀPG/D,  D_qs = [0; u × n] + GᵀPu/D,  D_qt = −GᵀPv/D,  D_ss = D_tt = 1/D,  D_st = −uᵀv/D
//
// Nearly parallel, the place goes far with next to no turn.
bool RigidWorld::add_bend_of_sides(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept {
  const Pair& pair = pairs_[found.pair];
  const std::optional<Cylinder>&own = shared_->parts[pair.part].cylinder,
        &other = shared_->entries[pair.entry].cylinder;
  const double own_radius = own ? own->radius : shared_->parts[pair.part].solid.radius;
  const auto along_edge = [&] {
    const EdgeLine edge = beside_cylinder(pair.part, pair.entry).edge(own ? pair.other : pair.own);
    return Vec3((edge.to - edge.from).normalized());
  };
  const Vec3 u = pose.orientation * (own ? own->axis : along_edge()), v_O = other ? other->axis : along_edge();
  const Vec3 v = moves(pair.entry) ? Vec3(moving(pair.entry).mover.at().R * v_O) : v_O;
  double D = found.touch.gap + own_radius;
  if (other) D += other->radius;
  if (const auto* solid = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape)) D += solid->radius;
  const double sine2 = u.cross(v).squaredNorm();
  if (!(sine2 > 1e-14 && D > 0.0)) return false;
  const Vec3& n = found.touch.normal;
  const Vec3 lever = found.touch.point - pose.position + own_radius * n;
  const Mat3 P = Mat3::Identity() - n * n.transpose();
  Eigen::Matrix<double, 3, 6> G;
  G.leftCols<3>().setIdentity();
  G.rightCols<3>() << 0.0, lever.z(), -lever.y(), -lever.z(), 0.0, lever.x(), lever.y(), -lever.x(), 0.0;
  Eigen::Matrix<double, 6, 2> along;
  along.col(0) = G.transpose() * (P * u) / D;
  along.col(0).tail<3>() += u.cross(n);
  along.col(1) = -(G.transpose() * (P * v)) / D;
  Eigen::Matrix2d inverse;  // of D_ss, D_st, D_tt
  inverse << 1.0, u.dot(v), u.dot(v), 1.0;
  K += force * (D / sine2 * along * inverse * along.transpose() - G.transpose() * P * G / D);
  return true;
}

// Puts the coupling of the local problem, and returns ẽ.
Twist RigidWorld::couple(const ToolPose& pose, const Twist& e) noexcept {
  if (!shared_->bends) return e;
  Mat6 K = K_;
  bool bent = false;
  for (std::size_t i = 0; i < found_count_; ++i) {
    const Found& found = found_[i];
    const Vec3* force = last_force(found.pair, found.which);
    if (force == nullptr) continue;
    const double f_n = found.touch.normal.dot(*force);
    if (f_n > 0.0 && add_bend(found, pose, f_n, K)) bent = true;
  }
  problem_.set_stiffness(K);
  return bent ? problem_.yield_to(K_ * e) : e;
}

// None: it didn't press in the last solution.
const Vec3* RigidWorld::last_force(std::uint16_t pair, std::uint8_t which) const noexcept {
  for (std::size_t k = 0; k < pressed_count_; ++k) {
    if (pressed_[k].pair == pair && pressed_[k].which == which) return &pressed_[k].force_W;
  }
  return nullptr;
}

}  // namespace proxarm::models
