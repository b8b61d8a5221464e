#include "models/rigid/step_contacts.hpp"

#include <cmath>

#include "models/rigid_gaps/bends.hpp"

namespace proxarm::models {
namespace {

// The work of a millinewton over a nanometre; less work counts as zero.
constexpr double kNothing_J = 1e-12;

}  // namespace

void StepContacts::collect(const RigidBodies& bodies, const Candidates& candidates, const Touches& touches,
                           const LocalProblem& local, const ToolPose& pose) noexcept {
  count_ = 0;
  collected_ = true;
  with_moving_ = false;
  for (std::size_t k = 0; k < local.count; ++k) {
    const Found& found = touches.found[local.touch_of[k]];
    const Pair& pair = candidates.pairs[found.pair];
    const LinearContact& linear = local.contacts[k];
    if (linear.state == ContactState::open && found.touch.gap > kGap_m) continue;
    const double sine = sine_of_rims(bodies, pair, found.touch, pose);
    more_[count_] = {curvature_per_m(bodies, pair) / (sine * sine), 1.0 / sine, pair.entry};
    with_moving_ = with_moving_ || bodies.moves_now(pair.entry);
    PoseContact& contact = contacts_[count_++];
    contact.object = bodies.entry(pair).object.object;
    contact.part = pair.part;
    contact.feature = static_cast<std::int32_t>(pair.other);
    contact.slips = linear.state == ContactState::slip;
    contact.point_W = found.touch.point;
    contact.normal_W = found.touch.normal;
    contact.force_W = local.axes[k] * in_cone(linear.f, linear.mu);
    contact.gap_m = found.touch.gap;
    contact.friction = bodies.friction(pair);
  }
}

// The tolerance `bends` contains the terms of second order of the work, with the displacement s and the rotation θ:
// 1. The path of a point at a lever deviates from its tangent by θ² lever/2.
// 2. The normal turns by θ while the point moves by s.
// 3. The surface of a round body of radius r deviates from its tangent plane by s²/2r.
// A moving object may do work on the tool. So with a moving object only the tool's motion relative to the object
// counts.
bool StepContacts::give_energy(RigidBodies& bodies, const ToolPose& pose, const ToolPose& q_old) const noexcept {
  if (count_ == 0) return false;
  const View now = view(pose), old = view(q_old);
  double work = 0.0, bends = 0.0;
  const double turned_W = rotation_vector(pose.orientation * q_old.orientation.conjugate()).norm();
  const double rounding = 2.0 * bodies.rounding_m(pose);  // rounding of a displacement between two poses, m
  bodies.measure_slip(pose, q_old);
  for (std::size_t k = 0; k < count_; ++k) {
    const PoseContact& contact = contacts_[k];
    const double force = contact.force_W.norm();
    if (force == 0.0) continue;
    const std::uint16_t entry = more_[k].entry;
    const bool moves = bodies.moves_now(entry);
    const Vec3 way = moves ? bodies.slip_m(entry, contact.point_W - pose.position)
                           : Vec3(contact.point_W - old * now.to_T(contact.point_W));
    const double s = way.norm(), lever = (contact.point_W - pose.position).norm();
    const double turned = moves ? bodies.moving(entry).turned.norm() : turned_W;
    work += contact.force_W.dot(way);
    bends += force *
             (turned * (0.5 * turned * lever + more_[k].turns * s) + 0.5 * more_[k].curvature_per_m * s * s + rounding);
  }
  return work > bends + kNothing_J;
}

void StepContacts::judge_slips(RigidBodies& bodies, const ToolPose& q_old, ToolPose& q) noexcept {
  if (count_ == 0) return;
  const double rounding = 2.0 * bodies.rounding_m(q_old);
  if (!with_moving_) {
    if (bodies.motion_m(q, q_old) > rounding) return;
    q = q_old;
    for (std::size_t k = 0; k < count_; ++k) contacts_[k].slips = false;
    return;
  }
  // If more contacts hold the tool than are needed, the force of a contact may lie on the border of the cone although
  // the contact sticks.
  bodies.measure_slip(q, q_old);
  for (std::size_t k = 0; k < count_; ++k) {
    PoseContact& contact = contacts_[k];
    const Vec3 slip = bodies.slip_since_m(q_old, more_[k].entry, contact.point_W, q);
    contact.slips = contact.slips && (slip - contact.normal_W * contact.normal_W.dot(slip)).norm() > rounding;
  }
}

}  // namespace proxarm::models
