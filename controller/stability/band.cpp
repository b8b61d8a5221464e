#include "controller/stability/band.hpp"

#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::Vec3;

namespace {

constexpr double ripple_left = 0.02;  // `left` of the header
constexpr double highest_share =
    0.45;  // largest f_c, as a share of the cycle's rate; the bilinear transform ends at 0.5

// Returns f_c in Hz; 0: no low-pass.
double top_Hz(double report_rate_Hz, double period_s) noexcept {
  if (!(report_rate_Hz > 0.0)) return 0.0;
  const double cycles = 1.0 / (report_rate_Hz * period_s);  // N
  if (!(cycles > 1.0)) return 0.0;
  const double corner_Hz = report_rate_Hz * std::pow(ripple_left / (cycles - 1.0), 0.25);
  return corner_Hz * period_s < highest_share ? corner_Hz : 0.0;
}

}  // namespace

// Designs a section by the bilinear transform, prewarped to keep the corner frequency. With Ω = tan(π f T) and the
// quality Q:
//   a₁ = 2(Ω² − 1)/(1 + Ω/Q + Ω²),   a₂ = (1 − Ω/Q + Ω²)/(1 + Ω/Q + Ω²)
// The gain of a high-pass is 1/(1 + Ω/Q + Ω²). The gain of a low-pass is Ω²/(1 + Ω/Q + Ω²).
void Band::Section::design(double omega, double inverse_quality, double b1_of_kind) noexcept {
  const double damping = inverse_quality * omega;  // Ω/Q
  const double scale = 1.0 / (1.0 + damping + omega * omega);
  b1 = b1_of_kind;
  gain = b1 > 0.0 ? omega * omega * scale : scale;
  a1 = 2.0 * (omega * omega - 1.0) * scale;
  a2 = (1.0 - damping + omega * omega) * scale;
}

Vec3 Band::Section::step(const Vec3& in) noexcept {
  const Vec3 scaled = gain * in, out = scaled + s1;
  s1 = s2 + b1 * scaled - a1 * out;
  s2 = scaled - a2 * out;
  return out;
}

void Band::design(const BandLimits& limits, double period_s) noexcept {
  const double pi = std::numbers::pi, omega = std::tan(pi * limits.low_Hz * period_s);
  const std::array angles{pi / 8.0, 3.0 * pi / 8.0};  // angles of Butterworth's poles
  for (std::size_t i = 0; i < bottom_.size(); ++i) bottom_[i].design(omega, 2.0 * std::cos(angles[i]), -2.0);
  const double corner_Hz = top_Hz(limits.report_rate_Hz, period_s);
  smooths_ = corner_Hz > 0.0;
  if (smooths_) top_.design(std::tan(pi * corner_Hz * period_s), std::numbers::sqrt2, 2.0);
}

void Band::reset() noexcept {
  for (Section* section : {&top_, &bottom_[0], &bottom_[1]}) {
    section->s1.setZero();
    section->s2.setZero();
  }
}

}  // namespace proxarm::controller
