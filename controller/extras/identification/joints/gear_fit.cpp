#include "controller/extras/identification/joints/gear_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "controller/extras/identification/joints/spectrum.hpp"

namespace proxarm::identification {
namespace {

using Vector = Eigen::VectorXd;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Standard deviation of the expectations: `loosely` for ln k and ln d, delay_deviation_s for δ.
constexpr double loosely = 1.5, delay_deviation_s = 2e-3;
constexpr int sweeps = 3, places = 33, damping_places = 9, most_steps = 60;
// The model's residuals are correlated over this many neighbouring lines, so these lines count as one.
constexpr double alike = 4.0;
// A gear is identifiable if no other gear explains the lines nearly as well: the cost of other gears must be higher by
// `surely`. A gear counts as another one if ln k differs by more than three standard deviations and by more than
// least_apart.
constexpr double surely = 30.0, least_apart = 0.1;
const double searched = std::log(3.0);

class Problem {
 public:
  Problem(const LinkResponse& response, const std::vector<GearLine>& lines, const GearStart& start)
      : response_(response), lines_(lines), start_(start), joints_(start.gears.stiffness_Nm_per_rad.size()) {}

  [[nodiscard]] Vector first() const {
    Vector p = Vector::Zero(3 * joints_ + 2);
    p.head(joints_) = start_.gears.stiffness_Nm_per_rad.array().log();
    p.segment(joints_, joints_) = start_.gears.damping_Nms_per_rad.array().log();
    return p;
  }
  [[nodiscard]] Gears gears(const Vector& p) const {
    return {p.head(joints_).array().exp(), p.segment(joints_, joints_).array().exp(), p.tail(joints_).array().exp()};
  }
  [[nodiscard]] ComplexWrench reading(const GearLine& line, const Vector& p) const {
    const std::complex<double> i(0.0, 1.0);
    const double bandwidth = 2.0 * std::numbers::pi * start_.sensor_bandwidth_Hz;
    const std::complex<double> low_pass = bandwidth > 0.0 ? 1.0 / (1.0 + i * line.omega / bandwidth) : 1.0;
    const std::complex<double> sensor = std::exp(p[2 * joints_ + 1] - i * line.omega * p[2 * joints_]) * low_pass;
    return sensor * response_.reading(line.omega, response_.links(gears(p), line.omega, line.motors));
  }
  // Returns the differences in standard deviations: twelve for each line, then one for the expectation of each unknown.
  [[nodiscard]] Vector differences(const Vector& p) const {
    Vector r(12 * static_cast<Eigen::Index>(lines_.size()) + p.size());
    Eigen::Index at = 0;
    for (const GearLine& line : lines_) {
      const ComplexWrench off = line.reading - reading(line, p);
      r.segment<6>(at) = off.real().cwiseQuotient(line.deviation);
      r.segment<6>(at + 6) = off.imag().cwiseQuotient(line.deviation);
      at += 12;
    }
    r.segment(at, 2 * joints_) = (first() - p).head(2 * joints_) / loosely;
    r[at + 2 * joints_] = -p[2 * joints_] / delay_deviation_s;
    r[at + 2 * joints_ + 1] = -p[2 * joints_ + 1] / start_.sensor_scale;
    r.tail(joints_) = -p.tail(joints_) / (0.5 * start_.link_inertia);
    return r;
  }
  [[nodiscard]] Eigen::MatrixXd slopes(const Vector& p, const Vector& r) const {
    Eigen::MatrixXd J(r.size(), p.size());
    for (Eigen::Index n = 0; n < p.size(); ++n) {
      const double step = n == 2 * joints_ ? 1e-7 : 1e-5;
      Vector moved = p;
      moved[n] += step;
      J.col(n) = (differences(moved) - r) / step;
    }
    return J;
  }
  // Returns a robust cost of the differences, so that lines near a misplaced mode don't outvote all other lines.
  [[nodiscard]] double rough_cost(const Vector& p) const { return differences(p).array().square().log1p().sum(); }
  void search(Vector& p, Eigen::Index unknown, int count) const {
    const double centre = p[unknown];
    double best = rough_cost(p), at = centre;
    for (int n = 0; n < count; ++n) {
      p[unknown] = centre + searched * (2.0 * n / (count - 1) - 1.0);
      const double cost = rough_cost(p);
      if (cost >= best) continue;
      best = cost;
      at = p[unknown];
    }
    p[unknown] = at;
  }
  // Returns the smallest cost with a clearly different gear at this joint and all other unknowns as in p. The different
  // gear is rigid, or within the range of the search.
  [[nodiscard]] double cost_of_others(const Vector& p, Eigen::Index joint, double half) const {
    constexpr double rigid = 4.0;
    Vector other = p;
    other[joint] = p[joint] + rigid;
    double least = differences(other).squaredNorm();
    for (int n = 0; n < places; ++n) {
      other[joint] = p[joint] + searched * (2.0 * n / (places - 1) - 1.0);
      if (std::abs(other[joint] - p[joint]) > half) least = std::min(least, differences(other).squaredNorm());
    }
    return least;
  }
  [[nodiscard]] Eigen::Index joints() const noexcept { return joints_; }
  [[nodiscard]] double left_over_share(const Vector& p) const {
    double off = 0.0, all = 0.0;
    for (const GearLine& line : lines_) {
      off += (line.reading - reading(line, p)).head<3>().squaredNorm();
      all += line.reading.head<3>().squaredNorm();
    }
    return all > 0.0 ? std::sqrt(off / all) : 0.0;
  }

 private:
  const LinkResponse& response_;
  const std::vector<GearLine>& lines_;
  const GearStart& start_;
  Eigen::Index joints_;
};

Vector descend(const Problem& problem, Vector p) {
  double damping = 1e-3;
  Vector r = problem.differences(p);
  for (int n = 0; n < most_steps && damping < 1e8; ++n) {
    const Eigen::MatrixXd J = problem.slopes(p, r);
    Eigen::MatrixXd A = J.transpose() * J;
    A.diagonal() *= 1.0 + damping;
    const Vector step = A.ldlt().solve(-J.transpose() * r), next = p + step, r_next = problem.differences(next);
    if (!r_next.allFinite() || r_next.squaredNorm() >= r.squaredNorm()) {
      damping *= 8.0;
      continue;
    }
    damping = std::max(1e-9, damping / 5.0);
    const bool is_there = r.squaredNorm() - r_next.squaredNorm() < 1e-7 * r.squaredNorm();
    p = next;
    r = r_next;
    if (is_there) break;
  }
  return p;
}

}  // namespace

std::vector<GearLine> gear_lines(const std::vector<MotionRecord>& fast, double line_share) {
  std::vector<GearLine> lines;
  for (const MotionRecord& record : fast) {
    const std::vector<int> h = fast_lines(record.rows_per_period, record.cycle_s);
    const Spectrum motors = spectrum(record.motor_rad, record.rows_per_period, h);
    const Spectrum sensor = spectrum(record.reading_S, record.rows_per_period, h);
    for (Eigen::Index k = 0; k < motors.mean.rows(); ++k) {
      GearLine line{2.0 * std::numbers::pi * record.base_Hz() * h[static_cast<std::size_t>(k)],
                    motors.mean.row(k).transpose(), sensor.mean.row(k).transpose(), Vector6::Zero()};
      // This share of a line's size is added to the deviations of both parts.
      const double force = line_share * line.reading.head<3>().norm(),
                   torque = line_share * line.reading.tail<3>().norm();
      line.deviation = sensor.variance.row(k).transpose().cwiseSqrt();
      for (int i = 0; i < 6; ++i)
        line.deviation[i] = std::max(1e-12, std::hypot(line.deviation[i], i < 3 ? force : torque));
      lines.push_back(line);
    }
  }
  return lines;
}

GearFit fit_gears(const LinkResponse& response, const std::vector<GearLine>& lines, const GearStart& start) {
  const Problem problem(response, lines, start);
  Vector p = problem.first();
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (Eigen::Index joint = 0; joint < problem.joints(); ++joint) {
      problem.search(p, joint, places);
      problem.search(p, problem.joints() + joint, damping_places);
    }
  }
  p = descend(problem, p);
  const Vector r = problem.differences(p);
  const Eigen::MatrixXd J = problem.slopes(p, r);
  const double nu = static_cast<double>(r.size() - p.size());
  const double inflation = std::max(1.0, r.squaredNorm() / nu);
  const Eigen::MatrixXd covariance =
      (J.transpose() * J).ldlt().solve(Eigen::MatrixXd::Identity(p.size(), p.size())) * alike * inflation;
  Vector deviation = covariance.diagonal().cwiseSqrt();
  const Eigen::Index n = problem.joints();
  for (Eigen::Index joint = 0; joint < n; ++joint) {
    const double half = std::max(least_apart, 3.0 * deviation[joint]);
    const double others = problem.cost_of_others(p, joint, half);
    if (others > r.squaredNorm() + surely * inflation) continue;
    deviation[joint] = deviation[n + joint] = std::numeric_limits<double>::infinity();
  }
  return {.gears = problem.gears(p),
          .stiffness_deviation = deviation.head(n),
          .damping_deviation = deviation.segment(n, n),
          .delay_s = p[2 * n],
          .scale = std::exp(p[2 * n + 1]),
          .left_over_share = problem.left_over_share(p)};
}

}  // namespace proxarm::identification
