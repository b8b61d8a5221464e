// Computes the lines of a periodic record, x(t) = Re Σ_h X_h e^(i 2π h t/period), and the variance of the lines.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace proxarm::identification {

struct Spectrum {
  std::vector<int> lines;  // h, multiples of the base frequency
  Eigen::MatrixXcd mean;   // X_h, a row per line and a column per channel
  // Variance of the mean's real part and of its imaginary part, from the differences between periods.
  Eigen::MatrixXd variance;
};

// Returns the record's spectrum. Precondition: `record` has at least two whole periods of `rows` rows each. The
// variance of a line is averaged with up to five neighbours in `lines` on each side, since few periods don't suffice
// for a single line.
Spectrum spectrum(const Eigen::MatrixXd& record, int rows, const std::vector<int>& lines);

Eigen::MatrixXd mean_period(const Eigen::MatrixXd& record, int rows);

}  // namespace proxarm::identification
