#include "models/rigid/step_in_batches.hpp"

#include <algorithm>
#include <cmath>

#include "models/rigid/budget.hpp"
#include "models/rigid/free_room.hpp"

namespace proxarm::models {
namespace {

// Pairs are gathered as far around as this many parts lead.
constexpr double kGatheredParts = 8.0;
// This share of a lower bound of a distance is used at once: a tenth is left for rounding.
constexpr double kOfRoom = 0.9;
// By how much a batch may grow if the one before was short enough; a batch that was too long is divided by its square.
constexpr int kLonger = 4;
// A pose with its local problem costs as much as this many pairs.
constexpr int kOfPose = 150;

}  // namespace

bool StepInBatches::take() noexcept {
  state_->bodies.move_to(0.0);
  state_->gather(way_.q_old, kGatheredParts * each_m_);
  begin_batch();
  state_->touches.count = 0;
  Next next = Next::on;
  while (next != Next::end && next != Next::nowhere) {
    if (state_->candidates.crowded) {  // a pair that isn't known may be in the way
      next = Next::nowhere;
    } else if (attempt_->looks_left < 0) {
      wait_for_objects();
      next = Next::nowhere;
    } else if (state_->candidates.pressed.count == 0 && go_freely()) {
      next = k_ == way_.parts ? Next::end : Next::on;
    } else {
      next = go_held();
    }
    if (next == Next::on) begin_batch();
  }
  return next == Next::end;
}

// The pairs are those that are near where the tool is, the sides those on which it is.
void StepInBatches::begin_batch() noexcept {
  if (state_->gather_if_far(reached_)) {
    attempt_->looks_left -= kOfPose + 4 * static_cast<int>(state_->candidates.triangles_near);
  }
  state_->take_sides(reached_, each_m_);
}

// As many parts as there is room for. Whether there were any.
bool StepInBatches::go_freely() noexcept {
  const RigidBodies& bodies = state_->bodies;
  const Candidates& candidates = state_->candidates;
  // The tool may be off its way, where something held it before.
  const double off = k_ == 0 ? 0.0 : bodies.motion_m(way_.goal(state_->bodies, k_), reached_);
  const int left = way_.parts - k_;
  const double enough = (off + each_m_ * left) / kOfRoom;
  // If no pair was gathered, nothing is nearer than pairs are gathered.
  const bool nothing_near = candidates.count == 0;
  double room = nothing_near ? candidates.gathered_reach_m - candidates.came_m(bodies, reached_) : 0.0;
  if (room < enough) room = std::max(room, free_room_m(*state_, reached_, enough, attempt_->looks_left));
  const double free = std::floor(std::min((kOfRoom * room - off) / each_m_ + 1e-9, static_cast<double>(left)));
  if (free < (nothing_near ? 1.0 : 2.0) && !(free >= 0.0 && static_cast<int>(free) == left)) return false;
  k_ += static_cast<int>(free);
  state_->bodies.move_to(way_.share(k_));
  reached_ = way_.goal(state_->bodies, k_);
  iteration_->drop_contacts();
  batch_ = 1;
  return true;
}

// A batch in which something holds the tool, or may.
StepInBatches::Next StepInBatches::go_held() noexcept {
  const int to = std::min(k_ + batch_, way_.parts);
  const ToolPose start = state_->bodies.carry_to(reached_, way_.share(to));
  ToolPose p = way_.goal(state_->bodies, to);
  const double ahead = state_->bodies.motion_m(p, start), most = 2.0 * each_m_ * batch_;
  const bool last = to == way_.parts && ahead <= most;
  if (ahead > most) p = moved(start, difference(p, start) * (most / ahead));
  allow_part(last, *state_, *attempt_);
  const int before = attempt_->poses_left;
  ToolPose next = fallback_->along_with_holder(start);
  const bool solved = iteration_->settle(p, way_.q_old, next);
  attempt_->looks_left -= kOfPose * (before - attempt_->poses_left);
  const double came = state_->sides.came_m(state_->bodies, next);
  if (batch_ > 1 && !(solved && came <= each_m_)) {  // too far at once
    attempt_->overflow = false;
    batch_ = std::max(batch_ / (kLonger * kLonger), 1);
    state_->bodies.move_to(way_.share(k_));
    return Next::again;
  }
  reached_ = solved ? next : start;
  if (solved) {
    // As many parts at once as the tool needs to come as far as it may in one.
    const double longer = std::min(kOfRoom * each_m_ / came, double{kLonger}) * batch_;
    batch_ = static_cast<int>(std::clamp(longer, 1.0, static_cast<double>(way_.parts)));
  } else {
    // As in StepInParts: before the last part any pose will do that leads through nothing.
    attempt_->overflow = false;
    if (!fallback_->step_aside(reached_) || to == way_.parts) return Next::nowhere;
  }
  k_ = to;
  return solved && last ? Next::end : Next::on;
}

// The budget is used up: the tool stays where it is, or is taken along, until all objects are where they are at the
// step's end.
void StepInBatches::wait_for_objects() noexcept {
  RigidBodies& bodies = state_->bodies;
  iteration_->drop_contacts();
  if (bodies.has_carrier()) {
    reached_ = bodies.carry_to(reached_, 1.0);
    return;
  }
  double most = 0.0;
  for (const MovingEntry& m : std::as_const(bodies).moving()) {
    if (m.close) most = std::max(most, m.mover.way_m(reached_.position, bodies.setup().reach_m));
  }
  const double done = way_.share(k_), rest = (1.0 - done) * most / each_m_;
  const int parts = static_cast<int>(std::clamp(std::ceil(rest), 1.0, 8.0 * kMostParts));
  for (int k = 1; k <= parts; ++k) {
    bodies.move_to(done + (1.0 - done) * k / parts);
    attempt_->overflow = false;
    if (!fallback_->step_aside(reached_)) break;
    if (k < parts) begin_batch();
  }
  bodies.move_to(1.0);
}

}  // namespace proxarm::models
