#include "controller/motion/hand_judge.hpp"

#include <algorithm>

namespace proxarm::controller {

HandSigns hand_signs(const models::Wrench& hand_W, const SensorBias& bias, const models::Vec3& v_W, double mass_kg,
                     bool at_handle) noexcept {
  return {.hand_W = hand_W,
          .noise_N = bias.noise_N,
          .noise_is_white = bias.noise_is_white,
          .tare_samples = bias.samples,
          .sample_cycles = bias.sample_cycles,
          .v_W = v_W,
          .mass_kg = mass_kg,
          .at_handle = at_handle};
}

HandJudge::HandJudge(const description::SupervisionDescription& supervision, const HandJudgeConfig& config,
                     double period_s)
    : supervision_(supervision),
      period_s_(period_s),
      always_held_(config.always_held),
      hand_(config.tool, config.lag_s, period_s) {
  if (supervision.let_go == description::LetGo::coast || config.always_held) return;
  empty_.emplace(
      EmptyHandleConfig{
          .band_N = supervision.empty_handle_N, .tool_mass_kg = config.tool.mass_kg, .lever_m = config.lever_m},
      period_s);
}

void HandJudge::set_period(double period_s, double lag_s) noexcept {
  period_s_ = period_s;
  hand_.set_period(period_s, lag_s);
  if (empty_) empty_->set_period(period_s);
}

void HandJudge::set_tool(const HeldTool& tool) noexcept {
  hand_.set_tool(tool);
  if (empty_) empty_->set_tool_mass(tool.mass_kg);
}

void HandJudge::start() noexcept {
  share_ = 0.0;
  hand_.start();
  if (empty_) empty_->start();
  reversed_.start();
  straight_.start();
}

models::Wrench HandJudge::step(const MotionCycle& cycle, const ProxyMotion& proxy) noexcept {
  let_in(cycle.record);
  const Measured& measured = cycle.measured;
  hand_.step(measured.hand_W, measured.R_WS, proxy.v_W, measured.bias.noise_N, measured.bias.beside_zero_S);
  const models::Wrench hand_W{share_ * measured.hand_W.force, share_ * measured.hand_W.torque};
  if (!empty_) {
    judge(cycle, proxy, false);
    return hand_W;
  }
  HandSigns signs = hand_signs(hand_.wrench_W(), measured.bias, proxy.v_W, proxy.mass_kg, hand_.at_handle());
  signs.left_by_tare = hand_.left_by_tare();
  signs.as_offset = hand_.as_offset();
  signs.limited = proxy.limited;
  const bool empty = empty_->step(signs);
  cycle.record.set(RecordFlag::hands_off, empty);
  judge(cycle, proxy, empty && !empty_->led());
  if (!empty) return hand_W;
  return {empty_->braking_force_W(proxy.mass_kg, proxy.v_W), proxy.braking_torque_W};
}

// Raises the wrench's share linearly from 0 to 1 over ramp_in_s.
void HandJudge::let_in(CycleRecord& record) noexcept {
  if (share_ >= 1.0) return;
  const double ramp_s = supervision_.ramp_in_s;
  share_ = ramp_s > 0.0 ? std::min(1.0, share_ + period_s_ / ramp_s) : 1.0;
  record.set(RecordFlag::ramp_in, share_ < 1.0);
}

// Raises a fault if no hand can have made the force, given the motion that follows it.
void HandJudge::judge(const MotionCycle& cycle, const ProxyMotion& proxy, bool empty) noexcept {
  const SensorBias& bias = cycle.measured.bias;
  const ForceAndMotion now{.force_W = hand_.wrench_W().force,
                           .q_W = proxy.q_W,
                           .v_W = proxy.v_W,
                           .mass_kg = proxy.mass_kg + hand_.tool_mass_kg(),
                           .damping_Ns_per_m = proxy.damping_Ns_per_m,
                           .period_s = period_s_,
                           .free = !proxy.touches,
                           .at_handle = hand_.at_handle() || always_held_};
  const double force_N = now.force_W.norm();
  if (reversed_.step(now)) cycle.alarm.raise(Fault::force_reversed, -1, force_N, 0.0);
  if (straight_.step(now, empty, bias.noise_N)) {
    cycle.alarm.raise(Fault::sensor_drifts, -1, force_N, supervision_.max_bias_drift_N);
  }
}

void HandJudge::archive(fieldbus::StateArchive& state) noexcept {
  state(share_);
  hand_.archive(state);
  if (empty_) empty_->archive(state);
  state(reversed_, straight_);
}

}  // namespace proxarm::controller
