#include "models/rigid/step_in_batches.hpp"

#include <algorithm>
#include <cmath>

#include "models/rigid/budget.hpp"
#include "models/rigid/free_room.hpp"

namespace proxarm::models {
namespace {

// The reach of the pairs, as a multiple of the motion in a part.
constexpr double kGatheredParts = 8.0;
// This share of a lower bound of a distance is used at once; a tenth of the distance is left for rounding.
constexpr double kOfRoom = 0.9;
// Largest factor by which a batch may be longer than the batch before. A batch that was too long is divided by the
// square of this factor.
constexpr int kLonger = 4;
// The cost of a pose with its local problem, as a number of evaluated pairs.
constexpr int kOfPose = 150;

}  // namespace

bool StepInBatches::take() noexcept {
  state_->bodies.move_to(0.0);
  state_->gather(way_.q_old, kGatheredParts * way_.each_m());
  begin_batch();
  state_->touches.count = 0;
  Next next = Next::on;
  while (next != Next::end && next != Next::nowhere) {
    if (state_->candidates.crowded) {  // a pair that wasn't gathered may be in the way
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

// Gathers pairs around the reached pose if necessary, and takes the sides there.
void StepInBatches::begin_batch() noexcept {
  if (state_->gather_if_far(reached_)) {
    attempt_->looks_left -= kOfPose + 4 * static_cast<int>(state_->candidates.triangles_near);
  }
  state_->take_sides(reached_, way_.each_m());
}

// Moves the tool freely by as many parts as there is room for. Returns whether it did.
bool StepInBatches::go_freely() noexcept {
  const RigidBodies& bodies = state_->bodies;
  const Candidates& candidates = state_->candidates;
  // The tool may be off its path to p̂, because an object held it before.
  const double off = k_ == 0 ? 0.0 : bodies.motion_m(way_.goal(state_->bodies, k_), reached_);
  const int left = way_.parts - k_;
  const double enough = (off + way_.each_m() * left) / kOfRoom;
  // If no pair was gathered, no object is nearer than the reach of the pairs.
  const bool nothing_near = candidates.count == 0;
  double room = nothing_near ? candidates.gathered_reach_m - candidates.came_m(bodies, reached_) : 0.0;
  if (room < enough) room = std::max(room, free_room_m(*state_, reached_, enough, attempt_->looks_left));
  const double free = std::floor(std::min((kOfRoom * room - off) / way_.each_m() + 1e-9, static_cast<double>(left)));
  if (free < (nothing_near ? 1.0 : 2.0) && !(free >= 0.0 && static_cast<int>(free) == left)) return false;
  k_ += static_cast<int>(free);
  state_->bodies.move_to(way_.share(k_));
  reached_ = way_.goal(state_->bodies, k_);
  iteration_->drop_contacts();
  batch_ = 1;
  return true;
}

// Takes a batch in which an object holds the tool or may hold it.
StepInBatches::Next StepInBatches::go_held() noexcept {
  const int to = std::min(k_ + batch_, way_.parts);
  const ToolPose start = state_->bodies.carry_to(reached_, way_.share(to));
  ToolPose p = way_.goal(state_->bodies, to);
  const double ahead = state_->bodies.motion_m(p, start), most = 2.0 * way_.each_m() * batch_;
  const bool last = to == way_.parts && ahead <= most;
  if (ahead > most) p = moved(start, difference(p, start) * (most / ahead));
  allow_part(last, *state_, *attempt_);
  const int before = attempt_->poses_left;
  ToolPose next = fallback_->along_with_holder(start);
  const bool solved = iteration_->settle(p, way_.q_old, next);
  attempt_->looks_left -= kOfPose * (before - attempt_->poses_left);
  const double came = state_->sides.came_m(state_->bodies, next);
  if (batch_ > 1 && !(solved && came <= way_.each_m())) {  // the batch was too long
    attempt_->overflow = false;
    batch_ = std::max(batch_ / (kLonger * kLonger), 1);
    state_->bodies.move_to(way_.share(k_));
    return Next::again;
  }
  reached_ = solved ? next : start;
  if (solved) {
    // The next batch gets as many parts as the tool, at its present speed, needs for the motion that one part allows.
    const double longer = std::min(kOfRoom * way_.each_m() / came, double{kLonger}) * batch_;
    batch_ = static_cast<int>(std::clamp(longer, 1.0, static_cast<double>(way_.parts)));
  } else {
    // As in StepInParts, only the forces of the last part are reported. Before it, any pose to which the tool comes
    // without passing through an object is good enough.
    attempt_->overflow = false;
    if (!fallback_->step_aside(reached_) || to == way_.parts) return Next::nowhere;
  }
  k_ = to;
  return solved && last ? Next::end : Next::on;
}

// Called if the budget is used up: moves the objects to their places at the step's end, while the tool stays where it
// is or is carried along.
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
  const double done = way_.share(k_), rest = (1.0 - done) * most / way_.each_m();
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
