#include "controller/stability/elastic_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "controller/setpoints/gear_damping.hpp"
#include "controller/stability/order2_polynomials.hpp"
#include "controller/stability/stability.hpp"
#include "models/arm/held_orientation.hpp"
#include "models/arm/inverse_kinematics.hpp"
#include "models/arm/tool_space.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/geometry/large_matrices.hpp"

namespace proxarm::controller {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using models::product;
using models::transposed_product;

// Returns exp(A) by scaling and squaring: Taylor's series of A/2ˢ, squared s times. The norm of A/2ˢ is below 1/2, so
// the error after 18 terms is 1e-22.
MatrixXd exponential(MatrixXd A) {
  const double norm = A.cwiseAbs().rowwise().sum().maxCoeff();
  const int squarings = std::max(0, static_cast<int>(std::ceil(std::log2(norm))) + 1);
  A /= std::exp2(squarings);
  MatrixXd term = MatrixXd::Identity(A.rows(), A.rows()), sum = term;
  for (int n = 1; n <= 18; ++n) {
    term = product(term, A) / n;
    sum += term;
  }
  for (int i = 0; i < squarings; ++i) sum = product(sum, sum);
  return sum;
}

// Coefficients of A(w) T² = Σ (mass_i M + damping_i BT + spring_i K_vT²) wⁱ.
struct ProxyPolynomial {
  std::array<double, 6> mass{1.0, -2.0, 1.0}, damping{}, spring{};
};
ProxyPolynomial proxy_polynomial(int order) {
  ProxyPolynomial A;
  if (order == 1) {
    A.damping = {1.0, -1.0};
    A.spring = {1.0};
    return A;
  }
  for (std::size_t i = 0; i < order2_weights.size(); ++i) {
    A.spring[i] = order2_weights[i];
    for (std::size_t j = 0; j < order2_difference.size(); ++j)
      A.damping[i + j] += order2_weights[i] * order2_difference[j];
  }
  return A;
}

// An age in periods, as whole periods and a rest. A value at this age is interpolated linearly between two periods.
// 1e-9 absorbs the rounding of `periods`, a quotient of decimal numbers.
struct Age {
  explicit Age(double periods)
      : whole(static_cast<Index>(std::floor(periods + 1e-9))),
        rest(std::max(0.0, periods - static_cast<double>(whole))) {}
  Index whole;
  double rest;
};

// Damping ratio of the arm's first mode for gears without a known damping. Frequency of a rigid gear, far above all
// other frequencies here.
constexpr double ringing = 0.03, rigid_Hz = 300.0;

}  // namespace

namespace {
// Usual ratios of a drive's loops: ω_v/(2π f), ω_p/ω_v, ω_i/ω_v.
constexpr double velocity_share = 2.0, place_share = 0.25, integral_share = 0.1;

void add_drives(const description::Cell& cell, ElasticArm& arm) {
  constexpr double pi = std::numbers::pi, least = 0.02, none_kg_m2 = 1e6;
  VectorXd rotor(arm.stiffness.size()), omega(arm.stiffness.size());
  double yields = 0.0;  // largest static δ of a joint, as a share of its gear's twist
  for (Index i = 0; i < rotor.size(); ++i) {
    const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(i)];
    rotor[i] = drive.rotor_inertia_kg_m2 > 0.0 ? drive.rotor_inertia_kg_m2 : none_kg_m2;
    omega[i] = velocity_share * 2.0 * pi * drive.position_bandwidth_Hz;
    yields = std::max(yields, arm.stiffness[i] / (rotor[i] * (place_share + integral_share) * omega[i] * omega[i]));
  }
  if (yields < least) return;
  arm.rotor_kg_m2 = rotor;
  arm.drive_rad_per_s = omega;
}
}  // namespace

ElasticArm elastic_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell) {
  constexpr double pi = std::numbers::pi;
  models::ToolKinematics kinematics;
  arm.kinematics(pose_rad, kinematics);
  // Outside the tool's space a proxy would be a free mass that no hand moves: neither stable nor real.
  const models::ToolSpace space = models::tool_space(arm);
  const auto U = space.axes.leftCols(space.dimensions);
  ElasticArm out{.mass = arm.link_mass_matrix(pose_rad),
                 .jacobian = U.transpose() * kinematics.J_W.topRows<3>(),
                 .joints_per_m = models::joints_per_m(kinematics.J_W) * U,
                 .stiffness = arm.gear_stiffness_Nm_per_rad(),
                 .damping = VectorXd::Zero(arm.axes()),
                 .axes = U};
  if (cell.limits.setpoint_bandwidth_Hz > 0.0) out.filter_s = 1.0 / (2.0 * pi * cell.limits.setpoint_bandwidth_Hz);
  const double first = 2.0 * pi * arm.first_elastic_frequency_Hz(pose_rad);
  for (Index i = 0; i < out.stiffness.size(); ++i) {
    double &k = out.stiffness[i], &d = out.damping[i];
    if (!(k > 0.0)) {
      const double omega = 2.0 * pi * rigid_Hz;
      k = out.mass(i, i) * omega * omega;
      d = out.mass(i, i) * omega;
      continue;
    }
    d = cell.drives[static_cast<std::size_t>(i)].gear_damping_Nms_per_rad.value_or(2.0 * ringing * k / first);
  }
  add_drives(cell, out);
  out.torque_delay_s = gear_torque_delay_s(cell.drives);
  return out;
}

ElasticArm elastic_turning_arm(const models::Arm& arm, const models::JointVector& pose_rad,
                               const description::Cell& cell, double hand_mass_kg) {
  ElasticArm out = elastic_arm(arm, pose_rad, cell);
  models::ToolKinematics kinematics;
  arm.kinematics(pose_rad, kinematics);
  const MatrixXd moved = kinematics.J_W.topRows<3>();
  out.mass += hand_mass_kg * transposed_product(moved, moved);
  out.jacobian = kinematics.J_W.bottomRows<3>();
  out.axes.resize(0, 0);
  out.joints_per_m = models::joints_per_rad(kinematics.J_W);
  return out;
}

ElasticArm elastic_pose_arm(const models::Arm& arm, const models::JointVector& pose_rad,
                            const description::Cell& cell) {
  ElasticArm out = elastic_arm(arm, pose_rad, cell);
  models::ToolKinematics kinematics;
  arm.kinematics(pose_rad, kinematics);
  out.jacobian = kinematics.J_W;
  out.axes.resize(0, 0);
  out.joints_per_m.resize(arm.axes(), 6);
  out.joints_per_m << models::joints_per_m(kinematics.J_W), models::joints_per_rad(kinematics.J_W);
  return out;
}

bool are_near(const models::ToolPose& a, const models::ToolPose& b) noexcept {
  constexpr double apart_m = 0.05, apart_rad = 0.1;
  return (a.position - b.position).squaredNorm() < apart_m * apart_m &&
         a.orientation.angularDistance(b.orientation) < apart_rad;
}

namespace {

class LedArm {
 public:
  explicit LedArm(const models::Arm& arm)  // throws for an arm that can't move the tool
      : inverse_(arm), start_(arm.tool_pose(arm.start_rad())), q_(arm.start_rad()) {}

  [[nodiscard]] const models::JointVector& link_rad() const noexcept { return q_; }
  [[nodiscard]] models::ToolPose tool(const Lead& lead) const {
    return {start_.translation() + lead.offset_m,
            (models::rotation_by(lead.turn_rad) * models::Quaternion(start_.linear())).normalized()};
  }
  // Moves the tool in a straight line, as far as the arm reaches. Returns false if the tool can't move at all.
  bool lead_to(const Lead& lead) {
    // Away from singularities, these steps turn each joint by less than the inverse kinematics' 0.01 rad.
    constexpr double step_m = 0.005, step_rad = 0.005, most_steps = 400.0;
    const Lead from = at_, way{lead.offset_m - from.offset_m, lead.turn_rad - from.turn_rad};
    const double wanted = std::max(way.offset_m.norm() / step_m, way.turn_rad.norm() / step_rad);
    const int steps = static_cast<int>(std::ceil(std::min(most_steps, wanted)));
    int gone = 0;
    for (; gone < steps; ++gone) {
      const double share = (gone + 1.0) / steps;
      const Lead next{from.offset_m + share * way.offset_m, from.turn_rad + share * way.turn_rad};
      if (!go_to(next)) break;
      at_ = next;
    }
    return gone > 0;
  }

 private:
  bool go_to(const Lead& lead) {
    const models::ToolPose wanted = tool(lead);
    models::Pose X_WT = models::Pose::Identity();
    X_WT.linear() = wanted.orientation.toRotationMatrix();
    X_WT.translation() = wanted.position;
    inverse_.solve(q_, X_WT, solution_);
    if (solution_.status != models::InverseKinematicsResult::Status::converged || solution_.out_of_range) return false;
    q_ = solution_.q;
    return true;
  }

  models::InverseKinematics inverse_;
  models::InverseKinematicsResult solution_;
  models::Pose start_;
  models::JointVector q_;
  Lead at_;
};

}  // namespace

std::vector<models::JointVector> led_poses(const models::Arm& arm, const std::vector<Lead>& leads) {
  constexpr std::size_t most_poses = 16;
  LedArm led(arm);
  std::vector<models::JointVector> poses{led.link_rad()};
  std::vector<models::ToolPose> known{led.tool({})};
  for (const Lead& lead : leads) {
    const models::ToolPose there = led.tool(lead);
    const auto near = [&](const models::ToolPose& place) { return are_near(there, place); };
    if (poses.size() == most_poses) break;
    if (std::any_of(known.begin(), known.end(), near)) continue;
    known.push_back(there);
    if (led.lead_to(lead)) poses.push_back(led.link_rad());
  }
  return poses;
}

// Indices of the parts of the state at a period's beginning, in this order:
// - the plant's [φ, φ̇, θ];
// - the last two setpoints;
// - the proxy's last positions;
// - the setpoint filter's x_f and ẋ_f;
// - the kept forces;
// - the yielding drives' [δ, δ̇, ∫δ], and the feed-forward drives' [θ̇, f];
// - with torque-damped gears: the kept torques, the kept modelled accelerations, and the damping's filter states.
struct ElasticLoop::State {
  Index n, d, ages, kept, drives, forward, damped, torques, models;
  [[nodiscard]] Index plant() const { return 0; }
  [[nodiscard]] Index sent() const { return 3 * n; }
  [[nodiscard]] Index proxies() const { return 5 * n; }
  [[nodiscard]] Index filter() const { return 5 * n + kept * d; }
  [[nodiscard]] Index forces() const { return 5 * n + (kept + 2) * d; }
  [[nodiscard]] Index drive() const { return forces() + d * ages; }
  [[nodiscard]] Index following() const { return drive() + drives; }
  [[nodiscard]] Index torque() const { return following() + forward; }
  [[nodiscard]] Index model() const { return torque() + damped * torques; }
  [[nodiscard]] Index band() const { return model() + d * models; }
  [[nodiscard]] Index size() const { return band() + 2 * damped; }
};

namespace {
// Returns a grip with this hand and handle in each of d directions.
Grip grip_of(const HandModel& hand, double handle_kg, Index d) {
  const MatrixXd one = MatrixXd::Identity(d, d);
  return {hand.stiffness_N_per_m * one, hand.damping_Ns_per_m * one, hand.mass_kg * one, handle_kg * one};
}
}  // namespace

ElasticLoop::ElasticLoop(const ElasticArm& arm, const HandModel& hand, const LoopModel& loop)
    : ElasticLoop(arm, grip_of(hand, loop.handle_mass_kg, arm.jacobian.rows()), loop) {}

ElasticLoop::ElasticLoop(const ElasticArm& arm, const Grip& grip, const LoopModel& loop)
    : arm_(arm),
      period_s_(loop.period_s),
      damping_(loop.damping_Ns_per_m),
      spring_(loop.spring_N_per_m),
      horizon_s_(loop.horizon_s),
      time_constant_s_(loop.drive_time_constant_s),
      feeds_forward_(loop.feed_forward && time_constant_s_ > 0.0),
      force_age_periods_(std::max(0.0, (loop.delay_s - 2.0 * arm.filter_s) / loop.period_s - 1.0)),
      order_(loop.order),
      joints_(arm.stiffness.size()),
      dimensions_(arm.jacobian.rows()),
      proxies_(loop.order == 2 ? 5 : 4),
      drives_(3 * arm.rotor_kg_m2.size()),
      forward_(feeds_forward_ ? 2 * joints_ : 0),
      torque_ratio_(loop.gear_torque_ratio),
      torque_age_periods_((arm.torque_delay_s + loop.gear_torque_late_s) / loop.period_s),
      torque_lag_periods_(gear_torque_lag_periods(loop.drive_time_constant_s, arm.torque_delay_s, loop.period_s)) {
  if (loop.gear_damping.damping_per_s > 0.0) {
    std::vector<Index> damped;
    for (Index i = 0; i < joints_; ++i) {
      if ((loop.gear_damping.joints & 1u << i) != 0) damped.push_back(i);
    }
    of_damped_ = MatrixXd::Identity(joints_, joints_)(damped, Eigen::all);
    yields_ = loop.gear_damping.damping_per_s * arm.stiffness.cwiseInverse().asDiagonal() * of_damped_.transpose();
  }
  // 1e-9 absorbs the rounding of a quotient of decimal numbers. At order 1, two ages more than the whole periods are
  // kept, for the interpolation. At order 2, one more is kept, for Störmer's correction.
  ages_ = static_cast<Index>(std::floor(force_age_periods_ + 1e-9)) + (order_ == 2 ? 3 : 2);
  twist_ = product(arm_.stiffness.cwiseInverse().asDiagonal() * arm_.mass, arm_.joints_per_m);
  make_plant(grip, loop.gear_stiffness_ratio);
  // h = −K_h Jφ − D_h Jφ̇ − (m_h + m_t) Jφ̈. φ̈ is the plant's second block of rows, which make_plant() left in force_.
  const MatrixXd& J = arm_.jacobian;
  force_ = product(product(-(grip.hand_mass + grip.handle_mass), J), force_);
  force_.leftCols(joints_) -= product(grip.stiffness, J);
  force_.middleCols(joints_, joints_) -= product(grip.damping, J);
}

// Computes plant_, the map over a period of ż = A z with z = [φ, φ̇, θ, r, ṙ, δ, δ̇, ∫δ, θ̇, f, ḟ] and constant ṙ and
// ḟ. Leaves the rows of φ̈ in force_.
void ElasticLoop::make_plant(const Grip& grip, double gear_stiffness_ratio) {
  const Index n = joints_;
  const MatrixXd& J = arm_.jacobian;
  const MatrixXd mass = arm_.mass + product(transposed_product(J, grip.hand_mass), J);
  MatrixXd k = (gear_stiffness_ratio * arm_.stiffness).asDiagonal(), d = arm_.damping.asDiagonal();
  const Index states = plant_size();
  MatrixXd A = MatrixXd::Zero(states, states);
  const auto block = [&](Index row, Index column) { return A.block(row * n, column * n, n, n); };
  const MatrixXd one = MatrixXd::Identity(n, n);
  block(0, 1) = one;
  block(3, 4) = one;
  // With a lag, θ̇ = (r − θ)/τ. Without a lag, θ is r and moves with the speed ṙ.
  if (feeds_forward_) {
    const double omega_v = velocity_share / time_constant_s_;
    const Index at = 5 * n + drives_;
    const auto follow = [&](Index row, Index column) { return A.block(row, column, n, n); };
    follow(2 * n, at) = one;
    follow(at, 2 * n) = -place_share * omega_v * omega_v * one;
    follow(at, 3 * n) = place_share * omega_v * omega_v * one;
    follow(at, at) = -omega_v * one;
    follow(at, at + n) = omega_v * one;
    follow(at, at + 2 * n) = follow(at + n, at + 2 * n) = one;
  } else if (time_constant_s_ > 0.0) {
    block(2, 2) = -one / time_constant_s_;
    block(2, 3) = one / time_constant_s_;
  } else {
    block(2, 4) = one;
  }
  MatrixXd gear = MatrixXd::Zero(n, A.cols());  // the gears' torque on the links
  gear.leftCols(n) = -k;
  gear.middleCols(n, n) = -d;
  gear.middleCols(2 * n, n) = k;
  gear += product(d, A.middleRows(2 * n, n));
  if (drives_ > 0) {
    gear.middleCols(5 * n, n) = k;
    gear.middleCols(6 * n, n) = d;
    const VectorXd& omega = arm_.drive_rad_per_s;
    const VectorXd rotor = arm_.rotor_kg_m2.cwiseInverse(), omega2 = omega.cwiseProduct(omega);
    block(5, 6) = one;
    block(7, 5) = one;
    block(6, 6) = (-omega).asDiagonal();
    block(6, 5) = (-(place_share + integral_share) * omega2).asDiagonal();
    block(6, 7) = (-place_share * integral_share * omega2.cwiseProduct(omega)).asDiagonal();
    A.middleRows(6 * n, n) -= rotor.asDiagonal() * gear;
  }
  gear_ = gear;
  MatrixXd torque = gear;
  torque.leftCols(n) -= product(transposed_product(J, grip.stiffness), J);
  torque.middleCols(n, n) -= product(transposed_product(J, grip.damping), J);
  A.middleRows(n, n) = models::solve_positive_definite(mass, torque);
  force_ = A.middleRows(n, n);
  plant_ = exponential(A * period_s_);
}

// Returns the coefficients X of q(k) = Σ X_i q(k−i) + X₀ h. Forces along N cancel the motion in forbidden directions.
ElasticLoop::Step ElasticLoop::step_of(const ProxyMatrices& proxy, const MatrixXd& N) const {
  const double T = period_s_;
  const ProxyPolynomial A = proxy_polynomial(order_);
  const auto coefficient = [&](std::size_t i) -> MatrixXd {
    return A.mass[i] * proxy.mass + A.damping[i] * T * proxy.damping + A.spring[i] * T * T * proxy.spring;
  };
  MatrixXd X = models::inverse(coefficient(0));
  if (N.cols() > 0) {
    const MatrixXd along = product(X, N);
    X -= product(product(along, models::inverse(transposed_product(N, along))), along.transpose());
  }
  Step step{.of_force = T * T * X, .of_proxies = {}};
  for (Index i = 1; i <= proxies_; ++i)
    step.of_proxies.emplace_back(-product(X, coefficient(static_cast<std::size_t>(i))));
  return step;
}

Index ElasticLoop::size() const noexcept {
  return State{joints_,  dimensions_,       ages_,          proxies_,     drives_,
               forward_, of_damped_.rows(), kept_torques(), kept_models()}
      .size();
}

Index ElasticLoop::plant_size() const noexcept { return 5 * joints_ + drives_ + (feeds_forward_ ? 3 * joints_ : 0); }

// Advances the state by one period, from just before one reading of the sensor to just before the next reading.
void ElasticLoop::advance(const VectorXd& state, const Step& step, VectorXd& next) const {
  const Index n = joints_, d = dimensions_;
  const State at{n, d, ages_, proxies_, drives_, forward_, of_damped_.rows(), kept_torques(), kept_models()};
  const double T = period_s_;
  const auto old_sent = state.segment(at.sent() + n, n), last_sent = state.segment(at.sent(), n);

  // The present force follows from z. r is now at the older of the last two setpoints, and reaches the newer one at the
  // end of this period.
  VectorXd z = VectorXd::Zero(plant_size());
  z.head(3 * n) = state.head(3 * n);
  if (!(time_constant_s_ > 0.0))
    z.segment(2 * n, n) = old_sent;  // otherwise a difference between θ and r would never decay
  z.segment(3 * n, n) = old_sent;
  z.segment(4 * n, n) = (last_sent - old_sent) / T;
  z.segment(5 * n, drives_) = state.segment(at.drive(), drives_);
  if (feeds_forward_) {
    z.segment(5 * n + drives_, forward_) = state.segment(at.following(), forward_);
    z.tail(n) = (z.segment(4 * n, n) - state.segment(at.following() + n, n)) / T;
  }
  const Place h_now = force_ * z;
  const auto force = [&](Index age) -> Place {
    return age == 0 ? h_now : Place(state.segment(at.forces() + d * (age - 1), d));
  };
  const Age age(force_age_periods_);
  const auto read = [&](Index more) -> Place {
    return (1.0 - age.rest) * force(age.whole + more) + age.rest * force(age.whole + more + 1);
  };
  Place h = read(0);
  const VectorXd carried = transposed_product(arm_.jacobian, MatrixXd(h));
  if (order_ == 2) h = order2_force[0] * h + order2_force[1] * read(1) + order2_force[2] * read(2);

  Place q = step.of_force * h;
  for (Index i = 1; i <= proxies_; ++i)
    q += step.of_proxies[static_cast<std::size_t>(i - 1)] * state.segment(at.proxies() + d * (i - 1), d);
  const Place p = q + horizon_s_ / T * (q - state.segment(at.proxies(), d));

  // The setpoint filter, as in ElasticSetpoint::step().
  Place x = p, v = Place::Zero(d), acceleration = Place::Zero(d), mean_acceleration = Place::Zero(d);
  if (arm_.filter_s > 0.0) {
    const double omega = 1.0 / arm_.filter_s, decay = std::exp(-omega * T);
    const Place e = state.segment(at.filter(), d) - p, v_1 = state.segment(at.filter() + d, d);
    const Place c = v_1 + omega * e;
    x = p + decay * (e + T * c);
    v = decay * (v_1 - omega * T * c);
    acceleration = omega * omega * (p - x) - 2.0 * omega * v;
    mean_acceleration = (v - v_1) / T;
  }

  const VectorXd then = plant_ * z;
  next.head(3 * n) = then.head(3 * n);
  next.segment(at.drive(), drives_) = then.segment(5 * n, drives_);
  next.segment(at.following(), forward_) = then.segment(5 * n + drives_, forward_);
  next.segment(at.sent(), n) = arm_.joints_per_m * x + twist_ * acceleration;
  if (damps()) damp(state, gear_ * z, carried, mean_acceleration, next);
  next.segment(at.sent() + n, n) = last_sent;
  next.segment(at.proxies(), d) = q;
  next.segment(at.proxies() + d, (proxies_ - 1) * d) = state.segment(at.proxies(), (proxies_ - 1) * d);
  next.segment(at.filter(), d) = x;
  next.segment(at.filter() + d, d) = v;
  next.segment(at.forces(), d) = h_now;
  next.segment(at.forces() + d, d * (ages_ - 1)) = state.segment(at.forces(), d * (ages_ - 1));
}

Index ElasticLoop::kept_torques() const noexcept { return damps() ? Age(torque_age_periods_).whole + 1 : 0; }

Index ElasticLoop::kept_models() const noexcept { return damps() ? Age(torque_lag_periods_).whole + 1 : 0; }

// Subtracts the gears' damping from the setpoint that is sent, as GearDamping::step() does. M G ẍ_f is the torque that
// the filter's acceleration requires of the gears.
void ElasticLoop::damp(const VectorXd& state, const VectorXd& torque_now, const VectorXd& carried,
                       const Place& acceleration, VectorXd& next) const {
  const Index n = of_damped_.rows(), d = dimensions_, torques = kept_torques(), models = kept_models();
  const State at{joints_, d, ages_, proxies_, drives_, forward_, n, torques, models};
  const VectorXd now = of_damped_ * torque_now;
  const auto torque = [&](Index age) -> VectorXd {
    return age == 0 ? now : VectorXd(state.segment(at.torque() + n * (age - 1), n));
  };
  const auto model = [&](Index age) -> Place {
    return age == 0 ? acceleration : Place(state.segment(at.model() + d * (age - 1), d));
  };
  const Age age(torque_age_periods_), lag(torque_lag_periods_);
  const VectorXd measured = (1.0 - age.rest) * torque(age.whole) + age.rest * torque(age.whole + 1);
  const Place modelled = (1.0 - lag.rest) * model(lag.whole) + lag.rest * model(lag.whole + 1);
  const VectorXd explained = carried - arm_.stiffness.cwiseProduct(twist_ * modelled);
  const VectorXd beside = torque_ratio_ * measured + of_damped_ * explained;
  const double decay = std::exp(-gear_damping_band_rad_per_s * period_s_);
  const VectorXd slow = decay * state.segment(at.band(), n) + (1.0 - decay) * beside;
  const VectorXd sum =
      decay * state.segment(at.band() + n, n) + (1.0 - decay) / gear_damping_band_rad_per_s * (beside - slow);
  next.segment(at.sent(), joints_) -= yields_ * sum;
  next.segment(at.torque(), n) = now;
  next.segment(at.torque() + n, n * (torques - 1)) = state.segment(at.torque(), n * (torques - 1));
  next.segment(at.model(), d) = acceleration;
  next.segment(at.model() + d, d * (models - 1)) = state.segment(at.model(), d * (models - 1));
  next.segment(at.band(), n) = slow;
  next.segment(at.band() + n, n) = sum;
}

double ElasticLoop::spectral_radius(double proxy_mass_kg) const {
  const MatrixXd one = MatrixXd::Identity(dimensions_, dimensions_);
  return spectral_radius({proxy_mass_kg * one, damping_ * one, spring_ * one}, MatrixXd(dimensions_, 0));
}

double ElasticLoop::spectral_radius(const ProxyMatrices& proxy, const MatrixXd& forbidden) const {
  return models::spectral_radius(map(proxy, forbidden));
}

Eigen::VectorXcd ElasticLoop::eigenvalues(const ProxyMatrices& proxy, const MatrixXd& forbidden) const {
  return models::eigenvalues(map(proxy, forbidden));
}

MatrixXd ElasticLoop::map(const ProxyMatrices& proxy, const MatrixXd& forbidden) const {
  const Index rows = size();
  const Step step = step_of(proxy, forbidden);
  MatrixXd map(rows, rows);
  VectorXd unit = VectorXd::Zero(rows), column(rows);
  for (Index i = 0; i < rows; ++i) {
    unit[i] = 1.0;
    advance(unit, step, column);
    map.col(i) = column;
    unit[i] = 0.0;
  }
  return map;
}

}  // namespace proxarm::controller
