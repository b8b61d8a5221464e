// Lines of a periodic record: x(t) = Re Σ_h X_h e^(i 2π h t/period), and how well each is known.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

namespace proxarm::identification {

struct Spectrum {
  std::vector<int> lines;    // h, multiples of the base frequency
  Eigen::MatrixXcd mean;     // X_h, a row for each line and a column for each channel
  Eigen::MatrixXd variance;  // of the real and of the imaginary part of the mean, from what differs between periods
};

// Precondition: `record` has whole periods of `rows` rows each, two at least. The variance of a line is taken over it
// and its neighbours in `lines`, five on each side, since few periods tell little of a single one.
Spectrum spectrum(const Eigen::MatrixXd& record, int rows, const std::vector<int>& lines);

// The mean over all periods.
Eigen::MatrixXd mean_period(const Eigen::MatrixXd& record, int rows);

}  // namespace proxarm::identification
