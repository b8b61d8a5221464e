// Objects that move, as a rigid tool meets them.
#include <algorithm>
#include <cmath>

#include "models/rigid/rigid_world.hpp"
#include "models/rigid_features/part_box.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

void RigidWorld::set_time(const StepTime& time) noexcept {
  for (Moving& m : moving_) m.mover.set_time(time);
}

void RigidWorld::drive(std::int32_t object, const Pose& X) noexcept {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    if (shared_->entries[shared_->first_moving + i].object.object == object) moving_[i].mover.drive(X);
  }
}

View RigidWorld::seen_from(std::uint16_t entry, const View& tool) const noexcept {
  if (!moves(entry)) return tool;
  const Placement& at = moving(entry).mover.at();
  return {at.R.transpose() * tool.R, at.back(tool.x)};
}

// A bound from below of the distance between the tool and an object, wherever that is now.
double RigidWorld::room_m(std::uint16_t entry, const ToolPose& pose) const noexcept {
  const Entry& e = shared_->entries[entry];
  const Vec3 x = seen_from(entry, view(pose)).x;
  double room = std::sqrt(distance2_to_box(x, e.bounds)) - shared_->reach;
  with_flat_or_hollow(e.object, [&](const auto& shape) { room = touch(shape, x, shared_->reach).gap; });
  return room;
}

// Which of the objects that move may meet the tool in a step, and by how much the tool and what it may meet come
// together at most. In an object's frame the tool moves by what both move by; what meets the tool pushes it by no more
// than that, and maybe into the way of others.
double RigidWorld::let_come(const ToolPose& p_hat, const ToolPose& q) noexcept {
  let_go(0.0);
  const double far = motion(p_hat, q);
  double most = 0.0;
  extent_m_ = 0.0;
  for (Moving& m : moving_) m.close = false;
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      Moving& m = moving_[i];
      if (m.close) continue;
      const double pushed = 2.0 * (far + most), way = m.mover.way_m(q.position, shared_->reach + pushed);
      const auto entry = static_cast<std::uint16_t>(shared_->first_moving + i);
      if (room_m(entry, q) > pushed + 2.0 * way + kFront_m) continue;
      m.close = more = true;
      most = std::max(most, way);
      extent_m_ = std::max(extent_m_, m.mover.size_m());
    }
  }
  riding_ = alone_with(q, 2.0 * (far + most) + kFront_m);
  if (riding_ == nobody) return far + most;
  const RigidMover& mover = moving_[riding_].mover;
  return motion(mover.is().back(p_hat), mover.at().back(q));
}

// Where one object that moves is all that is near, what counts is how the tool moves seen from it: next to nothing for
// a tool that lies on it, however fast that is.
std::size_t RigidWorld::alone_with(const ToolPose& q, double near) const noexcept {
  std::size_t found = nobody;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    if (!moving_[i].close) continue;
    if (found != nobody || moving_[i].mover.rests()) return nobody;
    found = i;
  }
  if (found == nobody) return nobody;
  for (std::size_t entry = 0; entry < shared_->first_moving; ++entry) {
    if (room_m(static_cast<std::uint16_t>(entry), q) <= near) return nobody;
  }
  return found;
}

bool RigidWorld::something_comes() const noexcept {
  return std::any_of(moving_.begin(), moving_.end(), [](const Moving& m) { return m.close && !m.mover.rests(); });
}

// How far the tool has come since the pairs were gathered, seen from what it may meet.
double RigidWorld::came_m(const ToolPose& q) const noexcept {
  double most = riding_ == nobody ? motion(q, gathered_at_) : 0.0;
  for (const Moving& m : moving_) {
    if (m.close) most = std::max(most, motion(m.mover.at().back(q), m.gathered));
  }
  return most;
}

// p̂ of a part of the step.
ToolPose RigidWorld::on_the_way(const ToolPose& p_hat, const ToolPose& q_old, double share) const noexcept {
  if (riding_ == nobody) return moved(q_old, difference(p_hat, q_old) * share);
  const RigidMover& mover = moving_[riding_].mover;
  const ToolPose from = mover.was().back(q_old), to = mover.is().back(p_hat);
  return mover.at() * moved(from, difference(to, from) * share);
}

void RigidWorld::let_go(double share) noexcept {
  for (Moving& m : moving_) m.mover.go(share);
}

// Where the tool is then that stays where it is, seen from what it is alone with: parts are short in that frame, while
// the object may go by far in W.
ToolPose RigidWorld::let_go_with(const ToolPose& q, double share) noexcept {
  if (riding_ == nobody) {
    let_go(share);
    return q;
  }
  const Placement& at = moving_[riding_].mover.at();
  const ToolPose on = at.back(q);
  let_go(share);
  return at * on;
}

// Where a part of the step begins to look for the tool: where it was on what held it most, as far as that has gone on.
// There gaps are what they were, and feet on their features. Seen from where the tool stays in W, what held it has gone
// on by the object's way: its foot may be beyond an edge by that, so that nothing holds the tool, or what is behind the
// edge does. Precondition: the sides are those of where the tool was.
ToolPose RigidWorld::along_with_holder(const ToolPose& q) const noexcept {
  if (riding_ != nobody) return q;
  const Pair* holder = nullptr;
  for (std::size_t i = 0; i < pair_count_; ++i) {
    if (!pairs_[i].pressed) continue;
    if (holder == nullptr || pairs_[i].force_W.squaredNorm() > holder->force_W.squaredNorm()) holder = &pairs_[i];
  }
  if (holder == nullptr || !goes(holder->entry)) return q;
  const Moving& m = moving(holder->entry);
  return m.mover.at() * ToolPose{m.from.x, Quaternion(m.from.R)};
}

// How the tool has moved since q(k−1), seen from what moves.
void RigidWorld::see_slip(const ToolPose& pose, const ToolPose& q_old) noexcept {
  for (Moving& m : moving_) {
    const RigidMover& mover = m.mover;
    if (!m.close || mover.rests()) continue;
    m.slid = pose.position - mover.carried(q_old.position);
    const Quaternion was = Quaternion(Mat3(mover.at().R * mover.was().R.transpose())) * q_old.orientation;
    m.turned = rotation_vector(pose.orientation * was.conjugate());
  }
}

// Of the tool's material point that is at a lever from its reference point now. By the tool's motion, not by the
// point's places: rounding is then that of a rigid motion, which contacts that stick together don't contradict.
//   slip = Δx + (1 − exp(−θ)) lever
Vec3 RigidWorld::slip_on(std::uint16_t entry, const Vec3& lever) const noexcept {
  const Moving& m = moving(entry);
  const double angle = m.turned.norm();
  // sin(φ)/φ and (1 − cos φ)/φ²; below 1e-4 rad the next terms, φ⁴/120 and φ⁴/720, are below rounding.
  const bool small = angle < 1e-4;
  const double s = small ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
  const double c = small ? 0.5 - angle * angle / 24.0 : (1.0 - std::cos(angle)) / (angle * angle);
  const Vec3 w = m.turned.cross(lever);
  return m.slid + s * w - c * m.turned.cross(w);
}

// Of the tool's material point that is at `point` at a pose: against the object, wherever that went.
Vec3 RigidWorld::slip_since(const ToolPose& q_old, std::uint16_t entry, const Vec3& point,
                            const ToolPose& pose) const noexcept {
  const Vec3 lever = point - pose.position;
  if (goes(entry)) return slip_on(entry, lever);
  return point - q_old * (pose.orientation.conjugate() * lever);
}

// Where more contacts hold than needed, one may have its force on the cone without slipping.
void RigidWorld::judge_slips(const ToolPose& q_old, double rounding) noexcept {
  see_slip(q_, q_old);
  for (std::size_t k = 0; k < count_; ++k) {
    PoseContact& contact = contacts_[k];
    const Vec3 slip = slip_since(q_old, of_contact_[k], contact.point_W, q_);
    contact.slips = contact.slips && (slip - contact.normal_W * contact.normal_W.dot(slip)).norm() > rounding;
  }
}

// How far the tool has come since the sides were taken, seen from what it may meet.
double RigidWorld::strode_m(const ToolPose& pose) const noexcept {
  double most = riding_ == nobody ? motion(pose, from_) : 0.0;
  for (const Moving& m : moving_) {
    if (!m.close) continue;
    most = std::max(most, motion(m.mover.at().back(pose), {m.from.x, Quaternion(m.from.R)}));
  }
  return most;
}

// Whether the tool may be at a pose, by the sides on which it was: no gap is below 0. Sides tell nothing about a pose
// that is further away than they reach.
bool RigidWorld::has_room(const ToolPose& pose) noexcept {
  if (strode_m(pose) > behind_m_) return false;
  find(pose);
  return !overflow_ && std::all_of(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(found_count_),
                                   [](const Found& found) { return found.touch.gap >= -kGap_m; });
}

// Where no solution is found while something moves, the tool can't just stay. It goes where it may be: where it was, or
// where that is on something that moves. None: it is squeezed. Precondition: the sides are those of where it was.
bool RigidWorld::give_way(ToolPose& q) noexcept {
  if (has_room(q)) return true;
  for (const Moving& m : moving_) {
    if (!m.close || m.mover.rests()) continue;
    const Placement& at = m.mover.at();
    const ToolPose with{at * m.from.x, Quaternion(Mat3(at.R * m.from.R)).normalized()};
    if (!has_room(with)) continue;
    q = with;
    return true;
  }
  squeezed_ = true;
  return false;
}

double RigidWorld::clearance_at_m(const ToolPose& pose, double time_s) const noexcept {
  RigidWorld copy(*this);
  for (Moving& m : copy.moving_) {
    m.mover.set_time({.time_s = time_s, .period_s = 0.0});
    m.mover.go(1.0);
    m.close = !m.mover.driven();
  }
  return copy.least_gap_m(pose);
}

}  // namespace proxarm::models
