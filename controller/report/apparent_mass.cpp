#include "controller/report/apparent_mass.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

namespace proxarm::controller {
namespace {

using models::Vec3;
using Complex = std::complex<double>;
using Complex3 = std::array<Complex, 3>;

constexpr double low_Hz = 0.3, high_Hz = 2.0, step_Hz = 0.05;
constexpr double longest_segment_s = 10.0, shortest_segment_s = 0.5, least_travel_m = 1e-3;

// Returns Tukey's window, which is flat in the middle half and has a cosine at either end. If a segment ends in motion,
// the window keeps motion that isn't modelled (such as the arm's resonance) from leaking into the band.
double tukey_window(std::size_t i, std::size_t count) {
  const double x = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
  const double edge = std::min(x, 1.0 - x) / 0.25;
  return edge >= 1.0 ? 1.0 : 0.5 - 0.5 * std::cos(std::numbers::pi * edge);
}

double travel(const std::vector<Vec3>& positions) {
  Vec3 low = positions.front(), high = low;
  for (const Vec3& p : positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

// Returns Re(x* y), the inner product of two complex numbers as pairs of real numbers.
double inner(const Complex& x, const Complex& y) { return x.real() * y.real() + x.imag() * y.imag(); }

}  // namespace

// The windowed transforms of a segment at one frequency.
struct ApparentMass::Spectrum {
  Complex window;
  Complex3 F;
  std::array<Complex3, 3> x;  // a, v, ȧ

  // Precondition: at least five samples, since central differences lose two samples at either end.
  static Spectrum at(double frequency_Hz, const std::vector<Vec3>& force, const std::vector<Vec3>& position, double T);
};

ApparentMass::Spectrum ApparentMass::Spectrum::at(double frequency_Hz, const std::vector<Vec3>& force,
                                                  const std::vector<Vec3>& position, double T) {
  const std::size_t count = force.size() - 4;
  const Complex turn = std::polar(1.0, -2.0 * std::numbers::pi * frequency_Hz * T);
  Complex phase = 1.0;
  Spectrum s{};
  for (std::size_t i = 0; i < count; ++i) {
    const Complex weight = tukey_window(i, count) * phase;
    const Vec3* x = &position[i + 2];
    const Vec3 acceleration = (x[1] - 2.0 * x[0] + x[-1]) / (T * T), velocity = (x[1] - x[-1]) / (2.0 * T);
    const Vec3 jerk = (x[2] - 2.0 * x[1] + 2.0 * x[-1] - x[-2]) / (2.0 * T * T * T);
    s.window += weight;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto j = static_cast<Eigen::Index>(axis);
      s.F[axis] += weight * force[i + 2][j];
      s.x[0][axis] += weight * acceleration[j];
      s.x[1][axis] += weight * velocity[j];
      s.x[2][axis] += weight * jerk[j];
    }
    phase *= turn;
  }
  return s;
}

// Removes a constant force on one axis: subtracts from each signal its component along the window's transform.
void ApparentMass::take_off_constant(std::vector<Spectrum>& band, std::size_t axis) {
  double ww = 0.0;
  for (const Spectrum& s : band) ww += std::norm(s.window);
  const auto take_off = [&band, ww](const auto& signal) {
    double wy = 0.0;
    for (Spectrum& s : band) wy += inner(s.window, signal(s));
    for (Spectrum& s : band) signal(s) -= wy / ww * s.window;
  };
  take_off([axis](Spectrum& s) -> Complex& { return s.F[axis]; });
  for (std::size_t i = 0; i < 3; ++i) take_off([axis, i](Spectrum& s) -> Complex& { return s.x[i][axis]; });
}

void ApparentMass::add(const Vec3& force_N, const Vec3& position_m) {
  force_.push_back(force_N);
  position_.push_back(position_m);
  if (static_cast<double>(force_.size()) * period_s_ >= longest_segment_s) end_segment();
}

void ApparentMass::end_segment() {
  const double length_s = static_cast<double>(force_.size()) * period_s_;
  // Fewer than 16 samples don't resolve the band, whatever T is.
  if (force_.size() >= 16 && length_s >= shortest_segment_s && travel(position_) >= least_travel_m) {
    std::vector<Spectrum> band;
    for (int line = 0; low_Hz + line * step_Hz < high_Hz + 0.5 * step_Hz; ++line) {
      band.push_back(Spectrum::at(low_Hz + line * step_Hz, force_, position_, period_s_));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      take_off_constant(band, axis);
      for (const Spectrum& s : band) add_to_normal_equations(s, axis);
    }
    used_s_ += length_s;
  }
  force_.clear();
  position_.clear();
}

void ApparentMass::add_to_normal_equations(const Spectrum& s, std::size_t axis) {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    with_force_[row] += inner(s.x[i][axis], s.F[axis]);
    for (std::size_t j = 0; j < 3; ++j) {
      regressors_(row, static_cast<Eigen::Index>(j)) += inner(s.x[i][axis], s.x[j][axis]);
    }
  }
}

std::optional<ApparentMass::Estimate> ApparentMass::estimate() const {
  const Eigen::Vector3d size = regressors_.diagonal().cwiseSqrt();
  if (!(size.minCoeff() > 0.0) || with_force_.isZero(0.0)) return std::nullopt;  // no motion, or no force
  // The matrix is scaled to a unit diagonal. Below 1e-6, a and v can't be told apart, as in a single exponential.
  const Eigen::Matrix3d scaled = size.cwiseInverse().asDiagonal() * regressors_ * size.cwiseInverse().asDiagonal();
  const Eigen::Vector3d force = with_force_.cwiseQuotient(size);
  const Eigen::Matrix2d two = scaled.topLeftCorner<2, 2>();
  if (!(two.determinant() > 1e-6)) return std::nullopt;
  const Eigen::Vector2d mass_and_damping = two.inverse() * force.head<2>();
  Estimate estimate{mass_and_damping[0] / size[0], mass_and_damping[1] / size[1], used_s_};
  if (scaled.determinant() > 1e-6) estimate.mass_kg = (scaled.inverse() * force)[0] / size[0];
  return estimate;
}

// ---- the felt mass by frequency

namespace {

constexpr double average_s = 0.01, segment_s = 5.0;
constexpr double first_Hz = 0.4, last_Hz = 15.0, half_width = 0.1, least_coherence = 0.9;
constexpr std::size_t least_segments = 3;

double band_Hz(std::size_t band, std::size_t bands) {
  return first_Hz * std::pow(last_Hz / first_Hz, static_cast<double>(band) / static_cast<double>(bands - 1));
}

}  // namespace

FeltMassCurve::FeltMassCurve(double period_s)
    : period_s_(period_s),
      samples_per_average_(std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(average_s / period_s)))),
      averages_per_segment_(
          static_cast<std::size_t>(std::lround(segment_s / (static_cast<double>(samples_per_average_) * period_s)))) {}

void FeltMassCurve::end_segment() {
  last_positions_.clear();
  force_.clear();
  acceleration_.clear();
  force_sum_ = acceleration_sum_ = Vec3::Zero();
  summed_ = 0;
}

// The second difference of three positions is the acceleration at the middle position, so it is added with the force of
// the middle sample.
void FeltMassCurve::add(const Vec3& force_N, const Vec3& position_m) {
  if (last_positions_.size() == 2) {
    const Vec3 a = (position_m - 2.0 * last_positions_[1] + last_positions_[0]) / (period_s_ * period_s_);
    force_sum_ += last_force_;
    acceleration_sum_ += a;
    if (++summed_ == samples_per_average_) {
      const auto count = static_cast<double>(summed_);
      add_average(force_sum_ / count, acceleration_sum_ / count);
      force_sum_ = acceleration_sum_ = Vec3::Zero();
      summed_ = 0;
    }
    last_positions_.erase(last_positions_.begin());
  }
  last_positions_.push_back(position_m);
  last_force_ = force_N;
}

void FeltMassCurve::add_average(const Vec3& force_N, const Vec3& acceleration) {
  force_.push_back(force_N);
  acceleration_.push_back(acceleration);
  if (force_.size() < averages_per_segment_) return;
  add_segment();
  const auto half = static_cast<std::ptrdiff_t>(force_.size() / 2);
  force_.erase(force_.begin(), force_.begin() + half);
  acceleration_.erase(acceleration_.begin(), acceleration_.begin() + half);
}

void FeltMassCurve::add_segment() {
  const std::size_t count = force_.size();
  const double step_s = static_cast<double>(samples_per_average_) * period_s_;
  const double line_Hz = 1.0 / (static_cast<double>(count) * step_s);
  Vec3 mean = Vec3::Zero();
  for (const Vec3& f : force_) mean += f / static_cast<double>(count);
  for (std::size_t band = 0; band < bands; ++band) {
    const double f = band_Hz(band, bands);
    const auto first = std::lround((1.0 - half_width) * f / line_Hz),
               last = std::lround((1.0 + half_width) * f / line_Hz);
    for (auto line = first; line <= last; ++line) {
      const Complex turn =
          std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(line) / static_cast<double>(count));
      Complex phase = 1.0;
      Complex3 F{}, a{};
      for (std::size_t i = 0; i < count; ++i) {
        const double x = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
        const Complex weight = (0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * x)) * phase;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto j = static_cast<Eigen::Index>(axis);
          F[axis] += weight * (force_[i][j] - mean[j]);
          a[axis] += weight * acceleration_[i][j];
        }
        phase *= turn;
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Sums& sums = sums_[band][axis];
        sums.force_acceleration += F[axis] * std::conj(a[axis]);
        sums.force += std::norm(F[axis]);
        sums.acceleration += std::norm(a[axis]);
      }
    }
  }
  ++segments_;
}

FeltMassCurve::Sums FeltMassCurve::all_axes(std::size_t band) const {
  Sums all;
  for (const Sums& of_axis : sums_[band]) {
    all.force_acceleration += of_axis.force_acceleration;
    all.force += of_axis.force;
    all.acceleration += of_axis.acceleration;
  }
  return all;
}

// Returns nullopt if the force isn't that of one mass.
std::optional<FeltMassCurve::Point> FeltMassCurve::point(std::size_t band, const Sums& s) const {
  if (segments_ < least_segments || !(s.acceleration > 0.0)) return std::nullopt;
  if (!(std::norm(s.force_acceleration) >= least_coherence * s.force * s.acceleration)) return std::nullopt;
  return Point{band_Hz(band, bands), s.force_acceleration / s.acceleration};
}

std::vector<FeltMassCurve::Point> FeltMassCurve::points() const {
  std::vector<Point> points;
  for (std::size_t band = 0; band < bands; ++band) {
    if (const auto there = point(band, all_axes(band))) points.push_back(*there);
  }
  return points;
}

std::vector<FeltMassCurve::Point> FeltMassCurve::points_along(std::size_t axis) const {
  constexpr double least_share = 0.25;  // share of the strongest axis's squared acceleration
  std::vector<Point> points;
  for (std::size_t band = 0; band < bands; ++band) {
    double strongest = 0.0;
    for (const Sums& of_axis : sums_[band]) strongest = std::max(strongest, of_axis.acceleration);
    const Sums& sums = sums_[band][axis];
    if (sums.acceleration < least_share * strongest) continue;
    if (const auto there = point(band, sums)) points.push_back(*there);
  }
  return points;
}

double band_within_Hz(const std::vector<FeltMassCurve::Point>& curve, double mass_kg, double limit) {
  double within_Hz = 0.0, error_there = 0.0;
  for (const FeltMassCurve::Point& point : curve) {
    const double error = std::abs(point.mass_kg - mass_kg) / mass_kg;
    if (error > limit) {
      if (within_Hz == 0.0) return 0.0;
      // The frequency is interpolated linearly in logarithms.
      const double share = std::log(limit / error_there) / std::log(error / error_there);
      return within_Hz * std::pow(point.frequency_Hz / within_Hz, share);
    }
    within_Hz = point.frequency_Hz;
    error_there = error;
  }
  return within_Hz;
}

}  // namespace proxarm::controller
