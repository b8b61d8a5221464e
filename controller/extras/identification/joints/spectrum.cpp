#include "controller/extras/identification/joints/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace proxarm::identification {
namespace {

constexpr int neighbours = 5;

// Returns the matrix E of X = E x: X_h = 2/N Σ x_n e^(−i 2π h n/N).
Eigen::MatrixXcd projection(int rows, const std::vector<int>& lines) {
  Eigen::MatrixXcd E(static_cast<Eigen::Index>(lines.size()), rows);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    for (int n = 0; n < rows; ++n) {
      const int turns = static_cast<int>(static_cast<std::int64_t>(lines[k]) * n % rows);
      E(static_cast<Eigen::Index>(k), n) = std::polar(2.0 / rows, -2.0 * std::numbers::pi * turns / rows);
    }
  }
  return E;
}

Eigen::MatrixXd smoothed(const Eigen::MatrixXd& raw) {
  Eigen::MatrixXd smooth = raw;
  for (int k = 0; k < raw.rows(); ++k) {
    const int from = std::max(0, k - neighbours), to = std::min(static_cast<int>(raw.rows()), k + neighbours + 1);
    smooth.row(k) = raw.middleRows(from, to - from).colwise().mean();
  }
  return smooth;
}

}  // namespace

Spectrum spectrum(const Eigen::MatrixXd& record, int rows, const std::vector<int>& lines) {
  const Eigen::MatrixXcd E = projection(rows, lines);
  const int periods = static_cast<int>(record.rows()) / rows;
  Spectrum s;
  s.lines = lines;
  s.mean = Eigen::MatrixXcd::Zero(E.rows(), record.cols());
  std::vector<Eigen::MatrixXcd> each;
  for (int p = 0; p < periods; ++p) {
    each.emplace_back(E * record.middleRows(p * rows, rows).cast<std::complex<double>>());
    s.mean += each.back() / periods;
  }
  Eigen::MatrixXd raw = Eigen::MatrixXd::Zero(E.rows(), record.cols());
  for (const Eigen::MatrixXcd& lines_of : each) raw += (lines_of - s.mean).cwiseAbs2();
  // Half of |X − mean|² belongs to the real part. Of n periods, n − 1 are independent of their mean.
  s.variance = smoothed(raw / (2.0 * (periods - 1) * periods));
  return s;
}

Eigen::MatrixXd mean_period(const Eigen::MatrixXd& record, int rows) {
  const int periods = static_cast<int>(record.rows()) / rows;
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(rows, record.cols());
  for (int p = 0; p < periods; ++p) mean += record.middleRows(p * rows, rows) / periods;
  return mean;
}

}  // namespace proxarm::identification
