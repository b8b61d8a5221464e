#include "controller/extras/identification/joints/friction_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "controller/extras/identification/joints/spectrum.hpp"

namespace proxarm::identification {
namespace {

using models::JointVector;
using Complex = std::complex<double>;

// Index of each unknown: J; F and b of the slow motion; F and b of the fast motion; delay of the torque; lag of the
// friction in the fast motion.
constexpr int of_rotor = 0, of_slow = 1, of_fast = 3, of_delay = 5, of_lag = 6, unknowns = 7;
constexpr double slow_highest_Hz = 20.0;
constexpr int repeats = 12;  // number of solutions; each one reduces the delay's error to a fraction
// A motor that is slower than this share of its top speed counts as reversing. Its friction may then have any value.
constexpr double turning_share = 0.01;

using Row = Eigen::Matrix<Complex, unknowns, 1>;
using Unknowns = Eigen::Matrix<double, unknowns, 1>;
using Square = Eigen::Matrix<double, unknowns, unknowns>;

struct Line {
  double omega = 0.0, variance = 0.0;
  Complex motor, sign, torque, gear;
  int friction = of_slow;
};

std::vector<int> up_to(int last) {
  std::vector<int> lines(static_cast<std::size_t>(last));
  std::iota(lines.begin(), lines.end(), 1);
  return lines;
}

// Returns sgn(θ̇) in each cycle of a period. The motor may stand while it reverses, so the sign changes gradually.
Eigen::VectorXd signs_of_speed(const Eigen::VectorXd& motor_rad, double cycle_s, double encoder_step_rad) {
  const Eigen::Index rows = motor_rad.size();
  Eigen::VectorXd speed(rows);
  for (Eigen::Index n = 0; n < rows; ++n) {
    speed[n] = (motor_rad[(n + 1) % rows] - motor_rad[(n + rows - 1) % rows]) / (2.0 * cycle_s);
  }
  const double turns_round = std::max(turning_share * speed.cwiseAbs().maxCoeff(), encoder_step_rad / cycle_s);
  return (speed / turns_round).cwiseMax(-1.0).cwiseMin(1.0);
}

// Returns gravity's torque while the arm swings slowly. The links then follow the motors, apart from the gears' twist.
Eigen::VectorXd gravity_torques(const models::Arm& arm, const Eigen::MatrixXd& motor_rad, int joint) {
  Eigen::VectorXd torque(motor_rad.rows());
  for (Eigen::Index n = 0; n < motor_rad.rows(); ++n) {
    const JointVector at_rad = motor_rad.row(n).transpose();
    torque[n] = arm.gravity_torque(arm.link_from_motor(at_rad))[joint];
  }
  return torque;
}

class Lines {
 public:
  Lines(const models::Arm& arm, const LinkResponse& response, const Gears& gears, const FrictionInputs& inputs)
      : arm_(arm), response_(response), gears_(gears), inputs_(inputs) {
    add(inputs.slow, slow_highest_Hz);
    add(inputs.fast, highest_line_Hz);
  }
  [[nodiscard]] const std::vector<Line>& all() const noexcept { return lines_; }

 private:
  void add(const MotionRecord& record, double highest_Hz) {
    const int rows = record.rows_per_period, joint = record.motion.joint;
    const int nyquist = rows / 4;
    const std::vector<int> h = up_to(std::min(nyquist, static_cast<int>(highest_Hz / record.base_Hz())));
    const Spectrum motors = spectrum(record.motor_rad, rows, h);
    const Spectrum torques = spectrum(record.torque_share.col(joint) * inputs_.rated_torque_Nm, rows, h);
    const Eigen::MatrixXd motor_rad = mean_period(record.motor_rad, rows);
    Eigen::MatrixXd more(rows, 2);
    more.col(0) = signs_of_speed(motor_rad.col(joint), record.cycle_s, inputs_.encoder_step_rad);
    more.col(1) = record.motion.fast ? Eigen::VectorXd::Zero(rows) : gravity_torques(arm_, motor_rad, joint);
    const Eigen::MatrixXcd extra = lines_of(more, rows, h);
    // Rounding to steps has the variance step²/12, spread over all lines of a period.
    const double rounding = inputs_.torque_step_Nm * inputs_.torque_step_Nm / 12.0 * 2.0 / rows;
    for (Eigen::Index k = 0; k < motors.mean.rows(); ++k) {
      const double omega = 2.0 * std::numbers::pi * record.base_Hz() * h[static_cast<std::size_t>(k)];
      const Complex torque = torques.mean(k, 0);
      const double share = inputs_.line_share * std::abs(torque);
      lines_.push_back(
          {.omega = omega,
           .variance = torques.variance(k, 0) + rounding + share * share,
           .motor = motors.mean(k, joint),
           .sign = extra(k, 0),
           .torque = torque,
           .gear = gear_torque(record.motion.fast, omega, motors.mean.row(k).transpose(), joint, extra(k, 1)),
           .friction = record.motion.fast ? of_fast : of_slow});
    }
  }
  static Eigen::MatrixXcd lines_of(const Eigen::MatrixXd& period, int rows, const std::vector<int>& h) {
    Eigen::MatrixXd twice(2 * rows, period.cols());
    twice << period, period;
    return spectrum(twice, rows, h).mean;
  }
  [[nodiscard]] Complex gear_torque(bool fast, double omega, const ComplexJoints& motors, int joint,
                                    const Complex& gravity) const {
    const ComplexJoints links = response_.links(gears_, omega, motors);
    if (fast) return response_.gear_torques(omega, links)[joint];
    return gravity - omega * omega * (response_.mass_kg_m2() * links)[joint];
  }

  const models::Arm& arm_;
  const LinkResponse& response_;
  const Gears& gears_;
  const FrictionInputs& inputs_;
  std::vector<Line> lines_;
};

// The solution of least squares in which each complex row counts as two real rows. In the covariance, each line is
// weighted by its residual (White, "A heteroskedasticity-consistent covariance matrix estimator", 1980).
struct Solution {
  Unknowns x = Unknowns::Zero();
  Square covariance = Square::Zero();
};

Solution solved(const std::vector<Line>& lines, double delay_s) {
  const Complex i(0.0, 1.0);
  std::vector<Row> rows;
  std::vector<Complex> wanted;
  Square A = Square::Zero();
  Unknowns a = Unknowns::Zero();
  for (const Line& line : lines) {
    const Complex torque = line.torque * std::exp(i * line.omega * delay_s);
    Row row = Row::Zero();
    row[of_rotor] = -line.omega * line.omega * line.motor;
    row[line.friction] = line.sign;
    row[line.friction + 1] = i * line.omega * line.motor;
    row[of_delay] = -i * line.omega * torque;
    row[of_lag] = line.friction == of_fast ? i * line.omega * line.sign : Complex(0.0);
    rows.push_back(row);
    wanted.push_back(torque - line.gear);
    A += (row.real() * row.real().transpose() + row.imag() * row.imag().transpose()) / line.variance;
    a += (row.real() * wanted.back().real() + row.imag() * wanted.back().imag()) / line.variance;
  }
  const Unknowns scale = A.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const Square scaled = scale.asDiagonal() * A * scale.asDiagonal();
  const Square inverse = scale.asDiagonal() * scaled.ldlt().solve(Square::Identity()) * scale.asDiagonal();
  Solution solution{.x = inverse * a};
  Square meat = Square::Zero();
  double chi_squared = 0.0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const Complex off = wanted[k] - Complex((rows[k].transpose() * solution.x.cast<Complex>())(0));
    const Unknowns re = rows[k].real() * off.real() / lines[k].variance,
                   im = rows[k].imag() * off.imag() / lines[k].variance;
    meat += re * re.transpose() + im * im.transpose();
    chi_squared += std::norm(off) / lines[k].variance;
  }
  const double count = 2.0 * static_cast<double>(lines.size()), nu = count - unknowns;
  const Square robust = inverse * meat * inverse * (count / nu), plain = inverse * std::max(1.0, chi_squared / nu);
  solution.covariance = robust.diagonal().cwiseMax(plain.diagonal()).asDiagonal();
  return solution;
}

}  // namespace

FrictionFit fit_friction(const models::Arm& arm, const LinkResponse& response, const Gears& gears,
                         const FrictionInputs& inputs) {
  const Lines lines(arm, response, gears, inputs);
  double delay_s = 0.0;
  Solution solution;
  for (int n = 0; n < repeats; ++n) {
    solution = solved(lines.all(), delay_s);
    constexpr double most_s = 0.02;
    delay_s = std::clamp(delay_s + solution.x[of_delay], -most_s, most_s);
  }
  const Unknowns deviation = solution.covariance.diagonal().cwiseSqrt();
  return {.value = {solution.x[of_rotor], solution.x[of_slow], solution.x[of_slow + 1]},
          .deviation = {deviation[of_rotor], deviation[of_slow], deviation[of_slow + 1]}};
}

}  // namespace proxarm::identification
