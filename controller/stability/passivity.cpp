#include "controller/stability/passivity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::Vec3;

namespace {

// Relative to the largest ⟨x̃²⟩: the least for an oscillation that lasts, and the bound below which it is over.
constexpr double kept_share = 0.5, died_away = 1.0 / 16.0;

}  // namespace

// Bilinear transform of the all-pass: s = (2/T)(1 − z⁻¹)/(1 + z⁻¹), with c = 2τ/T:
//   a₀ = c² + 6c + 12,   a₁ = (24 − 2c²)/a₀,   a₂ = (c² − 6c + 12)/a₀
void PassivityObserver::Delay::design(double delay_s, double period_s) noexcept {
  const double c = 2.0 * delay_s / period_s;
  acts = c >= 1.0;
  const double a0 = c * c + 6.0 * c + 12.0;
  a1 = (24.0 - 2.0 * c * c) / a0;
  a2 = (c * c - 6.0 * c + 12.0) / a0;
}

Vec3 PassivityObserver::Delay::step(const Vec3& in) noexcept {
  if (!acts) return in;
  const Vec3 out = a2 * in + s1;
  s1 = s2 + a1 * (in - out);
  s2 = in - a2 * out;
  return out;
}

// Bilinear transform, prewarped so that the corner frequency is kept: Ω = tan(π f T), and per section, of quality Q,
//   H(z) = (1 − z⁻¹)²/(1 + Ω/Q + Ω²) / (1 + a₁z⁻¹ + a₂z⁻²)
void PassivityObserver::HighPass::design(double corner_Hz, double period_s) noexcept {
  const double pi = std::numbers::pi, omega = std::tan(pi * corner_Hz * period_s);
  const std::array angles{pi / 8.0, 3.0 * pi / 8.0};  // of Butterworth's poles
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const double damping = 2.0 * std::cos(angles[i]) * omega;  // Ω/Q
    const double scale = 1.0 / (1.0 + damping + omega * omega);
    sections[i].gain = scale;
    sections[i].a1 = 2.0 * (omega * omega - 1.0) * scale;
    sections[i].a2 = (1.0 - damping + omega * omega) * scale;
  }
}

void PassivityObserver::HighPass::reset() noexcept {
  for (Section& section : sections) {
    section.s1.setZero();
    section.s2.setZero();
  }
}

Vec3 PassivityObserver::Section::step(const Vec3& in) noexcept {
  const Vec3 scaled = gain * in, out = scaled + s1;
  s1 = s2 - 2.0 * scaled - a1 * out;
  s2 = scaled - a2 * out;
  return out;
}

PassivityObserver::PassivityObserver(const PassivityConfig& config, double period_s, Damping damping)
    : config_(config), damping_(damping) {
  set_period(period_s);
}

void PassivityObserver::set_period(double period_s) noexcept {
  period_s_ = period_s;
  average_ = 1.0 - std::exp(-period_s / config_.average_s);
  delay_.design(config_.force_age_s, period_s);
  force_.design(config_.low_Hz, period_s);
  motion_.design(config_.low_Hz, period_s);
  place_.design(config_.low_Hz, period_s);
}

void PassivityObserver::start(const Vec3& tool_W) noexcept {
  delay_.s1.setZero();
  delay_.s2.setZero();
  force_.reset();
  motion_.reset();
  place_.reset();
  start_W_ = tool_k1_ = tool_W;
  h_.setZero();
  h_k1_.setZero();
  power_ = band_ = all_ = square_ = force_square_ = added_ = remembered_s_ = 0.0;
  spell_ = {};
  tank_ = config_.tank_J;
  release_s_ = config_.release_s;
  oscillates_ = false;
  energies_ = {};
}

double PassivityObserver::observe_hand(const Vec3& h_W, const Vec3& tool_W) noexcept {
  if (!h_W.allFinite() || !tool_W.allFinite()) return added_;  // a fault follows; the observer's state stays finite
  h_k1_ = h_;
  h_ = h_W;
  const Vec3 step = delay_.step(tool_W - tool_k1_), velocity = step / period_s_;
  tool_k1_ = tool_W;
  energies_.hand += 0.5 * (h_ + h_k1_).dot(step);
  const Vec3 force = force_.step(h_), motion = motion_.step(velocity);
  power_ += average_ * (force.dot(motion) - power_);
  band_ += average_ * (motion.squaredNorm() - band_);
  all_ += average_ * (velocity.squaredNorm() - all_);
  tank_ = std::clamp(tank_ + period_s_ * (power_ + config_.refill_W), -config_.tank_J, config_.tank_J);
  const bool did = oscillates_;
  square_ += average_ * (place_.step(tool_W - start_W_).squaredNorm() - square_);
  force_square_ += average_ * (force.squaredNorm() - force_square_);
  oscillates_ = shakes() || (tank_ < 0.0 && power_ < -config_.refill_W && band_ > config_.share * all_);
  follow_spell();
  if (damping_ != Damping::never) follow_damping(oscillates_ && !did);
  return added_;
}

bool PassivityObserver::shakes() const noexcept {
  const double omega = 2.0 * std::numbers::pi * config_.shake_Hz;
  return force_square_ > config_.shake_N * config_.shake_N && band_ > omega * omega * square_;
}

void PassivityObserver::follow_spell() noexcept {
  remembered_s_ = std::max(0.0, remembered_s_ - period_s_);
  if (oscillates_ && remembered_s_ > 0.0) remembered_s_ = config_.remembered_s;
  spell_.pause_s = oscillates_ && !spell_.over ? 0.0 : spell_.pause_s + period_s_;
  if (spell_.over) {
    if (spell_.pause_s < config_.pause_s) return;
    spell_ = {.most = square_, .over = square_ < kept_share * spell_.most};
    return;
  }
  if (spell_.pause_s > config_.pause_s) spell_ = {};
  if (!oscillates_ && !(spell_.lasted_s > 0.0)) return;
  spell_.lasted_s += period_s_;
  spell_.most = std::max(spell_.most, square_);
  if (square_ < died_away * spell_.most) spell_ = {.most = square_, .over = true};
  if (lasts()) remembered_s_ = config_.remembered_s;
}

bool PassivityObserver::lasts() const noexcept {
  if (!oscillates_ || spell_.lasted_s < config_.lasting_s || square_ < kept_share * spell_.most) return false;
  return 2.0 * square_ >= config_.felt_m * config_.felt_m || spell_.lasted_s >= config_.small_lasting_s;
}

// `begins`: another oscillation begins.
void PassivityObserver::follow_damping(bool begins) noexcept {
  const double felt = felt_damping_Ns_per_m();
  const bool acts = damping_ == Damping::at_once || remembered_s_ > 0.0;
  if (begins && added_ > 0.0) release_s_ = std::min(2.0 * release_s_, config_.longest_release_s);
  const double wanted = shakes() ? config_.most_felt_Ns_per_m : std::min(-felt, config_.most_felt_Ns_per_m);
  if (acts && oscillates_ && wanted > 0.0) {
    const double growth = wanted * period_s_ / config_.rise_s;
    added_ = std::min(added_ + growth, config_.max_damping_Ns_per_m);
    return;
  }
  added_ -= added_ * period_s_ / release_s_;
  if (added_ < config_.gone_Ns_per_m) {
    added_ = 0.0;
    release_s_ = config_.release_s;
  }
}

void PassivityObserver::observe_proxy(const Vec3& v_W, const Vec3& f_W, double mass_kg,
                                      double damping_Ns_per_m) noexcept {
  const double speed_squared = v_W.squaredNorm();
  energies_.proxy += period_s_ * h_.dot(v_W);
  energies_.world += period_s_ * f_W.dot(v_W);
  energies_.kinetic = 0.5 * mass_kg * speed_squared;
  energies_.damping += period_s_ * damping_Ns_per_m * speed_squared;
  energies_.added += period_s_ * added_ * speed_squared;
}

double PassivityObserver::oscillation_m_per_s() const noexcept { return std::sqrt(band_); }

double PassivityObserver::felt_damping_Ns_per_m() const noexcept { return band_ > 0.0 ? power_ / band_ : 0.0; }

}  // namespace proxarm::controller
