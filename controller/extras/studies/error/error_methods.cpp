#include "controller/extras/studies/error/error_methods.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "controller/proxies/admittance_proxy.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Mat3;
using models::Vec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

// Returns the numbers of steps into which a motion is divided, from coarse to fine. One of them gives steps of 1 ms.
// With at most `instants` steps, each step ends at an instant.
std::vector<int> step_counts(const ErrorCase& which, bool quick) {
  std::vector<int> counts{4, 5, 6, 10, 12, 15, 20, 30, static_cast<int>(std::lround(which.duration_s / 1e-3))};
  for (const int per_instant : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128}) {
    if (!quick || per_instant <= 32) counts.push_back(instants * per_instant);
  }
  std::sort(counts.begin(), counts.end());
  counts.erase(std::unique(counts.begin(), counts.end()), counts.end());
  return counts;
}

// Returns the number of phases, which are places within a step at which the motion starts.
int phase_count(bool quick) { return quick ? 5 : 50; }

// Computes the velocity at the last sample from the mean velocities over the last three steps: the slope of the cubic
// through the last four positions. The slope of a parabola through three positions errs by T²v̈/3. With a damped hand,
// that was most of the error of order 2.
class SampledVelocity {
 public:
  explicit SampledVelocity(const Vec3& mean) : v_1_(mean) {}
  // Returns the velocity at the end of the step just taken. `mean` is the mean velocity over that step.
  Vec3 operator()(const Vec3& mean) noexcept {
    const Vec3 v = known_ ? Vec3((11.0 * mean - 7.0 * v_1_ + 2.0 * v_2_) / 6.0) : Vec3(1.5 * mean - 0.5 * v_1_);
    v_2_ = v_1_;
    v_1_ = mean;
    known_ = true;
    return v;
  }

 private:
  Vec3 v_1_, v_2_ = Vec3::Zero();  // mean velocities one step and two steps before
  bool known_ = false;             // whether v_2_ is set
};

// The proxy under study. It starts with the exact state at time t_0, and step() goes to the next sample.
class Ours {
 public:
  Ours(const ErrorCase& which, Method method, double T, double t_0)
      : case_(which), world_(which.world()), proxy_(config(which, method, T), *world_), T_(T) {
    const CaseState start = which.exact(t_0);
    const Vec3 h = which.force(t_0, start.q, start.v);
    proxy_.start({.q = start.q,
                  .v = start.v,
                  .a = (h + start.f) / which.mass_kg,
                  .time_s = t_0,
                  .contact_established = which.starts_in_contact});
    v_ = start.v;
    sampled_ = SampledVelocity(proxy_.velocity());
  }
  void step(double t) noexcept {
    static_cast<void>(proxy_.step(case_.force(t, proxy_.q(), v_)));
    v_ = sampled_(proxy_.velocity());
  }
  [[nodiscard]] const Vec3& q() const noexcept { return proxy_.q(); }
  [[nodiscard]] const Vec3& f() const noexcept { return proxy_.f(); }
  [[nodiscard]] const Vec3& v() const noexcept { return proxy_.velocity(); }
  [[nodiscard]] double v_label_s(double t) const noexcept { return t - 0.5 * T_; }

 private:
  static controller::AdmittanceConfig config(const ErrorCase& which, Method method, double T) {
    controller::AdmittanceConfig config;
    config.mass_kg = which.mass_kg;
    config.period_s = T;
    config.order = method == order_1 ? 1 : 2;
    return config;
  }
  const ErrorCase& case_;
  std::unique_ptr<models::GeometricAlgorithm<3>> world_;
  AdmittanceProxy<3> proxy_;
  double T_;
  Vec3 v_;
  SampledVelocity sampled_{Vec3::Zero()};
};

class Penalty {
 public:
  Penalty(const ErrorCase& which, Method method, double T, double t_0, const Tuning& tuning)
      : case_(which), world_(which, tuning), method_(method), staggered_(tuning.staggered), M_(which.mass_kg), T_(T) {
    const CaseState start = which.exact(t_0);
    q_ = start.q;
    v_ = now_ = start.v;
    if (staggered_) v_ -= 0.5 * T / M_ * (which.force(t_0, q_, v_) + start.f);
    sampled_ = SampledVelocity(v_);
  }
  void step(double t) noexcept {
    const Vec3 h = case_.force(t, q_, now_);
    if (method_ == penalty_rk4) {
      runge_kutta(h);
    } else if (method_ == penalty_implicit) {
      implicit_euler(h);
    } else {
      v_ += T_ / M_ * (h + world_.force(q_, v_));
      q_ += T_ * v_;
    }
    now_ = staggered_ ? sampled_(v_) : v_;
  }
  [[nodiscard]] const Vec3& q() const noexcept { return q_; }
  [[nodiscard]] Vec3 f() const noexcept { return world_.force(q_, v_); }
  [[nodiscard]] const Vec3& v() const noexcept { return v_; }
  [[nodiscard]] double v_label_s(double t) const noexcept { return staggered_ ? t - 0.5 * T_ : t; }

 private:
  void runge_kutta(const Vec3& h) noexcept {
    const auto a = [&](const Vec3& q, const Vec3& v) -> Vec3 { return (h + world_.force(q, v)) / M_; };
    const Vec3 v1 = v_, a1 = a(q_, v_);
    const Vec3 v2 = v_ + 0.5 * T_ * a1, a2 = a(q_ + 0.5 * T_ * v1, v2);
    const Vec3 v3 = v_ + 0.5 * T_ * a2, a3 = a(q_ + 0.5 * T_ * v2, v3);
    const Vec3 v4 = v_ + T_ * a3, a4 = a(q_ + T_ * v3, v4);
    q_ += T_ / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    v_ += T_ / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }

  // Solves v' = v + T (h + f(q + T v', v'))/M by Newton's method.
  void implicit_euler(const Vec3& h) noexcept {
    Vec3 next = v_;
    Mat3 slope;
    for (int i = 0; i < 12; ++i) {
      const Vec3 r = next - v_ - T_ / M_ * (h + world_.force(q_, T_, next, slope));
      if (r.norm() <= 1e-13 * (1.0 + next.norm())) break;
      next -= (Mat3::Identity() - T_ / M_ * slope).inverse() * r;
    }
    v_ = next;
    q_ += T_ * v_;
  }

  const ErrorCase& case_;
  PenaltyWorld world_;
  Method method_;
  bool staggered_;
  double M_, T_;
  Vec3 q_, v_;
  Vec3 now_;  // the velocity at the time of q_
  SampledVelocity sampled_{Vec3::Zero()};
};

template <typename Stepper>
Errors errors_of(const ErrorCase& which, Stepper& stepper, int steps, double t_0) {
  const int per_instant = std::max(1, steps / instants), compared = steps / per_instant;
  const double T = which.duration_s / steps, M = which.mass_kg;
  Errors errors;
  double sum_q = 0.0, sum_v = 0.0, rest_s = -1.0, top_speed = 1e-300;
  int counted_v = 0;
  for (int k = 0; k < steps; ++k) {
    stepper.step(t_0 + k * T);
    const double t = t_0 + (k + 1) * T, speed = stepper.v().norm();
    top_speed = std::max(top_speed, speed);
    if (speed > 1e-3 * top_speed) {
      rest_s = -1.0;
    } else if (rest_s < 0.0) {
      rest_s = t;
    }
    if ((k + 1) % per_instant != 0) continue;
    const CaseState exact = which.exact(t);
    sum_q += (stepper.q() - exact.q).squaredNorm();
    // Near an impact the velocity jumps, so it isn't compared there.
    if (which.stop_s < 0.0 || std::abs(t - which.stop_s) > 2.0 * which.duration_s / instants) {
      sum_v += (stepper.v() - which.exact(stepper.v_label_s(t)).v).squaredNorm();
      ++counted_v;
    }
  }
  const double end = t_0 + which.duration_s;
  const CaseState exact = which.exact(end);
  errors.position_m = std::sqrt(sum_q / compared);
  errors.velocity_m_per_s = std::sqrt(sum_v / std::max(1, counted_v));
  errors.force_N = (stepper.f() - exact.f).norm();
  errors.energy_J = 0.5 * M * std::abs(stepper.v().squaredNorm() - which.exact(stepper.v_label_s(end)).v.squaredNorm());
  errors.stop_s = which.stop_s < 0.0 ? 0.0 : rest_s < 0.0 ? infinity : std::abs(rest_s - which.stop_s);
  if (!std::isfinite(errors.position_m)) errors.position_m = infinity;
  return errors;
}

double ns_per_step(auto& stepper, double T, int steps) {
  const auto begun = std::chrono::steady_clock::now();
  for (int k = 0; k < steps; ++k) stepper.step(k * T);
  const double ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begun).count();
  // isnan() is never true here; using q keeps the compiler from removing the steps.
  return std::isnan(stepper.q().x()) ? infinity : ns / steps;
}

// Measures the time of a step in short rounds that alternate between steps of (26) and steps of the method, so that
// other load on the machine disturbs both alike.
template <typename Make>
void time_rounds(const ErrorCase& which, Make make, int steps, MethodRun& run) {
  const double T = which.duration_s / steps;
  std::vector<double> shares;
  run.reference_ns = infinity;
  for (int round = 0; round < 15; ++round) {
    Ours reference(which, order_1, T, 0.0);
    auto stepper = make(T, 0.0);
    const double reference_ns = ns_per_step(reference, T, steps);
    shares.push_back(ns_per_step(stepper, T, steps) / reference_ns);
    run.reference_ns = std::min(run.reference_ns, reference_ns);
  }
  run.of_reference = Spread::of(shares);
}

// Measures the time of a step. With a stiff wall the method may diverge at this number of steps and be stable with
// finer steps. Then the time is measured with the finer steps.
template <typename Make>
void time_steps(const ErrorCase& which, Make make, int steps, MethodRun& run) {
  for (const int finer : {1, 4, 16}) {
    time_rounds(which, make, finer * steps, run);
    if (std::isfinite(run.of_reference.median)) return;
  }
}

Spread spread(const std::vector<Errors>& list, double Errors::*member) {
  std::vector<double> values;
  for (const Errors& errors : list) values.push_back(errors.*member);
  return Spread::of(values);
}

template <typename Make>
std::vector<MethodRun> runs(const ErrorCase& which, bool quick, Make make) {
  std::vector<MethodRun> list;
  MethodRun run;
  time_steps(which, make, quick ? 500 : 2000, run);
  for (const int steps : step_counts(which, quick)) {
    run.steps = steps;
    run.period_s = which.duration_s / steps;
    const int phases = phase_count(quick);
    std::vector<Errors> errors;
    for (int i = 0; i < phases; ++i) {
      const double t_0 = run.period_s * (i + 0.5) / phases;
      auto stepper = make(run.period_s, t_0);
      errors.push_back(errors_of(which, stepper, steps, t_0));
    }
    const Spread position_m = spread(errors, &Errors::position_m);
    run.position_low_m = position_m.low;
    run.position_high_m = position_m.high;
    run.errors = {position_m.median, spread(errors, &Errors::velocity_m_per_s).median,
                  spread(errors, &Errors::force_N).median, spread(errors, &Errors::energy_J).median,
                  spread(errors, &Errors::stop_s).median};
    list.push_back(run);
  }
  return list;
}

}  // namespace

// Takes the value nearest to each percentile without interpolation, because values may be infinite.
Spread Spread::of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
  };
  return {at(0.1), at(0.5), at(0.9)};
}

std::vector<Tuning> tunings(const ErrorCase& which, Method method, bool quick) {
  if (method <= order_2) return {Tuning{}};
  const bool may_stagger = method == penalty_euler || method == penalty_implicit;
  const std::vector<bool> starts = may_stagger ? std::vector{false, true} : std::vector{false};
  const bool walls = !which.surfaces.empty(), rubs = which.friction > 0.0;
  const std::vector<double> ratios = method == ros || !walls ? std::vector{0.0} : std::vector{0.0, 0.3, 1.0};
  const std::vector<double> slopes = rubs ? std::vector{0.3, 1.0, 3.0} : std::vector{1.0};
  const double finest = quick ? 1.0 : 0.5, first = walls ? 3.0 : 5.0, last = walls ? 7.01 : 5.0;
  std::vector<Tuning> list;
  for (double decade = first; decade <= last; decade += finest) {
    for (const double ratio : ratios) {
      for (const double slope : slopes) {
        for (const bool staggered : starts) list.push_back({std::pow(10.0, decade), ratio, slope, staggered});
      }
    }
  }
  return list;
}

std::vector<MethodRun> run_method(const ErrorCase& which, Method method, const Tuning& tuning, bool quick) {
  if (method <= order_2) return runs(which, quick, [&](double T, double t_0) { return Ours(which, method, T, t_0); });
  return runs(which, quick, [&](double T, double t_0) { return Penalty(which, method, T, t_0, tuning); });
}

}  // namespace proxarm::studies
