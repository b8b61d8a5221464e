#include "controller/apparent_mass.hpp"

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

// Tukey's window: flat in the middle half, a cosine at either end, so that what the model doesn't hold (the arm's
// resonance, say) leaks little from a segment that ends in motion.
double window(std::size_t i, std::size_t count) {
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

// Re(x* y), the inner product of complex numbers seen as pairs of real ones.
double inner(const Complex& x, const Complex& y) { return x.real() * y.real() + x.imag() * y.imag(); }

struct Spectrum {
  Complex window;
  Complex3 F, a, v;
};

}  // namespace

void ApparentMass::add(const Vec3& force_N, const Vec3& position_m) {
  force_.push_back(force_N);
  position_.push_back(position_m);
  if (static_cast<double>(force_.size()) * period_s_ >= longest_segment_s) end_segment();
}

void ApparentMass::end_segment() {
  const std::size_t samples = force_.size();
  const double T = period_s_;
  const double length_s = static_cast<double>(samples) * T;
  // With fewer than 16 samples there is no band to speak of, whatever T is.
  if (samples >= 16 && length_s >= shortest_segment_s && travel(position_) >= least_travel_m) {
    const std::size_t count = samples - 2;  // central differences lose one at either end
    std::vector<Spectrum> band;
    for (int line = 0; low_Hz + line * step_Hz < high_Hz + 0.5 * step_Hz; ++line) {
      const double omega = 2.0 * std::numbers::pi * (low_Hz + line * step_Hz);
      const Complex turn = std::polar(1.0, -omega * T);
      Complex phase = 1.0;
      Spectrum s{};
      for (std::size_t i = 0; i < count; ++i) {
        const Complex weight = window(i, count) * phase;
        const Vec3 &x0 = position_[i], &x1 = position_[i + 1], &x2 = position_[i + 2];
        s.window += weight;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto j = static_cast<Eigen::Index>(axis);
          s.F[axis] += weight * force_[i + 1][j];
          s.v[axis] += weight * ((x2[j] - x0[j]) / (2.0 * T));
          s.a[axis] += weight * ((x2[j] - 2.0 * x1[j] + x0[j]) / (T * T));
        }
        phase *= turn;
      }
      band.push_back(s);
    }
    // Takes the constant off: what of y lies along the window's own transform.
    double ww = 0.0;
    for (const Spectrum& s : band) ww += std::norm(s.window);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (Complex3 Spectrum::*signal : {&Spectrum::F, &Spectrum::a, &Spectrum::v}) {
        double wy = 0.0;
        for (const Spectrum& s : band) wy += inner(s.window, (s.*signal)[axis]);
        for (Spectrum& s : band) (s.*signal)[axis] -= wy / ww * s.window;
      }
      for (const Spectrum& s : band) {
        aa_ += inner(s.a[axis], s.a[axis]);
        av_ += inner(s.a[axis], s.v[axis]);
        vv_ += inner(s.v[axis], s.v[axis]);
        af_ += inner(s.a[axis], s.F[axis]);
        vf_ += inner(s.v[axis], s.F[axis]);
      }
    }
    used_s_ += length_s;
  }
  force_.clear();
  position_.clear();
}

std::optional<ApparentMass::Estimate> ApparentMass::estimate() const {
  const double determinant = aa_ * vv_ - av_ * av_;
  // Below a part in a million, a and v can't be told apart (a single exponential, say).
  if (!(aa_ > 0.0) || !(determinant > 1e-6 * aa_ * vv_)) return std::nullopt;
  return Estimate{(af_ * vv_ - vf_ * av_) / determinant, (vf_ * aa_ - af_ * av_) / determinant, used_s_};
}

}  // namespace proxarm::controller
