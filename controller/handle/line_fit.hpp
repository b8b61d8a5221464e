// Fits a straight line in time to a force, h = a + b t, by least squares in each axis of W.
#pragma once

#include <cmath>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// Sums over the samples since the line began; n = 0: no samples. The struct is plain, so that its owner can archive it.
struct LineFit {
  models::Vec3 first_W = models::Vec3::Zero();  // first force; subtracted in all sums
  models::Vec3 h = models::Vec3::Zero(), th = models::Vec3::Zero(), hh = models::Vec3::Zero();
  double n = 0.0, t = 0.0, tt = 0.0;

  void add(const models::Vec3& force_W, double period_s) noexcept {
    if (n == 0.0) *this = {.first_W = force_W};
    const double now = n * period_s;
    const models::Vec3 more = force_W - first_W;
    n += 1.0;
    t += now;
    tt += now * now;
    h += more;
    th += now * more;
    hh += more.cwiseAbs2();
  }
};

// The fitted line.
struct FittedLine {
  models::Vec3 end_W;        // the line at the last sample
  models::Vec3 risen_W;      // the line's rise since the first sample
  models::Vec3 variance_N2;  // variance of the residuals
  double deviation = 0.0;    // relative standard deviation of the estimated variance
};

// Returns the line with
//   b = (n Σth − Σt Σh)/(n Σtt − (Σt)²),  a = (Σh − b Σt)/n,  residual variance (Σhh − a Σh − b Σth)/(n − 2).
// Precondition: at least three samples, one every period_s.
inline FittedLine fitted(const LineFit& s, double period_s) noexcept {
  const models::Vec3 b = (s.n * s.th - s.t * s.h) / (s.n * s.tt - s.t * s.t);
  const models::Vec3 a = (s.h - b * s.t) / s.n;
  const models::Vec3 risen_W = (s.n - 1.0) * period_s * b;
  return {.end_W = s.first_W + a + risen_W,
          .risen_W = risen_W,
          .variance_N2 = (s.hh - a.cwiseProduct(s.h) - b.cwiseProduct(s.th)) / (s.n - 2.0),
          .deviation = std::sqrt(2.0 / (s.n - 2.0))};
}

// Whether the force bends: in some axis the residual variance exceeds the noise's variance noise_N² by more than
// `deviations` standard deviations of the estimated variance plus swing_N², the variance of an oscillation. A line
// whose variance is NaN counts as bent.
inline bool bends(const FittedLine& line, double noise_N, double deviations, double swing_N = 0.0) noexcept {
  return !(line.variance_N2.maxCoeff() <= noise_N * noise_N * (1.0 + deviations * line.deviation) + swing_N * swing_N);
}

}  // namespace proxarm::controller
