#include "models/rigid_bodies/rigid_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/rigid_features/part_box.hpp"

namespace proxarm::models {
namespace {

RigidMover mover_of(const RigidEntry& entry) {
  const Bounds& bounds = entry.bounds;
  const Vec3 middle = bounds.finite() ? Vec3(0.5 * (bounds.low + bounds.high)) : Vec3(Vec3::Zero());
  return entry.object.motion->driven ? RigidMover(middle) : RigidMover(entry.object.motion->script);
}

}  // namespace

RigidBodies::RigidBodies(std::shared_ptr<const RigidSetup> setup) : setup_(std::move(setup)) {
  for (const RigidEntry& entry : setup_->entries) {
    friction_.push_back(entry.object.friction);
    if (entry.object.motion) moving_.push_back({mover_of(entry)});
  }
}

EdgeLine RigidBodies::own_edge(const Pair& pair) const noexcept { return edge_of(part(pair).solid, pair.own); }

EdgeLine RigidBodies::other_edge(const Pair& pair) const noexcept {
  const TriangleFeatures* mesh = entry(pair).mesh();
  return mesh != nullptr ? mesh->edge(pair.other).line : edge_of(*entry(pair).solid(), pair.other);
}

const Vec3& RigidBodies::other_point(const Pair& pair) const noexcept {
  const TriangleFeatures* mesh = entry(pair).mesh();
  return mesh != nullptr ? mesh->vertex(pair.other) : entry(pair).solid()->points[pair.other];
}

double RigidBodies::friction(const Pair& pair) const noexcept {
  const double mu = friction_[pair.entry];
  const std::optional<double>& own = part(pair).friction;
  return own ? std::sqrt(*own * mu) : mu;
}

void RigidBodies::set_friction(std::int32_t object, double friction) noexcept {
  for (std::size_t i = 0; i < friction_.size(); ++i) {
    if (setup_->entries[i].object.object == object) friction_[i] = friction;
  }
}

double RigidBodies::motion_m(const ToolPose& a, const ToolPose& b) const noexcept {
  return a == b ? 0.0 : size_m(difference(a, b));
}

double RigidBodies::size_m(const Twist& xi) const noexcept {
  return xi.head<3>().norm() + setup_->reach_m * xi.tail<3>().norm();
}

double RigidBodies::rounding_m(const ToolPose& pose) const noexcept {
  return 4.0 * std::numeric_limits<double>::epsilon() * (pose.position.lpNorm<1>() + setup_->reach_m + extent_m_);
}

View RigidBodies::seen_from(std::uint16_t entry, const View& tool) const noexcept {
  if (!moves(entry)) return tool;
  const Placement& at = moving(entry).mover.at();
  return {at.R.transpose() * tool.R, at.back(tool.x)};
}

void RigidBodies::set_time(const StepTime& time) noexcept {
  for (MovingEntry& m : moving_) m.mover.set_time(time);
}

void RigidBodies::drive(std::int32_t object, const Pose& X) noexcept {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    if (setup_->entries[setup_->first_moving + i].object.object == object) moving_[i].mover.drive(X);
  }
}

void RigidBodies::arrive() noexcept {
  for (MovingEntry& m : moving_) m.mover.arrive();
}

void RigidBodies::go_to_time(double time_s) noexcept {
  for (MovingEntry& m : moving_) {
    m.mover.set_time({.time_s = time_s, .period_s = 0.0});
    m.mover.go(1.0);
    m.close = !m.mover.driven();
  }
}

void RigidBodies::take_all_as_close() noexcept {
  for (MovingEntry& m : moving_) m.close = true;
}

// Returns a lower bound of the distance between the tool and an object at its present place, m.
double RigidBodies::room_m(std::uint16_t entry, const ToolPose& pose) const noexcept {
  const RigidEntry& e = setup_->entries[entry];
  const Vec3 x = seen_from(entry, view(pose)).x;
  double room = std::sqrt(distance2_to_box(x, e.bounds)) - setup_->reach_m;
  with_flat_or_hollow(e.object, [&](const auto& shape) { room = touch(shape, x, setup_->reach_m).gap; });
  return room;
}

// Relative to an object, the tool moves by its own motion and by the object's. An object that meets the tool pushes the
// tool by at most the object's own motion, but perhaps into the path of other objects. So the search is repeated until
// it finds no further object.
double RigidBodies::begin_step(const ToolPose& p_hat, const ToolPose& q) noexcept {
  move_to(0.0);
  const double far = motion_m(p_hat, q);
  double most = 0.0;
  extent_m_ = 0.0;
  for (MovingEntry& m : moving_) m.close = false;
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      MovingEntry& m = moving_[i];
      if (m.close) continue;
      const double pushed = 2.0 * (far + most), way = m.mover.way_m(q.position, setup_->reach_m + pushed);
      const auto entry = static_cast<std::uint16_t>(setup_->first_moving + i);
      if (room_m(entry, q) > pushed + 2.0 * way + kFront_m) continue;
      m.close = more = true;
      most = std::max(most, way);
      extent_m_ = std::max(extent_m_, m.mover.size_m());
    }
  }
  carrier_ = only_one_near(q, 2.0 * (far + most) + kFront_m);
  if (!carrier_) return far + most;
  const RigidMover& mover = moving_[*carrier_].mover;
  return motion_m(mover.is().back(p_hat), mover.at().back(q));
}

// Returns the index in moving_ of the moving object near the tool, if no other object is near; else nullopt.
std::optional<std::size_t> RigidBodies::only_one_near(const ToolPose& q, double near) const noexcept {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    if (!moving_[i].close) continue;
    if (found || moving_[i].mover.rests()) return {};
    found = i;
  }
  if (!found) return {};
  for (std::size_t entry = 0; entry < setup_->first_moving; ++entry) {
    if (room_m(static_cast<std::uint16_t>(entry), q) <= near) return {};
  }
  return found;
}

bool RigidBodies::something_approaches() const noexcept {
  return std::any_of(moving_.begin(), moving_.end(), [](const MovingEntry& m) { return m.close && !m.mover.rests(); });
}

ToolPose RigidBodies::goal_at(const ToolPose& p_hat, const ToolPose& q_old, double share) const noexcept {
  if (!carrier_) return moved(q_old, difference(p_hat, q_old) * share);
  const RigidMover& mover = moving_[*carrier_].mover;
  const ToolPose from = mover.was().back(q_old), to = mover.is().back(p_hat);
  return mover.at() * moved(from, difference(to, from) * share);
}

void RigidBodies::move_to(double share) noexcept {
  for (MovingEntry& m : moving_) m.mover.go(share);
}

ToolPose RigidBodies::carry_to(const ToolPose& q, double share) noexcept {
  if (!carrier_) {
    move_to(share);
    return q;
  }
  const Placement& at = moving_[*carrier_].mover.at();
  const ToolPose on = at.back(q);
  move_to(share);
  return at * on;
}

void RigidBodies::measure_slip(const ToolPose& pose, const ToolPose& q_old) noexcept {
  for (MovingEntry& m : moving_) {
    const RigidMover& mover = m.mover;
    if (!m.close || mover.rests()) continue;
    m.slid = pose.position - mover.carried(q_old.position);
    const Quaternion was = Quaternion(Mat3(mover.at().R * mover.was().R.transpose())) * q_old.orientation;
    m.turned = rotation_vector(pose.orientation * was.conjugate());
  }
}

// The slip is computed from the tool's motion instead of from the places of the point. The rounded slips of several
// points then still belong to one rigid motion, so several contacts can stick at once.
//   slip = Δx + (1 − exp(−θ)) lever
Vec3 RigidBodies::slip_m(std::uint16_t entry, const Vec3& lever) const noexcept {
  const MovingEntry& m = moving(entry);
  const double angle = m.turned.norm();
  // sin(φ)/φ and (1 − cos φ)/φ²; below 1e-4 rad the next terms, φ⁴/120 and φ⁴/720, are below rounding.
  const bool small = angle < 1e-4;
  const double s = small ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
  const double c = small ? 0.5 - angle * angle / 24.0 : (1.0 - std::cos(angle)) / (angle * angle);
  const Vec3 w = m.turned.cross(lever);
  return m.slid + s * w - c * m.turned.cross(w);
}

Vec3 RigidBodies::slip_since_m(const ToolPose& q_old, std::uint16_t entry, const Vec3& point,
                               const ToolPose& pose) const noexcept {
  const Vec3 lever = point - pose.position;
  if (moves_now(entry)) return slip_m(entry, lever);
  return point - q_old * (pose.orientation.conjugate() * lever);
}

}  // namespace proxarm::models
