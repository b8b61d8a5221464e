#include "controller/stability/passed_poses.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace proxarm::controller {

PassedPoses::PassedPoses(const models::Arm& arm, const description::Cell& cell, const HandModel& hand,
                         const LoopModel& loop, std::optional<PoseLoopModel> turned)
    : arm_(arm), cell_(cell), hand_(hand), loop_(loop), turned_(std::move(turned)) {}

void PassedPoses::change(const LoopModel& loop) {
  loop_ = loop;
  places_.clear();
}

bool PassedPoses::is_new(const models::ToolPose& tool_W, const Felt& felt) {
  if (!(felt == felt_)) {
    felt_ = felt;
    places_.clear();
    return false;
  }
  const auto near = [&](const models::ToolPose& place) { return are_near(place, tool_W); };
  const auto found = std::find_if(places_.rbegin(), places_.rend(), near);  // nearly always the last
  if (found == places_.rend()) {
    places_.push_back(tool_W);
    return true;
  }
  std::iter_swap(found, places_.rbegin());
  return false;
}

namespace {
// Returns whether the unstable place `there` requires more than `factor` times what `others` require.
bool asks_for_more(const UnstablePlaces& there, const std::optional<UnstablePlaces>& others, double factor) {
  if (!others || there.lacks_mass != others->lacks_mass) return !others || there.lacks_mass;
  return there.smallest_stable.value_or(HUGE_VAL) > factor * others->smallest_stable.value_or(HUGE_VAL);
}

void add(UnstablePlaces there, std::optional<UnstablePlaces>& to) {
  if (!asks_for_more(there, to, 1.0)) return;
  if (to) there.first_s = to->first_s;
  to = there;
}
}  // namespace

std::optional<UnstablePlaces> PassedPoses::judge(const Asked& asked) {
  constexpr double worth_telling = 1.5;
  ++judged_;
  if (asked.felt.mass_kg != told_felt_.mass_kg || asked.felt.inertia_kg_m2 != told_felt_.inertia_kg_m2) told_.reset();
  told_felt_ = asked.felt;
  const LoopModel loop = loop_at(asked);
  if (finds_smallest_) found_.push_back({asked.time_s, asked.felt.mass_kg, smallest_mass(loop)});
  std::optional<UnstablePlaces> there = unstable_at(asked, loop);
  if (!there) return {};
  there->first_s = there->worst_s = asked.time_s;
  add(*there, unstable_);
  if (!asks_for_more(*there, told_, worth_telling)) return {};
  add(*there, told_);
  return told_;
}

LoopModel PassedPoses::loop_at(const Asked& asked) const {
  LoopModel loop = asked.loop;
  loop.damping_Ns_per_m = asked.felt.damping_Ns_per_m;
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(1, elastic_arm(arm_, asked.joints_rad, cell_));
  return loop;
}

// Returns the felt mass, including the part behind the sensor.
std::optional<double> PassedPoses::smallest_mass(const LoopModel& loop) const {
  std::optional<double> smallest = smallest_stable_mass(hand_, loop);
  if (smallest) *smallest += loop.handle_mass_kg;
  return smallest;
}

std::optional<UnstablePlaces> PassedPoses::unstable_at(const Asked& asked, const LoopModel& loop) const {
  UnstablePlaces there;
  const double mass_kg = there.felt_mass_kg = asked.felt.mass_kg;
  const double inertia_kg_m2 = there.felt_inertia_kg_m2 = asked.felt.inertia_kg_m2;
  if (!(spectral_radius(hand_, loop, mass_kg - loop.handle_mass_kg) < 1.0)) {
    there.smallest_stable = smallest_mass(loop);
    return there;
  }
  if (!turned_ || !(inertia_kg_m2 > 0.0)) return {};
  PoseLoopModel model = *turned_;
  model.loop = loop;
  model.turning_damping_Nms_per_rad = asked.felt.turning_damping_Nms_per_rad;
  const PoseLoop both = pose_loop_at(arm_, asked.joints_rad, cell_, model);
  if (both.stable(mass_kg, inertia_kg_m2)) return {};
  there.lacks_mass = false;
  there.smallest_stable = smallest_inertia(both, mass_kg);
  return there;
}

// If an inertia was reported for an earlier place and is stable here, too, then this place requires no more and isn't
// searched.
std::optional<double> PassedPoses::smallest_inertia(const PoseLoop& both, double mass_kg) const {
  const bool known = told_ && !told_->lacks_mass && told_->smallest_stable;
  if (known && both.stable(mass_kg, *told_->smallest_stable)) return told_->smallest_stable;
  return both.smallest_inertia(mass_kg);
}

}  // namespace proxarm::controller
