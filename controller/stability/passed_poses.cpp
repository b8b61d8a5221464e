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
    if (felt.mass_kg != felt_.mass_kg || felt.inertia_kg_m2 != felt_.inertia_kg_m2) told_.reset();
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
// Whether a place that isn't stable asks for more than `factor` times what the others do.
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

std::optional<UnstablePlaces> PassedPoses::judge(double time_s, const models::JointVector& joints_rad) {
  constexpr double worth_telling = 1.5;
  ++judged_;
  std::optional<UnstablePlaces> there = unstable_at(joints_rad);
  if (!there) return {};
  there->first_s = there->worst_s = time_s;
  add(*there, unstable_);
  if (!asks_for_more(*there, told_, worth_telling)) return {};
  add(*there, told_);
  return told_;
}

std::optional<UnstablePlaces> PassedPoses::unstable_at(const models::JointVector& joints_rad) const {
  UnstablePlaces there;
  there.felt_mass_kg = felt_.mass_kg;
  there.felt_inertia_kg_m2 = felt_.inertia_kg_m2;
  LoopModel loop = loop_;
  loop.damping_Ns_per_m = felt_.damping_Ns_per_m;
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(1, elastic_arm(arm_, joints_rad, cell_));
  if (!(spectral_radius(hand_, loop, felt_.mass_kg - loop.handle_mass_kg) < 1.0)) {
    there.smallest_stable = smallest_stable_mass(hand_, loop);
    if (there.smallest_stable) *there.smallest_stable += loop.handle_mass_kg;
    return there;
  }
  if (!turned_ || !(felt_.inertia_kg_m2 > 0.0)) return {};
  PoseLoopModel model = *turned_;
  model.loop = loop;
  model.turning_damping_Nms_per_rad = felt_.turning_damping_Nms_per_rad;
  const PoseLoop both = pose_loop_at(arm_, joints_rad, cell_, model);
  if (both.stable(felt_.mass_kg, felt_.inertia_kg_m2)) return {};
  there.lacks_mass = false;
  there.smallest_stable = both.smallest_inertia(felt_.mass_kg);
  return there;
}

}  // namespace proxarm::controller
