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

// Of sine². Edges that cross at more than 13° meet at a place that goes along them by no more than four times what it
// goes across: the iteration finds it without the gap's curvature.
constexpr double kCrossing = 0.05;

// Of sine²: 100 µrad. Beyond, rounding moves the place by next to nothing, and what doesn't ask where it was before is
// the same wherever a session goes on from.
constexpr double kAlongEachOther = 1e-8;

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
  if (is_along_side(pair.kind)) return add_bend_of_sides(found, pose, force, K);
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
struct RigidWorld::NearSides {
  Vec3 u, v;
  double own_radius = 0.0, D = 0.0, sine2 = 0.0;
  Mat3 P;
  Eigen::Matrix<double, 3, 6> G;      // the motion of the place on the own axis
  Eigen::Matrix<double, 6, 2> along;  // D_qs, D_qt
  Eigen::Matrix2d inverse;            // of D_ss, D_st, D_tt, times sine²/D
};

// None: parallel.
std::optional<RigidWorld::NearSides> RigidWorld::near_sides(const Found& found, const ToolPose& pose) const noexcept {
  const Pair& pair = pairs_[found.pair];
  const std::optional<Cylinder>&own = shared_->parts[pair.part].cylinder,
        &other = shared_->entries[pair.entry].cylinder;
  const auto along = [](const EdgeLine& edge) { return Vec3((edge.to - edge.from).normalized()); };
  NearSides sides;
  sides.u = pose.orientation * (own ? own->axis : along(own_edge(pair)));
  sides.v = other ? other->axis : along(other_edge(pair));
  if (moves(pair.entry)) sides.v = moving(pair.entry).mover.at().R * sides.v;
  sides.own_radius = own ? own->radius : shared_->parts[pair.part].solid.radius;
  sides.D = found.touch.gap + sides.own_radius;
  if (other) sides.D += other->radius;
  if (const auto* solid = std::get_if<Solid>(&shared_->entries[pair.entry].object.shape)) sides.D += solid->radius;
  sides.sine2 = sides.u.cross(sides.v).squaredNorm();
  if (!(sides.sine2 > 1e-14 && sides.D > 0.0)) return {};
  const Vec3& n = found.touch.normal;
  const Vec3 lever = found.touch.point - pose.position + sides.own_radius * n;
  sides.P = Mat3::Identity() - n * n.transpose();
  sides.G.leftCols<3>().setIdentity();
  sides.G.rightCols<3>() << 0.0, lever.z(), -lever.y(), -lever.z(), 0.0, lever.x(), lever.y(), -lever.x(), 0.0;
  sides.along.col(0) = sides.G.transpose() * (sides.P * sides.u) / sides.D;
  sides.along.col(0).tail<3>() += sides.u.cross(n);
  sides.along.col(1) = -(sides.G.transpose() * (sides.P * sides.v)) / sides.D;
  sides.inverse << 1.0, sides.u.dot(sides.v), sides.u.dot(sides.v), 1.0;
  return sides;
}

bool RigidWorld::add_bend_of_sides(const Found& found, const ToolPose& pose, double force, Mat6& K) const noexcept {
  const std::optional<NearSides> sides = near_sides(found, pose);
  if (!sides || (pairs_[found.pair].kind == Kind::round_edges && sides->sine2 > kCrossing)) return false;
  const auto& along = sides->along;
  K += force * (sides->D / sides->sine2 * along * sides->inverse * along.transpose() -
                sides->G.transpose() * sides->P * sides->G / sides->D);
  return true;
}

// How far the place goes along the tool's axis with a motion of the tool.
Vec3 RigidWorld::way_along_side(const Found& found, const ToolPose& pose, const Twist& delta) const noexcept {
  const std::optional<NearSides> sides = near_sides(found, pose);
  if (!sides) return Vec3::Zero();
  const Vec2 slopes = sides->along.transpose() * delta;
  return -sides->D / sides->sine2 * sides->inverse.row(0).dot(slopes) * sides->u;
}

// Of axes that are parallel to 10 µrad the pose, rounded to 1e-16, tells the place to a micrometre: torques of 10 µN m
// for 10 N, different at each pose. Where the last solution expects it within that, it is where that solution has it.
// The gap there differs from the least by rounding² / (2 D sine²), at most 1e-18 m.
void RigidWorld::stay_along_side(Found& found, const ToolPose& pose) const noexcept {
  const Pressed* last = last_pressed(found.pair, found.which);
  if (last == nullptr) return;
  const std::optional<NearSides> sides = near_sides(found, pose);
  if (!sides || sides->sine2 > kAlongEachOther) return;
  const double way = sides->u.dot(last->place_W - found.touch.point);
  if (!(std::abs(way) * sides->sine2 <= rounding_m(pose))) return;
  const Vec3 on_axis = found.touch.point + sides->own_radius * found.touch.normal + way * sides->u;
  const Vec3 across = sides->u - sides->u.dot(sides->v) * sides->v;
  found.touch.normal = (sides->D * found.touch.normal + way * across).normalized();
  found.touch.point = on_axis - sides->own_radius * found.touch.normal;
}

// Puts the coupling of the local problem, and returns ẽ.
Twist RigidWorld::couple(const ToolPose& pose, const Twist& e) noexcept {
  if (!shared_->bends && !shared_->edges_bend) return e;
  Mat6 K = K_;
  bool bent = false;
  lies_along_ = false;
  for (std::size_t i = 0; i < found_count_; ++i) {
    const Found& found = found_[i];
    const Pressed* last = last_pressed(found.pair, found.which);
    if (last == nullptr) continue;
    const double f_n = found.touch.normal.dot(last->force_W);
    if (!(f_n > 0.0) || !add_bend(found, pose, f_n, K)) continue;
    bent = true;
    lies_along_ = lies_along_ || is_along_side(pairs_[found.pair].kind);
  }
  bends_ = bends_ || bent;
  problem_.set_stiffness(K);
  return bent ? problem_.yield_to(K_ * e) : e;
}

// None: it didn't press in the last solution.
const RigidWorld::Pressed* RigidWorld::last_pressed(std::uint16_t pair, std::uint8_t which) const noexcept {
  for (std::size_t k = 0; k < pressed_count_; ++k) {
    if (pressed_[k].pair == pair && pressed_[k].which == which) return &pressed_[k];
  }
  return nullptr;
}

}  // namespace proxarm::models
