// Measures the mass that the hand feels in free motion: Re(F/a) between 0.3 and 2 Hz, from the hand's force F and the
// tool's acceleration a.
//
// F̂, â, v̂, ĵ are the windowed Fourier transforms of force, acceleration, velocity and jerk over a segment of free
// motion. If F = M a + B v + N ȧ, then F̂(ω) = M â(ω) + B v̂(ω) + N ĵ(ω) at every ω and for any window. M follows by
// least squares over the band, all axes and all segments:
//   [M, B, N] = argmin Σ |F̂ − M â − B v̂ − N ĵ|²,   ω = 2π · (0.3, 0.35, … 2.0 Hz)
// In a long record, a is orthogonal to v and ȧ, so M = Re Σ F̂ â* / Σ |â|², which is Re(F/a). In a short record, a
// isn't orthogonal to them. The term with N is needed because without it a tool that lags (F = M a(t + τ), N = Mτ)
// would seem lighter. The damping is −ω Im(F/a) as one number. It is B of a fit without ĵ; a lag τ makes B negative, by
// about Mω²τ. A constant force (sensor offset, leaning hand) is removed per segment and axis by projecting out the
// window's transform.
//
// Works for a short move as well as for minutes of a multisine. A segment ends after 10 s. A segment is left out if it
// is shorter than 0.5 s, or if the tool moves less than 1 mm in it. Memory is bounded by one segment. Not for the
// cycle.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class ApparentMass {
 public:
  explicit ApparentMass(double period_s) : period_s_(period_s) {}

  // Adds a sample of free motion, one period after the last one.
  void add(const models::Vec3& force_N, const models::Vec3& position_m);
  // Ends the segment where free motion is interrupted. The next sample begins another segment.
  void end_segment();

  struct Estimate {
    double mass_kg = 0.0;
    double damping_Ns_per_m = 0.0;
    double used_s = 0.0;  // length of the segments used
  };
  // Returns the estimate from all finished segments; nullopt if no segment was usable.
  [[nodiscard]] std::optional<Estimate> estimate() const;

 private:
  struct Spectrum;
  static void take_off_constant(std::vector<Spectrum>& band, std::size_t axis);
  void add_to_normal_equations(const Spectrum& s, std::size_t axis);

  double period_s_;
  std::vector<models::Vec3> force_, position_;
  // Normal equations: sums of Re(x* y) over the band, for the regressors a, v, ȧ and for the force.
  Eigen::Matrix3d regressors_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d with_force_ = Eigen::Vector3d::Zero();
  double used_s_ = 0.0;
};

// The felt mass by frequency, for sessions in which many frequencies are excited: F/a = M(f), complex, from 0.4 to 15
// Hz.
//
// Welch's method: free motion is cut into segments of 5 s that overlap by half, with Hann's window. The band around a
// frequency f reaches from 0.9 f to 1.1 f. Summed over the band's lines, all segments and all axes:
//   M(f) = Σ F̂ â* / Σ |â|²,   γ² = |Σ F̂ â*|² / (Σ |F̂|² Σ |â|²)
// A band with γ² below 0.9 is left out: it wasn't excited, or the force isn't that of one mass. A band with fewer than
// three segments is left out, too. Force and acceleration are first averaged over the same 10 ms or so, which doesn't
// change M(f).
class FeltMassCurve {
 public:
  explicit FeltMassCurve(double period_s);

  // add() and end_segment() are used as in ApparentMass.
  void add(const models::Vec3& force_N, const models::Vec3& position_m);
  void end_segment();

  struct Point {
    double frequency_Hz = 0.0;
    std::complex<double> mass_kg;
  };
  // Returns the points over all directions, in ascending frequency; empty if nothing was excited.
  [[nodiscard]] std::vector<Point> points() const;
  // Returns the points along one axis of W (0 to 2). A band is left out if the tool moves less than half as much along
  // this axis as along another axis: the motion along this axis then follows from the other motion and shows no mass.
  [[nodiscard]] std::vector<Point> points_along(std::size_t axis) const;

 private:
  static constexpr std::size_t bands = 18;
  struct Sums {
    std::complex<double> force_acceleration;
    double force = 0.0, acceleration = 0.0;
  };

  void add_average(const models::Vec3& force_N, const models::Vec3& acceleration);
  void add_segment();
  [[nodiscard]] Sums all_axes(std::size_t band) const;
  [[nodiscard]] std::optional<Point> point(std::size_t band, const Sums& sums) const;

  double period_s_;
  std::size_t samples_per_average_, averages_per_segment_;
  std::vector<models::Vec3> last_positions_;  // the last positions, at most two
  models::Vec3 last_force_ = models::Vec3::Zero();
  models::Vec3 force_sum_ = models::Vec3::Zero(), acceleration_sum_ = models::Vec3::Zero();
  std::size_t summed_ = 0;
  std::vector<models::Vec3> force_, acceleration_;  // samples of the present segment
  std::array<std::array<Sums, 3>, bands> sums_{};   // sums of each band and axis
  std::size_t segments_ = 0;
};

// Returns the frequency up to which |M(f) − M|/M stays within `limit`, from the first point on; 0 if the first point
// exceeds `limit`.
double band_within_Hz(const std::vector<FeltMassCurve::Point>& curve, double mass_kg, double limit);
// The limits that summaries report, with their names.
inline constexpr std::array<std::pair<const char*, double>, 3> felt_limits{
    {{"5 %", 0.05}, {"10 %", 0.1}, {"25 %", 0.25}}};

}  // namespace proxarm::controller
