#include "controller/extras/trials/inertia_advice.hpp"

#include <algorithm>
#include <vector>

#include "controller/preparation/session_loops.hpp"

namespace proxarm::command_line {
namespace {

using controller::HandModel;
using controller::LoopModel;
using controller::PoseLoopModel;

// Returns the hand in rotation, `turning`, made stiffer and heavier by the factors by which `other_place` is stiffer
// and heavier than `place`.
HandModel likewise(const HandModel& turning, const HandModel& place, const HandModel& other_place) {
  HandModel other = turning;
  other.stiffness_N_per_m *= other_place.stiffness_N_per_m / place.stiffness_N_per_m;
  if (place.mass_kg > 0.0) other.mass_kg *= other_place.mass_kg / place.mass_kg;
  return other;
}

// Returns the smallest inertia of at least `least_kg_m2` that is stable in all of the poses; nullopt if there is none.
std::optional<double> smallest_in(const controller::PreparedSession& session, const PoseLoopModel& model,
                                  const std::vector<models::JointVector>& poses_rad, double least_kg_m2) {
  const models::Arm arm(session.cell);
  const double mass_kg = session.settings.mass_kg;
  for (const models::JointVector& pose_rad : poses_rad) {
    const controller::PoseLoop loop = controller::pose_loop_at(arm, pose_rad, session.cell, model);
    if (least_kg_m2 > 0.0 && loop.stable(mass_kg, least_kg_m2)) continue;
    const std::optional<double> smallest = loop.smallest_inertia(mass_kg);
    if (!smallest) return {};
    least_kg_m2 = std::max(least_kg_m2, *smallest);
  }
  return least_kg_m2;
}

}  // namespace

SmallestInertias smallest_inertias(const controller::PreparedSession& session) {
  const PoseLoopModel model = *controller::turned_model(session);
  const std::vector<models::JointVector> poses_rad = controller::led_poses(session);
  SmallestInertias out;
  out.at_start = smallest_in(session, model, {poses_rad.front()}, 0.0);
  if (out.at_start) out.everywhere = smallest_in(session, model, poses_rad, *out.at_start);
  if (!out.everywhere) return out;
  double worst = *out.everywhere;
  const auto holds = [&](const HandModel& hand, const LoopModel& loop) {
    PoseLoopModel other = model;
    other.place = hand;
    other.turning = likewise(model.turning, model.place, hand);
    other.loop = loop;
    const std::optional<double> smallest = smallest_in(session, other, poses_rad, worst);
    worst = smallest.value_or(worst);
    return smallest.has_value();
  };
  if (controller::with_margins(model.place, model.loop, holds)) out.with_margins = worst;
  return out;
}

}  // namespace proxarm::command_line
