#include "controller/report/oscillation.hpp"

#include <cmath>
#include <numbers>

namespace proxarm::controller {
namespace {

constexpr double corner_rad_per_s = 2.0 * std::numbers::pi * 4.0;

}  // namespace

void OscillationWatch::reset() noexcept {
  end_spell();
  filled_ = false;
}

void OscillationWatch::end_spell() noexcept {
  if (present_.outdoes(longest_)) longest_ = present_;
  present_ = {};
}

// ż = ẋ − ω_c z in each stage, by the bilinear transform.
void OscillationWatch::high_pass(double period_s, const models::Vec3& tool_W) noexcept {
  const double half = 0.5 * corner_rad_per_s * period_s;
  const models::Vec3 before = z_;
  models::Vec3 x = tool_W;
  for (Stage& stage : stages_) {
    if (!filled_) stage = {x, models::Vec3::Zero()};
    const models::Vec3 z = ((x - stage.x) + (1.0 - half) * stage.z) / (1.0 + half);
    stage = {x, z};
    x = z;
  }
  z_ = x;
  zdot_ = filled_ ? models::Vec3((z_ - before) / period_s) : models::Vec3::Zero();
  filled_ = true;
}

void OscillationWatch::add(double time_s, double period_s, const Cycle& cycle) noexcept {
  high_pass(period_s, cycle.tool_W);
  if (present_.cycles > 0.0 && time_s - present_.until_s > pause_s) end_spell();
  if (!cycle.oscillates) return;
  if (!(present_.cycles > 0.0)) present_.from_s = time_s;
  present_.until_s = time_s + period_s;
  present_.z2 += z_.squaredNorm();
  present_.zdot2 += zdot_.squaredNorm();
  present_.cycles += 1.0;
  present_.lasts = present_.lasts || cycle.lasts;
}

Oscillation OscillationWatch::present() const noexcept { return present_.measured(); }

Oscillation OscillationWatch::longest() const noexcept {
  return present_.outdoes(longest_) ? present_.measured() : longest_.measured();
}

bool OscillationWatch::Spell::outdoes(const Spell& other) const noexcept {
  return lasts != other.lasts ? lasts : duration_s() > other.duration_s();
}

Oscillation OscillationWatch::Spell::measured() const noexcept {
  if (!(z2 > 0.0)) return {.from_s = from_s, .duration_s = duration_s()};
  const double omega = std::sqrt(zdot2 / z2), ratio = corner_rad_per_s / omega;
  return {.from_s = from_s,
          .duration_s = duration_s(),
          .frequency_Hz = omega / (2.0 * std::numbers::pi),
          .amplitude_m = std::sqrt(2.0 * z2 / cycles) * std::pow(1.0 + ratio * ratio, 0.5 * stage_count),
          .lasts = lasts};
}

}  // namespace proxarm::controller
