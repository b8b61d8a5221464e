#include "controller/studies/error.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "controller/rendering/admittance_proxy.hpp"
#include "controller/studies/common/chart.hpp"
#include "controller/studies/error_cases.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/world/world.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using models::Mat3;
using models::Vec3;
using nlohmann::json;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int instants = 60;

enum Method { order_1, order_2, penalty_euler, penalty_rk4, penalty_implicit, ros, method_count };
constexpr std::array<const char*, method_count> method_names{
    "1", "2", "penalty_euler", "penalty_rk4", "penalty_implicit", "ros"};

// The parameters of a penalty method.
struct Tuning {
  double stiffness_N_per_m = 0.0, damping_ratio = 0.0, friction_slope = 1.0;
};

// Numbers of steps of a motion, from coarse to fine with all ratios between, so that impacts fall anywhere within a
// step. With at most `instants` steps, each step ends at an instant.
std::vector<int> step_counts(bool quick) {
  std::vector<int> counts{4, 5, 6, 10, 12, 15, 20, 30};
  for (const int per_instant : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256}) {
    if (!quick || per_instant <= 32) counts.push_back(instants * per_instant);
  }
  return counts;
}

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

struct Errors {
  double position_m = 0.0, velocity_m_per_s = 0.0, force_N = 0.0, energy_J = 0.0, stop_s = 0.0;
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

// The runs of one method with one tuning, from coarse to fine.
struct Runs {
  std::string method;
  Tuning tuning;
  std::vector<double> T, steps, error, cost_ns;

  // The largest error among this timestep and those up to twofold finer.
  [[nodiscard]] double envelope(std::size_t i) const {
    double most = error[i];
    for (std::size_t j = i; j < T.size() && T[j] > 0.499 * T[i]; ++j) most = std::max(most, error[j]);
    return most;
  }
  // Run time for an error of at most `target`; infinite where none is that good.
  [[nodiscard]] double cost(double target) const {
    double least = infinity;
    for (std::size_t i = 0; i < T.size(); ++i) {
      if (envelope(i) <= target) least = std::min(least, cost_ns[i]);
    }
    return least;
  }
};

using RunsByCase = std::map<std::string, std::vector<Runs>>;

RunsByCase collect(const Table& table) {
  RunsByCase all;
  const std::size_t name = table.column("case"), method = table.column("method"), k = table.column("stiffness_N_per_m"),
                    ratio = table.column("damping_ratio"), slope = table.column("friction_slope"),
                    T = table.column("period_s"), steps = table.column("steps"),
                    error = table.column("position_error_m"), cost = table.column("run_time_ns");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    std::vector<Runs>& list = all[table.text(row, name)];
    const Tuning tuning{table.number(row, k), table.number(row, ratio), table.number(row, slope)};
    const bool same = !list.empty() && list.back().method == table.text(row, method) &&
                      list.back().tuning.stiffness_N_per_m == tuning.stiffness_N_per_m &&
                      list.back().tuning.damping_ratio == tuning.damping_ratio &&
                      list.back().tuning.friction_slope == tuning.friction_slope;
    if (!same) list.push_back({table.text(row, method), tuning, {}, {}, {}, {}});
    list.back().T.push_back(table.number(row, T));
    list.back().steps.push_back(table.number(row, steps));
    list.back().error.push_back(table.number(row, error));
    list.back().cost_ns.push_back(table.number(row, cost));
  }
  return all;
}

bool is_penalty(const Runs& runs) { return runs.method != "1" && runs.method != "2"; }

const Runs& runs_of(const std::vector<Runs>& list, const std::string& method) {
  for (const Runs& runs : list) {
    if (runs.method == method) return runs;
  }
  throw std::out_of_range("no runs of " + method);
}

// Errors that matter to an arm: from a micrometre, which its encoders resolve, to a millimetre.
std::vector<double> targets() {
  std::vector<double> list;
  for (int i = 0; i <= 30; ++i) list.push_back(std::pow(10.0, -6.0 + 0.1 * i));
  return list;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

// The other methods' run time over ours at equal error: the median over the targets that both reach.
template <typename Cost>
double speedup(const Runs& ours, Cost rival_cost) {
  std::vector<double> ratios;
  for (const double target : targets()) {
    const double rival = rival_cost(target), own = ours.cost(target);
    if (std::isfinite(rival) && std::isfinite(own)) ratios.push_back(rival / own);
  }
  return median(ratios);
}

double tuned_cost(const std::vector<Runs>& list, double target) {
  double least = infinity;
  for (const Runs& runs : list) {
    if (is_penalty(runs)) least = std::min(least, runs.cost(target));
  }
  return least;
}

struct Fixed {
  std::string method;
  Tuning tuning;
  [[nodiscard]] bool matches(const Runs& runs) const {
    if (runs.method != method) return false;
    // Cases without friction or surfaces have less to tune.
    const bool k = runs.tuning.stiffness_N_per_m == tuning.stiffness_N_per_m,
               c = runs.tuning.damping_ratio == tuning.damping_ratio;
    return k && c && (runs.tuning.friction_slope == tuning.friction_slope || runs.tuning.friction_slope == 1.0);
  }
};

const Runs* fixed_runs(const std::vector<Runs>& list, const Fixed& fixed) {
  const Runs *exact = nullptr, *any = nullptr;
  for (const Runs& runs : list) {
    if (runs.method != fixed.method) continue;
    any = &runs;
    if (fixed.matches(runs) && (exact == nullptr || runs.tuning.friction_slope == fixed.tuning.friction_slope)) {
      exact = &runs;
    }
  }
  return exact != nullptr ? exact : any;
}

// The method and tuning that is best over all cases together at 0.1 mm: the one with the least geometric mean of run
// times. A case in which it doesn't reach 0.1 mm counts as a thousand times the best-tuned one's time.
Fixed best_fixed(const RunsByCase& all) {
  Fixed best;
  double least = infinity;
  const auto slide = all.find("slide") != all.end() ? all.find("slide") : all.begin();
  for (const Runs& candidate : slide->second) {
    if (!is_penalty(candidate)) continue;
    const Fixed fixed{candidate.method, candidate.tuning};
    double sum = 0.0;
    for (const auto& [name, list] : all) {
      const Runs* runs = fixed_runs(list, fixed);
      const double cost = runs == nullptr ? infinity : runs->cost(1e-4);
      sum += std::log(std::min(cost, 1e3 * std::min(tuned_cost(list, 1e-4), 1e9)));
    }
    if (sum < least) {
      least = sum;
      best = fixed;
    }
  }
  return best;
}

// Slope of log error over log T, where the error is above rounding, and the rms of what is left, in decades.
struct Fit {
  double order = 0.0, residual = 0.0;
};
Fit fit_order(const Runs& runs) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < runs.T.size(); ++i) {
    const double e = runs.envelope(i);
    if (runs.steps[i] < 4 * instants || !(e > 1e-11) || !std::isfinite(e)) continue;
    x.push_back(std::log10(runs.T[i]));
    y.push_back(std::log10(e));
  }
  if (x.size() < 3) return {0.0, 0.0};
  double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0, rr = 0.0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    mx += x[i] / n;
    my += y[i] / n;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    xy += (x[i] - mx) * (y[i] - my);
  }
  const double slope = xy / xx;
  if (slope < 0.0) return {0.0, 0.0};  // an error that grows with the number of steps is rounding
  for (std::size_t i = 0; i < x.size(); ++i) rr += std::pow(y[i] - my - slope * (x[i] - mx), 2);
  return {slope, std::sqrt(rr / n)};
}

// The rate at which (26) changes the speed of a frictionless slide around a sphere, 1/s, and the predicted T f_n/(M R).
// Speed is lost inside of a sphere and gained outside.
json energy_rate(bool inside) {
  constexpr double R = 0.1, M = 1.0, T = 1e-3, speed = 0.2, push = 5.0;
  std::vector<models::World::Entry> entries;
  entries.push_back({std::make_unique<models::Sphere>(models::PointCore{Vec3::Zero()}, R, 0.0, inside), 0, 0});
  models::World world(std::move(entries));
  AdmittanceProxy<3> proxy({.mass_kg = M, .period_s = T}, world);
  const double toward = inside ? 1.0 : -1.0;  // the push, onto the surface
  proxy.start({.q = R * Vec3::UnitX(),
               .v = speed * Vec3::UnitY(),
               .a = -speed * speed / R * Vec3::UnitX(),
               .contact_established = true});
  constexpr int steps = 500;
  double f_n = 0.0, first = 0.0;
  for (int k = 0; k < steps; ++k) {
    static_cast<void>(proxy.step(toward * push * proxy.q().normalized()));
    if (k == 0) first = proxy.velocity().norm();
    f_n += proxy.f().norm() / steps;
  }
  const double measured = std::log(proxy.velocity().norm() / first) / ((steps - 1) * T);
  const double predicted = (inside ? -1.0 : 1.0) * T * f_n / (M * R);
  return {{"measured_per_s", measured}, {"predicted_per_s", predicted}};
}

}  // namespace

std::vector<Column> ErrorStudy::columns() const {
  return {{"case", true},
          {"method", true},
          {"stiffness_N_per_m"},
          {"damping_ratio"},
          {"friction_slope"},
          {"period_s"},
          {"steps"},
          {"step_ns"},
          {"run_time_ns"},
          {"position_error_m"},
          {"velocity_error_m_per_s"},
          {"force_error_N"},
          {"energy_error_J"},
          {"stop_error_s"}};
}

std::size_t ErrorStudy::jobs(const Options& /*options*/) const { return error_cases().size() * method_count; }

std::vector<Row> ErrorStudy::run(std::size_t job, const Options& options) const {
  const ErrorCase which = error_cases()[job / method_count];
  const auto method = static_cast<Method>(job % method_count);
  std::vector<Row> rows;
  const auto all_steps = [&](const Tuning& tuning, auto make) {
    const double ns = step_time_ns(which, make, options.quick ? 500 : 2000);
    for (const int steps : step_counts(options.quick)) {
      const double T = which.duration_s / steps;
      auto stepper = make(T);
      const Errors e = errors_of(which, stepper, steps);
      rows.push_back({which.name, std::string(method_names[method]), tuning.stiffness_N_per_m, tuning.damping_ratio,
                      tuning.friction_slope, T, static_cast<double>(steps), ns, ns * steps, e.position_m,
                      e.velocity_m_per_s, e.force_N, e.energy_J, e.stop_s});
    }
  };
  for (const Tuning& tuning : tunings(which, method, options.quick)) {
    if (method <= order_2) {
      all_steps(tuning, [&](double T) { return Ours(which, method, T); });
    } else {
      all_steps(tuning, [&](double T) { return Penalty(which, method, T, tuning); });
    }
  }
  return rows;
}

json ErrorStudy::headline(const Table& table, const Options& /*options*/) const {
  const RunsByCase all = collect(table);
  const Fixed fixed = best_fixed(all);
  json order, residual, tuned, against_fixed, best;
  for (const auto& [name, list] : all) {
    for (const char* method : {"1", "2"}) {
      const Runs& ours = runs_of(list, method);
      const Fit fit = fit_order(ours);
      order[name][method] = fit.order;
      residual[name][method] = fit.residual;
      const std::vector<Runs>& rivals = list;
      tuned[name][method] = speedup(ours, [&rivals](double target) { return tuned_cost(rivals, target); });
      const Runs* one = fixed_runs(list, fixed);
      against_fixed[name][method] =
          one == nullptr ? 0.0 : speedup(ours, [one](double target) { return one->cost(target); });
    }
    // The best of the other methods at 0.1 mm, and its order.
    const Runs* winner = nullptr;
    for (const Runs& runs : list) {
      if (is_penalty(runs) && (winner == nullptr || runs.cost(1e-4) < winner->cost(1e-4))) winner = &runs;
    }
    best[name] = {{"method", winner->method},
                  {"stiffness_N_per_m", winner->tuning.stiffness_N_per_m},
                  {"damping_ratio", winner->tuning.damping_ratio},
                  {"friction_slope", winner->tuning.friction_slope},
                  {"order", fit_order(*winner).order}};
  }
  return {
      {"order", order},
      {"order_residual_decades", residual},
      {"speedup_over_tuned_penalty", tuned},
      {"speedup_over_fixed_penalty", against_fixed},
      {"tuned_penalty", best},
      {"fixed_penalty",
       {{"method", fixed.method},
        {"stiffness_N_per_m", fixed.tuning.stiffness_N_per_m},
        {"damping_ratio", fixed.tuning.damping_ratio},
        {"friction_slope", fixed.tuning.friction_slope}}},
      {"energy_rate", {{"concave", energy_rate(true)}, {"convex", energy_rate(false)}}},
      {"keys",
       {{"order", "by case and method: fitted slope of log error over log T; 0 where all errors are rounding"},
        {"order_residual_decades", "rms of the fit's residual, in decades of error"},
        {"speedup_over_tuned_penalty",
         "by case and method: run time of the best-tuned other method over ours at equal position error, median over "
         "errors of 1 um to 1 mm that both reach; 0 where there is none"},
        {"speedup_over_fixed_penalty", "the same against one method and tuning for all cases (fixed_penalty)"},
        {"tuned_penalty", "what was best at 0.1 mm"},
        {"energy_rate", "d ln(speed)/dt of (26) on a sphere of 0.1 m at 1 kg, 1 ms, and T f_n/(M R)"}}}};
}

std::vector<std::string> ErrorStudy::plot(const Table& table, const Options& /*options*/,
                                          const std::filesystem::path& out) const {
  const RunsByCase all = collect(table);
  const Fixed fixed = best_fixed(all);
  Chart work{.title = "Position error against run time",
             .columns = 3,
             .panel_width = 520,
             .panel_height = 370,
             .common_key = true};
  Chart order{.title = "Position error against timestep",
              .columns = 3,
              .panel_width = 520,
              .panel_height = 370,
              .common_key = true};
  for (const ErrorCase& which : error_cases()) {
    const auto found = all.find(which.name);
    if (found == all.end()) continue;
    const std::vector<Runs>& list = found->second;
    Panel by_time{.title = which.title,
                  .x_label = "run time (µs)",
                  .y_label = "rms error (m)",
                  .log_x = true,
                  .log_y = true,
                  .y_low = 1e-10,
                  .y_high = 0.1};
    Panel by_step{.title = which.title,
                  .x_label = "timestep (ms)",
                  .y_label = "rms error (m)",
                  .log_x = true,
                  .log_y = true,
                  .y_low = 1e-10,
                  .y_high = 0.1};
    for (const char* method : {"1", "2"}) {
      const Runs& ours = runs_of(list, method);
      Curve time{
          .name = std::string("(26)") + (method[0] == '1' ? "" : ", order 2"), .style = method[0] - '1', .marks = true};
      Curve step = time;
      for (std::size_t i = 0; i < ours.T.size(); ++i) {
        const double e = std::max(ours.envelope(i), 1.2e-10);
        time.x.push_back(1e-3 * ours.cost_ns[i]);
        time.y.push_back(e);
        step.x.push_back(1e3 * ours.T[i]);
        step.y.push_back(e);
      }
      by_time.curves.push_back(time);
      by_step.curves.push_back(step);
    }
    // For each other method the envelope over its tunings.
    for (int method = penalty_euler; method < method_count; ++method) {
      static constexpr std::array<const char*, method_count> labels{
          "", "", "penalty, semi-implicit Euler", "penalty, Runge-Kutta", "penalty, implicit Euler", "ROS rule"};
      Curve time{.name = labels[static_cast<std::size_t>(method)], .style = method};
      Curve step = time;
      std::map<double, double> best_time, best_step;
      for (const Runs& runs : list) {
        if (runs.method != method_names[static_cast<std::size_t>(method)]) continue;
        for (std::size_t i = 0; i < runs.T.size(); ++i) {
          const double e = runs.envelope(i), x = std::round(20.0 * std::log10(runs.cost_ns[i])) / 20.0;
          const auto note = [e](std::map<double, double>& best, double key) {
            const auto [place, is_new] = best.emplace(key, e);
            if (!is_new) place->second = std::min(place->second, e);
          };
          note(best_time, x);
          note(best_step, runs.T[i]);
        }
      }
      double least = infinity;
      for (const auto& [x, e] : best_time) {
        least = std::min(least, e);
        if (!(least < 0.1)) continue;
        time.x.push_back(1e-3 * std::pow(10.0, x));
        time.y.push_back(std::max(least, 1.2e-10));
      }
      for (const auto& [x, e] : best_step) {
        if (!(e < 0.1)) continue;
        step.x.push_back(1e3 * x);
        step.y.push_back(std::max(e, 1.2e-10));
      }
      by_time.curves.push_back(time);
      by_step.curves.push_back(step);
    }
    if (const Runs* one = fixed_runs(list, fixed); one != nullptr) {
      Curve time{.name = "one penalty for all cases", .style = 7, .marks = true};
      for (std::size_t i = 0; i < one->T.size(); ++i) {
        if (!(one->envelope(i) < 0.1)) continue;
        time.x.push_back(1e-3 * one->cost_ns[i]);
        time.y.push_back(std::max(one->envelope(i), 1.2e-10));
      }
      by_time.curves.push_back(time);
    }
    work.panels.push_back(by_time);
    order.panels.push_back(by_step);
  }
  std::vector<std::string> warnings;
  for (const auto& [chart, file] : {std::pair{&work, "error.svg"}, std::pair{&order, "error_order.svg"}}) {
    const std::string warning = draw(*chart, out / file);
    if (!warning.empty()) warnings.push_back(warning);
  }
  return warnings;
}

std::string ErrorStudy::text(const json& headline) const {
  std::ostringstream text;
  char line[200];
  std::snprintf(line, sizeof line, "%-14s %15s %19s %19s\n", "", "order (residual)", "faster than tuned",
                "than one for all");
  text << line;
  for (const auto& item : headline.at("order").items()) {
    for (const char* method : {"1", "2"}) {
      std::snprintf(line, sizeof line, "%-14s %s %6.2f (%.2f) %15.3g %19.3g\n", item.key().c_str(),
                    method[0] == '1' ? "(26)   " : "order 2", item.value().at(method).get<double>(),
                    headline.at("order_residual_decades").at(item.key()).at(method).get<double>(),
                    headline.at("speedup_over_tuned_penalty").at(item.key()).at(method).get<double>(),
                    headline.at("speedup_over_fixed_penalty").at(item.key()).at(method).get<double>());
      text << line;
    }
  }
  const json& fixed = headline.at("fixed_penalty");
  text << "one for all: " << fixed.at("method").get<std::string>() << ", " << fixed.at("stiffness_N_per_m")
       << " N/m, damping ratio " << fixed.at("damping_ratio") << "\n";
  for (const char* side : {"concave", "convex"}) {
    std::snprintf(line, sizeof line, "(26) on %s curvature: speed %+.4f /s, T f_n/(M R) %+.4f /s\n", side,
                  headline.at("energy_rate").at(side).at("measured_per_s").get<double>(),
                  headline.at("energy_rate").at(side).at("predicted_per_s").get<double>());
    text << line;
  }
  return text.str();
}

}  // namespace proxarm::studies
