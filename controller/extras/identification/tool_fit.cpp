#include "controller/extras/identification/tool_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace proxarm::identification {
namespace {

using models::Mat3;
using models::Vec3;

constexpr std::size_t least_readings = 3;
// A direction is identifiable if the spread along it is more than five times the mounting error.
constexpr double spread_over_mounting = 5.0;
// Number of steps. Gauss-Newton's steps shrink like products of mounting errors, each a hundredth; four steps leave an
// error of 1e-8.
constexpr int steps = 6;

// Expected standard deviation of c, m: few tools have their centre further away. Without this, c would be
// unbounded if there is no tool.
constexpr double far_m = 1.0;

// First index of each unknown. The fit of forces has m, b, d, ε, δ; the fit of torques has c, b', d'.
constexpr int of_mass = 0, of_zero = 1, of_drift = 4, of_sensor = 7, of_base = 10, force_unknowns = 13;
constexpr int of_centre = 0, of_torque_zero = 3, of_torque_drift = 6, torque_unknowns = 9;

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Mat3 turned(const Vec3& by) {
  const double angle_rad = by.norm();
  if (angle_rad == 0.0) return Mat3::Identity();
  return Eigen::AngleAxisd(angle_rad, by / angle_rad).toRotationMatrix();
}

// Least squares with N unknowns, to which rows are added: A = Σ JᵀJ/σ², a = Σ Jᵀr/σ².
template <int N>
struct Normal {
  Eigen::Matrix<double, N, N> A = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> a = Eigen::Matrix<double, N, 1>::Zero();

  void add(const Eigen::Matrix<double, 3, N>& J, const Vec3& r, double deviation) {
    const double weight = 1.0 / (deviation * deviation);
    A += weight * J.transpose() * J;
    a += weight * J.transpose() * r;
  }
  // Adds rows that expect the three unknowns from `first` on, which now are `x`, to be 0 with this standard deviation.
  // A deviation of 0 fixes the unknowns at 0.
  void expect_zero(int first, const Vec3& x, double deviation) {
    constexpr double surely = 1e-9;  // N, Nm, rad: far below any sensor's accuracy
    const double weight = 1.0 / std::max(deviation * deviation, surely * surely);
    for (int i = 0; i < 3; ++i) {
      A(first + i, first + i) += weight;
      a[first + i] -= weight * x[i];
    }
  }
  // The unknowns have different units, so the matrix is scaled to a unit diagonal before factoring.
  [[nodiscard]] Eigen::Matrix<double, N, N> scale() const {
    return A.diagonal().cwiseSqrt().cwiseInverse().asDiagonal();
  }
  [[nodiscard]] Eigen::Matrix<double, N, N> covariance() const {
    const Eigen::Matrix<double, N, N> D = scale();
    return D * (D * A * D).ldlt().solve(Eigen::Matrix<double, N, N>::Identity()) * D;
  }
  [[nodiscard]] Eigen::Matrix<double, N, 1> step() const {
    const Eigen::Matrix<double, N, N> D = scale();
    return D * (D * A * D).ldlt().solve(D * a);
  }
};

// Returns the upper 3e-5 quantile of χ² with ν degrees of freedom (E. B. Wilson and M. M. Hilferty, The distribution of
// chi-square, 1931): ν (1 − 2/9ν + z √(2/9ν))³ with z = 4.
double most_chi_squared(double nu) {
  constexpr double z = 4.0;
  return nu * std::pow(1.0 - 2.0 / (9.0 * nu) + z * std::sqrt(2.0 / (9.0 * nu)), 3.0);
}

double inflation(const Misfit& misfit, double nu) { return std::max(1.0, misfit.chi_squared / nu); }

void take_row(Misfit& misfit, std::size_t pose, const Vec3& left, double deviation) {
  misfit.chi_squared += left.squaredNorm() / (deviation * deviation);
  if (pose > 0 && left.norm() * misfit.explained <= misfit.worst * deviation) return;
  misfit.worst_pose = static_cast<int>(pose);
  misfit.worst = left.norm();
  misfit.explained = deviation;
}

double prior(const Vec3& x, double deviation) {
  return deviation > 0.0 ? x.squaredNorm() / (deviation * deviation) : 0.0;
}

class Fit {
 public:
  Fit(const std::vector<PoseReading>& readings, const Vec3& gravity_W, const Allowances& allowances)
      : readings_(readings), gravity_W_(gravity_W), allowances_(allowances) {}

  void fit_forces(ToolFit& found) {
    start();
    Normal<force_unknowns> normal;
    for (int n = 0; n < steps; ++n) {
      normal = force_normal();
      x_ += normal.step();
    }
    for (std::size_t k = 0; k < readings_.size(); ++k) {
      take_row(found.force, k, readings_[k].mean_S.force - force(readings_[k]), force_deviation(readings_[k]));
    }
    const Vec3 drift = x_.segment<3>(of_drift), sensor = x_.segment<3>(of_sensor), base = x_.segment<3>(of_base);
    found.force.chi_squared += prior(drift, allowances_.zero_drift_N) + prior(sensor, allowances_.mounting_rad) +
                               prior(base, allowances_.mounting_rad);
    // Nine of the rows are the expectations of nine unknowns.
    const double nu = 3.0 * static_cast<double>(readings_.size()) + 9.0 - force_unknowns;
    found.force.most = most_chi_squared(nu);
    const auto deviation = normal.covariance().diagonal().cwiseSqrt().eval();
    const double half = deviations_of_95 * std::sqrt(inflation(found.force, nu));
    found.mass_found = true;
    found.mass_kg = x_[of_mass];
    found.mass_half_kg = half * deviation[of_mass];
    found.zero_S.force = x_.segment<3>(of_zero);
    found.zero_half_S.force = half * deviation.segment<3>(of_zero);
    found.turned_rad = sensor.norm() + base.norm();
  }

  // Precondition: fit_forces().
  void fit_torques(ToolFit& found) {
    Normal<torque_unknowns> normal;
    const double drift_Nm = lever_m * allowances_.zero_drift_N;
    Eigen::Matrix<double, torque_unknowns, 1> y = Eigen::Matrix<double, torque_unknowns, 1>::Zero();
    for (int n = 0; n < 2; ++n) {  // the second time the lever is known
      lever_now_m_ = y.segment<3>(of_centre).norm();
      normal = {};
      for (const PoseReading& reading : readings_) {
        normal.add(torque_jacobian(reading), reading.mean_S.torque, torque_deviation(reading));
      }
      normal.expect_zero(of_torque_drift, Vec3::Zero(), drift_Nm);
      normal.expect_zero(of_centre, Vec3::Zero(), far_m);
      y = normal.step();
    }
    for (std::size_t k = 0; k < readings_.size(); ++k) {
      const Vec3 left = readings_[k].mean_S.torque - torque_jacobian(readings_[k]) * y;
      take_row(found.torque, k, left, torque_deviation(readings_[k]));
    }
    found.torque.chi_squared += prior(y.segment<3>(of_torque_drift), drift_Nm);
    const double nu = 3.0 * static_cast<double>(readings_.size()) + 3.0 - torque_unknowns;
    found.torque.most = most_chi_squared(nu);
    const auto deviation = normal.covariance().diagonal().cwiseSqrt().eval();
    const double half = deviations_of_95 * std::sqrt(inflation(found.torque, nu));
    found.centre_found = true;
    found.centre_S_m = y.segment<3>(of_centre);
    found.centre_half_m = half * deviation.segment<3>(of_centre);
    found.zero_S.torque = y.segment<3>(of_torque_zero);
    found.zero_half_S.torque = half * deviation.segment<3>(of_torque_zero);
  }

 private:
  [[nodiscard]] double before_last(const PoseReading& reading) const {
    const double last_s = readings_.back().time_s, all_s = last_s - readings_.front().time_s;
    return all_s > 0.0 ? (reading.time_s - last_s) / all_s : 0.0;
  }
  // Returns the weight of one kilogram in S, including mounting errors.
  [[nodiscard]] Vec3 weight_of_1_kg(const PoseReading& reading) const {
    return turned(x_.segment<3>(of_sensor)) * (reading.R_SW * (turned(x_.segment<3>(of_base)) * gravity_W_));
  }
  [[nodiscard]] Vec3 zero(const PoseReading& reading) const {
    return x_.segment<3>(of_zero) + before_last(reading) * x_.segment<3>(of_drift);
  }
  [[nodiscard]] Vec3 force(const PoseReading& reading) const {
    return zero(reading) + x_[of_mass] * weight_of_1_kg(reading);
  }
  [[nodiscard]] double weight_N() const { return std::abs(x_[of_mass]) * gravity_W_.norm(); }
  [[nodiscard]] double force_deviation(const PoseReading& reading) const {
    return std::hypot(reading.noise_N, reading.tilt_rad * weight_N());
  }
  // The torque's model uses the measured weight, so its deviation includes the force's noise.
  [[nodiscard]] double torque_deviation(const PoseReading& reading) const {
    const double by_force_Nm = lever_now_m_ * reading.noise_N;
    return std::hypot(reading.noise_Nm, by_force_Nm, lever_m * reading.tilt_rad * weight_N());
  }

  // Estimates m and b alone for the start, with equal weights for all readings: F_k − F̄ = m (u_k − ū).
  void start() {
    Vec3 force_mean = Vec3::Zero(), u_mean = Vec3::Zero();
    const double count = static_cast<double>(readings_.size());
    for (const PoseReading& reading : readings_) {
      force_mean += reading.mean_S.force / count;
      u_mean += reading.R_SW * gravity_W_ / count;
    }
    double both = 0.0, squares = 0.0;
    for (const PoseReading& reading : readings_) {
      const Vec3 u = reading.R_SW * gravity_W_ - u_mean;
      both += u.dot(reading.mean_S.force - force_mean);
      squares += u.squaredNorm();
    }
    x_.setZero();
    x_[of_mass] = both / squares;  // above 0 by shows_mass()
    x_.segment<3>(of_zero) = force_mean - x_[of_mass] * u_mean;
  }

  [[nodiscard]] Normal<force_unknowns> force_normal() const {
    Normal<force_unknowns> normal;
    for (const PoseReading& reading : readings_) {
      const double m = x_[of_mass];
      Eigen::Matrix<double, 3, force_unknowns> J;
      J.col(of_mass) = weight_of_1_kg(reading);
      J.block<3, 3>(0, of_zero).setIdentity();
      J.block<3, 3>(0, of_drift) = before_last(reading) * Mat3::Identity();
      J.block<3, 3>(0, of_sensor) = -m * cross_matrix(J.col(of_mass));  // exact at ε = δ = 0
      J.block<3, 3>(0, of_base) = -m * reading.R_SW * cross_matrix(gravity_W_);
      normal.add(J, reading.mean_S.force - force(reading), force_deviation(reading));
    }
    normal.expect_zero(of_drift, x_.segment<3>(of_drift), allowances_.zero_drift_N);
    normal.expect_zero(of_sensor, x_.segment<3>(of_sensor), allowances_.mounting_rad);
    normal.expect_zero(of_base, x_.segment<3>(of_base), allowances_.mounting_rad);
    return normal;
  }

  [[nodiscard]] Eigen::Matrix<double, 3, torque_unknowns> torque_jacobian(const PoseReading& reading) const {
    Eigen::Matrix<double, 3, torque_unknowns> J;
    J.block<3, 3>(0, of_centre) = -cross_matrix(reading.mean_S.force - zero(reading));
    J.block<3, 3>(0, of_torque_zero).setIdentity();
    J.block<3, 3>(0, of_torque_drift) = before_last(reading) * Mat3::Identity();
    return J;
  }

  const std::vector<PoseReading>& readings_;
  Vec3 gravity_W_;
  Allowances allowances_;
  Eigen::Matrix<double, force_unknowns, 1> x_ = Eigen::Matrix<double, force_unknowns, 1>::Zero();
  double lever_now_m_ = 0.0;
};

}  // namespace

Vec3 spread(const std::vector<Mat3>& R_SW, const Vec3& gravity_W) noexcept {
  const Vec3 down_W = gravity_W.normalized();
  Vec3 mean = Vec3::Zero();
  Mat3 scatter = Mat3::Zero();
  const double count = static_cast<double>(std::max<std::size_t>(R_SW.size(), 1));
  for (const Mat3& R : R_SW) mean += R * down_W / count;
  for (const Mat3& R : R_SW) {
    const Vec3 off = R * down_W - mean;
    scatter += off * off.transpose() / count;
  }
  const Vec3 rising = Eigen::SelfAdjointEigenSolver<Mat3>(scatter).eigenvalues();
  return rising.cwiseMax(0.0).cwiseSqrt().reverse();
}

bool shows_mass(const Vec3& spread, const Allowances& allowances) noexcept {
  return spread[0] > spread_over_mounting * allowances.mounting_rad && spread[0] > 0.0;
}

bool shows_centre(const Vec3& spread, const Allowances& allowances) noexcept {
  return spread[1] > spread_over_mounting * allowances.mounting_rad && spread[1] > 0.0;
}

ToolFit fit_tool(const std::vector<PoseReading>& readings, const Vec3& gravity_W, const Allowances& allowances) {
  ToolFit found;
  std::vector<Mat3> R_SW;
  for (const PoseReading& reading : readings) R_SW.push_back(reading.R_SW);
  const Vec3 spreads = spread(R_SW, gravity_W);
  if (readings.size() < least_readings || !shows_mass(spreads, allowances)) return found;
  Fit fit(readings, gravity_W, allowances);
  fit.fit_forces(found);
  if (shows_centre(spreads, allowances)) fit.fit_torques(found);
  return found;
}

}  // namespace proxarm::identification
