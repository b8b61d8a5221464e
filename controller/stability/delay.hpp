// Delays vectors by τ. The filter is an all-pass, the second-order Padé approximation
//   e^(−sτ) ≈ (s²τ² − 6sτ + 12)/(s²τ² + 6sτ + 12)      phase within 0.1° up to ωτ = 1.5, 2° up to 2.5; magnitude 1
// discretised by the bilinear transform, s = (2/T)(1 − z⁻¹)/(1 + z⁻¹). With c = 2τ/T, in transposed direct form II:
//   (a₂ + a₁z⁻¹ + z⁻²)/(1 + a₁z⁻¹ + a₂z⁻²),   a₀ = c² + 6c + 12,   a₁ = (24 − 2c²)/a₀,   a₂ = (c² − 6c + 12)/a₀
#pragma once

namespace proxarm::controller {

template <typename Vector>
struct Delay {
  bool acts = false;  // false if τ is below half a period: step() then returns its input
  double a1 = 0.0, a2 = 0.0;
  Vector s1, s2;

  void design(double delay_s, double period_s) noexcept {
    const double c = 2.0 * delay_s / period_s;
    acts = c >= 1.0;
    const double a0 = c * c + 6.0 * c + 12.0;
    a1 = (24.0 - 2.0 * c * c) / a0;
    a2 = (c * c - 6.0 * c + 12.0) / a0;
  }
  // Precondition: `zero` has the vectors' size.
  void reset(const Vector& zero) noexcept { s1 = s2 = zero; }
  Vector step(const Vector& in) noexcept {
    if (!acts) return in;
    const Vector out = a2 * in + s1;
    s1 = s2 + a1 * (in - out);
    s2 = in - a2 * out;
    return out;
  }
};

}  // namespace proxarm::controller
