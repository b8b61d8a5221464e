#include "controller/motion/tool_change.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;
using models::Wrench;

// A hand feels a force that changes by 2 N/s as a gradual change, not a jerk, and yields to it.
constexpr double shortest_fade_s = 1.0, fade_N_per_s = 2.0, fade_Nm_per_s = 0.2;
// Lever that converts the uncertainty of a force to that of a torque: a handle's length.
constexpr double torque_lever_m = 0.1;
// New figures are accepted if they explain at least this share of the reading that the present figures don't explain.
constexpr double explained_share = 0.5;

// Returns the largest accepted reading after the change. A change below the uncertainty `open` is always accepted.
double most_read(const Vec3& read, const Vec3& change, double open) noexcept {
  if (change.norm() <= open) return read.norm() + open;
  return std::max(open, explained_share * read.norm());
}

}  // namespace

HeldTool held_tool(const description::ToolDescription& tool) noexcept {
  return {tool.mass_kg, Vec3(tool.centre_of_mass_S_m.data()), Vec3(tool.handle_S.position_m.data())};
}

const char* ToolDoubt::text(Why why) noexcept {
  switch (why) {
    case Why::none:
      return nullptr;
    case Why::zero:
      return "with this tool the sensor's zero would be further from the one that is remembered than it drifts";
    case Why::force:
      return "the sensor reads another weight than this tool has: the arm would be led off";
    case Why::torque:
      return "the sensor reads another torque than this tool's weight makes: the arm would be led off";
  }
  return nullptr;
}

Wrench ToolEvidence::change(const HeldTool& from, const HeldTool& to) const noexcept {
  const double more_kg = to.mass_kg - from.mass_kg;
  const Vec3 moment = to.mass_kg * to.centre_S - from.mass_kg * from.centre_S;
  return {more_kg * turned_S, (moment - more_kg * from.handle_S).cross(turned_S)};
}

ToolDoubt ToolEvidence::doubt(const HeldTool& from, const HeldTool& to) const noexcept {
  using Why = ToolDoubt::Why;
  if (learnt_S.isZero(0.0)) return {};
  const double off_N = zero_off_S.norm();
  const double would_N = (zero_off_S - (to.mass_kg - from.mass_kg) * learnt_S).norm();
  if (would_N > std::max(zero_limit_N, off_N)) return {Why::zero, would_N, zero_limit_N};
  const bool confirmed = std::isfinite(zero_limit_N) && would_N <= explained_share * off_N;
  const Wrench by = change(from, to);
  const double force_N = (hand_S.force + by.force).norm(), most_N = most_read(hand_S.force, by.force, open_N);
  if (!confirmed && force_N > most_N) return {Why::force, force_N, most_N};
  const double torque_Nm = (hand_S.torque + by.torque).norm();
  const double most_Nm = most_read(hand_S.torque, by.torque, open_N * torque_lever_m);
  // The remembered zero confirms the mass, but not the centre of mass.
  if (torque_Nm <= most_Nm || (confirmed && to.centre_S == from.centre_S)) return {};
  return {Why::torque, torque_Nm, most_Nm};
}

ToolEvidence::Numbers ToolEvidence::numbers() const noexcept {
  Numbers all{};
  double* at = all.data();
  for (const Vec3* vector : {&hand_S.force, &hand_S.torque, &turned_S, &learnt_S, &zero_off_S}) {
    at = std::copy_n(vector->data(), 3, at);
  }
  at[0] = zero_limit_N;
  at[1] = open_N;
  return all;
}

ToolEvidence ToolEvidence::of(const Numbers& numbers) noexcept {
  ToolEvidence seen;
  const double* at = numbers.data();
  for (Vec3* vector : {&seen.hand_S.force, &seen.hand_S.torque, &seen.turned_S, &seen.learnt_S, &seen.zero_off_S}) {
    std::copy_n(at, 3, vector->data());
    at += 3;
  }
  seen.zero_limit_N = at[0];
  seen.open_N = at[1];
  return seen;
}

ToolChange::ToolChange(const description::ToolDescription& tool) : tool_(tool) {
  state_.from = state_.present = state_.wanted = held_tool(tool);
}

void ToolChange::take(const HeldTool& wanted, const Wrench& change) noexcept {
  state_.from = state_.present;
  state_.wanted = wanted;
  state_.share = 0.0;
  state_.fade_s = std::max({shortest_fade_s, change.force.norm() / fade_N_per_s, change.torque.norm() / fade_Nm_per_s});
}

bool ToolChange::step(double period_s) noexcept {
  State& s = state_;
  if (s.share >= 1.0) return false;
  s.share = std::min(1.0, s.share + period_s / s.fade_s);
  s.present.mass_kg = s.from.mass_kg + s.share * (s.wanted.mass_kg - s.from.mass_kg);
  s.present.centre_S = s.from.centre_S + s.share * (s.wanted.centre_S - s.from.centre_S);
  if (s.share >= 1.0) s.present = s.wanted;
  return true;
}

models::ToolInertia ToolChange::about_T(const HeldTool& figures) noexcept {
  tool_.mass_kg = figures.mass_kg;
  std::copy_n(figures.centre_S.data(), 3, tool_.centre_of_mass_S_m.begin());
  return models::tool_about_T(tool_);
}

}  // namespace proxarm::controller
