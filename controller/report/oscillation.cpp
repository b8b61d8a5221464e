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

// Each stage is ż = ẋ − ω_c z, by the bilinear transform.
void OscillationWatch::HighPass::step(double period_s, const models::Vec3& in, bool first) noexcept {
  const double half = 0.5 * corner_rad_per_s * period_s;
  const models::Vec3 before = z;
  models::Vec3 x = in;
  for (Stage& stage : stages) {
    if (first) stage = {x, models::Vec3::Zero()};
    const models::Vec3 out = ((x - stage.x) + (1.0 - half) * stage.z) / (1.0 + half);
    stage = {x, out};
    x = out;
  }
  z = x;
  zdot = first ? models::Vec3::Zero() : models::Vec3((z - before) / period_s);
}

void OscillationWatch::add(double time_s, double period_s, const Cycle& cycle) noexcept {
  place_.step(period_s, cycle.tool_W, !filled_);
  if (cycle.turns) rotation_.step(period_s, cycle.turned_W, !filled_);
  filled_ = true;
  if (present_.cycles > 0.0 && time_s - present_.until_s > pause_s) end_spell();
  if (!cycle.oscillates) return;
  if (!(present_.cycles > 0.0)) present_.from_s = time_s;
  present_.until_s = time_s + period_s;
  present_.place2 += place_.z.squaredNorm();
  present_.z2 += place_.z.squaredNorm();
  present_.zdot2 += place_.zdot.squaredNorm();
  if (cycle.turns) {
    present_.turns = true;
    present_.rotation2 += rotation_.z.squaredNorm();
    present_.z2 += cycle.gyration_m2 * rotation_.z.squaredNorm();
    present_.zdot2 += cycle.gyration_m2 * rotation_.zdot.squaredNorm();
  }
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
  Oscillation told;
  told.from_s = from_s;
  told.duration_s = duration_s();
  told.lasts = lasts;
  if (turns) told.amplitude_rad = 0.0;
  if (!(z2 > 0.0)) return told;
  const double omega = std::sqrt(zdot2 / z2), ratio = corner_rad_per_s / omega;
  const double unfiltered = std::pow(1.0 + ratio * ratio, 0.5 * stage_count);
  told.frequency_Hz = omega / (2.0 * std::numbers::pi);
  told.amplitude_m = std::sqrt(2.0 * place2 / cycles) * unfiltered;
  if (turns) told.amplitude_rad = std::sqrt(2.0 * rotation2 / cycles) * unfiltered;
  return told;
}

}  // namespace proxarm::controller
