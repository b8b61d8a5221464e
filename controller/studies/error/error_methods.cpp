#include "controller/studies/error/error_methods.hpp"

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

// Numbers of steps of a motion, from coarse to fine with all ratios between, so that impacts fall anywhere within a
// step. With at most `instants` steps, each step ends at an instant.
std::vector<int> step_counts(bool quick) {
  std::vector<int> counts{4, 5, 6, 10, 12, 15, 20, 30};
  for (const int per_instant : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256}) {
    if (!quick || per_instant <= 32) counts.push_back(instants * per_instant);
  }
  return counts;
}

// The world as springs, dampers and friction dampers: what stands for ℳ in the penalty methods.
class PenaltyWorld {
 public:
  PenaltyWorld(const ErrorCase& which, const Tuning& tuning)
      : mu_(which.friction), medium_(which.medium_Ns_per_m), k_(tuning.stiffness_N_per_m) {
    for (const CaseSurface& surface : which.surfaces) obstacles_.push_back(obstacle_of(surface, 0.0));
    const double critical = 2.0 * std::sqrt(k_ * which.mass_kg);
    c_ = tuning.damping_ratio * critical;
    c_t_ = tuning.friction_slope * critical;
  }

  Vec3 operator()(const Vec3& q, const Vec3& v) const noexcept {
    Vec3 f = Vec3::Zero();
    for (const auto& obstacle : obstacles_) {
      const double height = obstacle->distance(q);
      if (height >= 0.0) continue;
      const Vec3 n = obstacle->tangent(q, 0).surface.normal();
      const double v_n = n.dot(v), f_n = std::max(0.0, -k_ * height - c_ * v_n);
      f += f_n * n;
      if (mu_ > 0.0) {
        const Vec3 v_t = v - v_n * n;
        const double speed = v_t.norm();
        f -= (c_t_ * speed <= mu_ * f_n ? c_t_ : mu_ * f_n / speed) * v_t;
      }
    }
    if (medium_ > 0.0 && q.x() > 0.0) f -= medium_ * v;
    return f;
  }

 private:
  std::vector<std::unique_ptr<models::Obstacle>> obstacles_;
  double mu_, medium_, k_, c_ = 0.0, c_t_ = 0.0;
};

// A method under study: a state at time t, and step() to the next sample.
class Ours {
 public:
  Ours(const ErrorCase& which, Method method, double T)
      : case_(which),
        world_(which.world()),
        proxy_(config(which, method, T), *world_),
        first_(method == order_1),
        T_(T) {
    const CaseState start = which.exact(0.0);
    const Vec3 h = which.force(0.0, start.q, start.v);
    proxy_.start({.q = start.q,
                  .v = start.v,
                  .a = (h + start.f) / which.mass_kg,
                  .time_s = 0.0,
                  .contact_established = which.starts_in_contact});
    v_ = start.v;
  }
  void step(double t) noexcept {
    const Vec3 before = proxy_.velocity();
    static_cast<void>(proxy_.step(case_.force(t, proxy_.q(), v_)));
    // At order 1 velocity() belongs to the middle of the step; the last two extrapolate it by half a step.
    v_ = first_ ? Vec3(1.5 * proxy_.velocity() - 0.5 * before) : proxy_.velocity();
  }
  [[nodiscard]] const Vec3& q() const noexcept { return proxy_.q(); }
  [[nodiscard]] const Vec3& f() const noexcept { return proxy_.f(); }
  [[nodiscard]] const Vec3& v() const noexcept { return proxy_.velocity(); }
  [[nodiscard]] double v_label_s(double t) const noexcept { return first_ ? t - 0.5 * T_ : t; }

 private:
  static controller::AdmittanceConfig config(const ErrorCase& which, Method method, double T) {
    controller::AdmittanceConfig config;
    config.mass_kg = which.mass_kg;
    config.period_s = T;
    config.order = method == order_1 ? 1 : 2;
    config.matched_labels = method == order_2;
    return config;
  }
  const ErrorCase& case_;
  std::unique_ptr<models::GeometricAlgorithm<3>> world_;
  AdmittanceProxy<3> proxy_;
  bool first_;
  double T_;
  Vec3 v_;
};

class Penalty {
 public:
  Penalty(const ErrorCase& which, Method method, double T, const Tuning& tuning)
      : case_(which), world_(which, tuning), method_(method), M_(which.mass_kg), T_(T) {
    const CaseState start = which.exact(0.0);
    q_ = start.q;
    v_ = start.v;
  }
  void step(double t) noexcept {
    const Vec3 h = case_.force(t, q_, v_);
    if (method_ == penalty_rk4) {
      runge_kutta(h);
    } else if (method_ == penalty_implicit) {
      implicit_euler(h);
    } else {
      v_ += T_ / M_ * (h + world_(q_, v_));
      q_ += T_ * v_;
    }
  }
  [[nodiscard]] const Vec3& q() const noexcept { return q_; }
  [[nodiscard]] Vec3 f() const noexcept { return world_(q_, v_); }
  [[nodiscard]] const Vec3& v() const noexcept { return v_; }
  [[nodiscard]] static double v_label_s(double t) noexcept { return t; }

 private:
  void runge_kutta(const Vec3& h) noexcept {
    const auto a = [&](const Vec3& q, const Vec3& v) -> Vec3 { return (h + world_(q, v)) / M_; };
    const Vec3 v1 = v_, a1 = a(q_, v_);
    const Vec3 v2 = v_ + 0.5 * T_ * a1, a2 = a(q_ + 0.5 * T_ * v1, v2);
    const Vec3 v3 = v_ + 0.5 * T_ * a2, a3 = a(q_ + 0.5 * T_ * v2, v3);
    const Vec3 v4 = v_ + T_ * a3, a4 = a(q_ + T_ * v3, v4);
    q_ += T_ / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    v_ += T_ / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }

  // v' = v + T (h + f(q + T v', v'))/M by Newton's method, its Jacobian by differences.
  void implicit_euler(const Vec3& h) noexcept {
    Vec3 next = v_;
    const auto residual = [&](const Vec3& v) -> Vec3 { return v - v_ - T_ / M_ * (h + world_(q_ + T_ * v, v)); };
    for (int i = 0; i < 12; ++i) {
      const Vec3 r = residual(next);
      if (r.norm() <= 1e-13 * (1.0 + next.norm())) break;
      Mat3 J;
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double d = 1e-8;
        J.col(axis) = (residual(next + d * Vec3::Unit(axis)) - r) / d;
      }
      next -= J.inverse() * r;
    }
    v_ = next;
    q_ += T_ * v_;
  }

  const ErrorCase& case_;
  PenaltyWorld world_;
  Method method_;
  double M_, T_;
  Vec3 q_, v_;
};

template <typename Stepper>
Errors errors_of(const ErrorCase& which, Stepper& stepper, int steps) {
  const int per_instant = std::max(1, steps / instants), compared = steps / per_instant;
  const double T = which.duration_s / steps, M = which.mass_kg;
  Errors errors;
  double sum_q = 0.0, sum_v = 0.0, rest_s = -1.0, top_speed = 1e-300;
  int counted_v = 0;
  for (int k = 0; k < steps; ++k) {
    stepper.step(k * T);
    const double t = (k + 1) * T, speed = stepper.v().norm();
    top_speed = std::max(top_speed, speed);
    if (speed > 1e-3 * top_speed) {
      rest_s = -1.0;
    } else if (rest_s < 0.0) {
      rest_s = t;
    }
    if ((k + 1) % per_instant != 0) continue;
    const CaseState exact = which.exact(t);
    sum_q += (stepper.q() - exact.q).squaredNorm();
    // The velocity of a step that contains an impact belongs to no instant.
    if (which.stop_s < 0.0 || std::abs(t - which.stop_s) > 2.0 * which.duration_s / instants) {
      sum_v += (stepper.v() - which.exact(stepper.v_label_s(t)).v).squaredNorm();
      ++counted_v;
    }
  }
  const double end = which.duration_s;
  const CaseState exact = which.exact(end);
  errors.position_m = std::sqrt(sum_q / compared);
  errors.velocity_m_per_s = std::sqrt(sum_v / std::max(1, counted_v));
  errors.force_N = (stepper.f() - exact.f).norm();
  errors.energy_J = 0.5 * M * std::abs(stepper.v().squaredNorm() - which.exact(stepper.v_label_s(end)).v.squaredNorm());
  errors.stop_s = which.stop_s < 0.0 ? 0.0 : rest_s < 0.0 ? infinity : std::abs(rest_s - which.stop_s);
  if (!std::isfinite(errors.position_m)) errors.position_m = infinity;
  return errors;
}

template <typename Make>
double step_time_ns(const ErrorCase& which, Make make, int steps) {
  double best = infinity;
  const double T = which.duration_s / steps;
  double sink = 0.0;
  for (int round = 0; round < 15; ++round) {  // short rounds: on a busy machine most are still undisturbed
    auto stepper = make(T);
    const auto begun = std::chrono::steady_clock::now();
    for (int k = 0; k < steps; ++k) stepper.step(k * T);
    const double ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begun).count();
    best = std::min(best, ns / steps);
    sink += stepper.q().x();
  }
  return std::isnan(sink) ? best * (1.0 + 1e-15) : best;
}

template <typename Make>
std::vector<MethodRun> runs(const ErrorCase& which, bool quick, Make make) {
  std::vector<MethodRun> list;
  const double ns = step_time_ns(which, make, quick ? 500 : 2000);
  for (const int steps : step_counts(quick)) {
    const double T = which.duration_s / steps;
    auto stepper = make(T);
    list.push_back({steps, T, ns, errors_of(which, stepper, steps)});
  }
  return list;
}

}  // namespace

std::vector<Tuning> tunings(const ErrorCase& which, Method method, bool quick) {
  if (method <= order_2) return {Tuning{}};
  if (which.surfaces.empty()) return {Tuning{1e5, 0.0, 1.0}};  // nothing to tune
  std::vector<Tuning> list;
  const double finest = quick ? 1.0 : 0.5;
  for (double decade = 3.0; decade <= 7.01; decade += finest) {
    for (const double ratio : method == ros ? std::vector<double>{0.0} : std::vector<double>{0.0, 0.3, 1.0}) {
      for (const double slope : which.friction > 0.0 ? std::vector<double>{0.3, 1.0, 3.0} : std::vector<double>{1.0}) {
        list.push_back({std::pow(10.0, decade), ratio, slope});
      }
    }
  }
  return list;
}

std::vector<MethodRun> run_method(const ErrorCase& which, Method method, const Tuning& tuning, bool quick) {
  if (method <= order_2) return runs(which, quick, [&](double T) { return Ours(which, method, T); });
  return runs(which, quick, [&](double T) { return Penalty(which, method, T, tuning); });
}

}  // namespace proxarm::studies
