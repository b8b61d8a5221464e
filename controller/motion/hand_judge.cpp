#include "controller/motion/hand_judge.hpp"

#include <algorithm>

namespace proxarm::controller {

HandSigns hand_signs(const Measured& measured, const models::Vec3& v_W, double mass_kg) noexcept {
  return {.hand_W = measured.hand_W,
          .noise_N = measured.bias.noise_N,
          .noise_is_white = measured.bias.noise_is_white,
          .tare_samples = measured.bias.samples,
          .sample_cycles = measured.bias.sample_cycles,
          .v_W = v_W,
          .mass_kg = mass_kg};
}

HandJudge::HandJudge(const description::SupervisionDescription& supervision, double tool_mass_kg, double lever_m,
                     double period_s)
    : supervision_(supervision), period_s_(period_s) {
  if (supervision.let_go == description::LetGo::coast) return;
  empty_.emplace(
      EmptyHandleConfig{.band_N = supervision.empty_handle_N, .tool_mass_kg = tool_mass_kg, .lever_m = lever_m},
      period_s);
}

void HandJudge::set_period(double period_s) noexcept {
  period_s_ = period_s;
  if (empty_) empty_->set_period(period_s);
}

void HandJudge::start() noexcept {
  share_ = 0.0;
  if (empty_) empty_->start();
  reversed_.start();
  straight_.start();
}

models::Wrench HandJudge::step(const MotionCycle& cycle, const ProxyMotion& proxy) noexcept {
  let_in(cycle.record);
  const Measured& measured = cycle.measured;
  const models::Wrench hand_W{share_ * measured.hand_W.force, share_ * measured.hand_W.torque};
  if (!empty_) {
    judge(cycle, proxy, false);
    return hand_W;
  }
  const bool empty = empty_->step(hand_signs(measured, proxy.v_W, proxy.mass_kg));
  cycle.record.set(RecordFlag::hands_off, empty);
  judge(cycle, proxy, empty && !empty_->led());
  if (!empty) return hand_W;
  return {empty_->braking_force_W(proxy.mass_kg, proxy.v_W), proxy.braking_torque_W};
}

// Raises the share that is let in linearly from 0 to 1 over ramp_in_s.
void HandJudge::let_in(CycleRecord& record) noexcept {
  if (share_ >= 1.0) return;
  const double ramp_s = supervision_.ramp_in_s;
  share_ = ramp_s > 0.0 ? std::min(1.0, share_ + period_s_ / ramp_s) : 1.0;
  record.set(RecordFlag::ramp_in, share_ < 1.0);
}

// Judges whether a hand can have made this force, given the motion that followed.
void HandJudge::judge(const MotionCycle& cycle, const ProxyMotion& proxy, bool empty) noexcept {
  const SensorBias& bias = cycle.measured.bias;
  const ForceAndMotion now{.force_W = cycle.measured.hand_W.force,
                           .q_W = proxy.q_W,
                           .v_W = proxy.v_W,
                           .mass_kg = proxy.mass_kg,
                           .damping_Ns_per_m = proxy.damping_Ns_per_m,
                           .period_s = period_s_,
                           .free = !proxy.touches};
  const double force_N = now.force_W.norm();
  if (reversed_.step(now)) cycle.alarm.raise(Fault::force_reversed, -1, force_N, 0.0);
  if (straight_.step(now, empty, bias.noise_N)) {
    cycle.alarm.raise(Fault::sensor_drifts, -1, force_N, supervision_.max_bias_drift_N);
  }
}

void HandJudge::archive(fieldbus::StateArchive& state) noexcept {
  state(share_);
  if (empty_) empty_->archive(state);
  state(reversed_, straight_);
}

}  // namespace proxarm::controller
