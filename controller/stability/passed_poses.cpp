#include "controller/stability/passed_poses.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace proxarm::controller {

namespace {
constexpr double apart_m = 0.05;
}  // namespace

PassedPoses::PassedPoses(const models::Arm& arm, const description::Cell& cell, const HandModel& hand,
                         const LoopModel& loop)
    : arm_(arm), cell_(cell), hand_(hand), loop_(loop) {}

void PassedPoses::change(const LoopModel& loop) {
  loop_ = loop;
  places_.clear();
}

bool PassedPoses::is_new(const models::Vec3& tool_W_m, double felt_mass_kg, double damping_Ns_per_m) {
  if (felt_mass_kg != felt_mass_kg_ || damping_Ns_per_m != loop_.damping_Ns_per_m) {
    felt_mass_kg_ = felt_mass_kg;
    loop_.damping_Ns_per_m = damping_Ns_per_m;
    places_.clear();
    return false;
  }
  const auto near = [&](const models::Vec3& place) { return (place - tool_W_m).squaredNorm() < apart_m * apart_m; };
  const auto found = std::find_if(places_.rbegin(), places_.rend(), near);  // nearly always the last
  if (found == places_.rend()) {
    places_.push_back(tool_W_m);
    return true;
  }
  std::iter_swap(found, places_.rbegin());
  return false;
}

bool PassedPoses::judge(double time_s, const models::JointVector& joints_rad) {
  ++judged_;
  const double proxy_kg = felt_mass_kg_ - loop_.handle_mass_kg;
  LoopModel loop = loop_;
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(1, elastic_arm(arm_, joints_rad, cell_));
  if (spectral_radius(hand_, loop, proxy_kg) < 1.0) return false;

  std::optional<double> smallest_kg = smallest_stable_mass(hand_, loop);
  if (smallest_kg) *smallest_kg += loop.handle_mass_kg;
  const bool first = !unstable_;
  const auto asks_for = [](const std::optional<double>& mass_kg) { return mass_kg.value_or(HUGE_VAL); };
  if (first) {
    unstable_ = Unstable{time_s, time_s, felt_mass_kg_, smallest_kg};
  } else if (asks_for(smallest_kg) > asks_for(unstable_->smallest_stable_mass_kg)) {
    unstable_ = Unstable{unstable_->first_s, time_s, felt_mass_kg_, smallest_kg};
  }
  return first;
}

}  // namespace proxarm::controller
