#include "controller/extras/studies/stability_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "controller/extras/studies/stability_plot.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/plane.hpp"

namespace proxarm::studies {
namespace {

using controller::AdmittanceProxy;
using controller::HandModel;
using controller::LoopModel;
using models::Vec;
using nlohmann::json;
using Vec1 = Vec<1>;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

// Simulates the drive, the delay and the hand of controller/stability/stability.hpp: computes from the proxy's position
// the force that the sensor reads at the next step.
class LinearPlant {
 public:
  LinearPlant(const HandModel& hand, const LoopModel& loop, double intention_m, double start_m)
      : K_(hand.stiffness_N_per_m),
        D_(hand.damping_Ns_per_m / loop.period_s),
        m_((hand.mass_kg + loop.handle_mass_kg) / (loop.period_s * loop.period_s)),
        beta_(loop.drive_time_constant_s > 0.0 ? std::exp(-loop.period_s / loop.drive_time_constant_s) : 0.0),
        intention_(intention_m),
        p_(start_m),
        p1_(start_m),
        p2_(start_m) {
    const double periods = loop.delay_s / loop.period_s, whole = std::floor(periods + 1e-9);
    rest_ = std::max(0.0, periods - whole);
    grip_.assign(static_cast<std::size_t>(whole) + 2, K_ * (start_m - intention_m));
  }

  // Returns h(k + 1) for the proxy's q(k).
  double operator()(double q) noexcept {
    p2_ = p1_;
    p1_ = p_;
    p_ = (1.0 - beta_) * q + beta_ * p_;
    const double grip = K_ * (p_ - intention_) + D_ * (p_ - p1_) + m_ * (p_ - 2.0 * p1_ + p2_);
    grip_[next_] = grip;
    // The delay lies between the oldest sample and the sample after it.
    const std::size_t oldest = next_ + 1 == grip_.size() ? 0 : next_ + 1;
    const std::size_t younger = oldest + 1 == grip_.size() ? 0 : oldest + 1;
    next_ = oldest;
    return -((1.0 - rest_) * grip_[younger] + rest_ * grip_[oldest]);
  }
  [[nodiscard]] double first_force() const noexcept { return -grip_[0]; }

 private:
  double K_, D_, m_, beta_, intention_, p_, p1_, p2_, rest_ = 0.0;
  std::vector<double> grip_;
  std::size_t next_ = 0;
};

controller::AdmittanceConfig config(const LoopModel& loop, double mass_kg) {
  controller::AdmittanceConfig config;
  config.mass_kg = mass_kg;
  config.damping_Ns_per_m = loop.damping_Ns_per_m;
  config.spring_N_per_m = loop.spring_N_per_m;
  config.period_s = loop.period_s;
  config.order = loop.order;
  return config;
}

// The rates that are returned if a run shows only the rate's sign.
constexpr double blew_up = 1e3, died = -1e3;

// Returns ln r of the recorded motion, without the first share `from` of it: half the least-squares slope of ln(q(k)² −
// q(k+s) q(k−s)).
double slope(const std::vector<double>& q, double from) {
  const auto begin = static_cast<std::size_t>(from * static_cast<double>(q.size()));
  int crossings = 0;
  for (std::size_t k = begin + 1; k < q.size(); ++k) crossings += (q[k] < 0.0) != (q[k - 1] < 0.0) ? 1 : 0;
  const double theta = std::numbers::pi * crossings / static_cast<double>(q.size() - begin - 1);
  // sin(sθ) must not vanish, so near the Nyquist frequency (θ = π) the shift s must be several steps. At the Nyquist
  // frequency itself no such s exists, and |q| is used instead.
  std::size_t s = 0;
  const auto most = std::min<std::size_t>((q.size() - begin) / 4, 20'000);
  for (std::size_t i = 1; i <= most && s == 0; ++i) {
    if (std::abs(std::sin(static_cast<double>(i) * theta)) > 0.9) s = i;
  }
  const std::size_t stride = std::max<std::size_t>(1, (q.size() - begin) / 400);
  double n = 0.0, sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
  for (std::size_t k = begin + s; k + s < q.size(); k += stride) {
    const double size2 = q[k] * q[k] - (s == 0 ? 0.0 : q[k + s] * q[k - s]);
    if (!(size2 > 0.0)) continue;
    const double x = static_cast<double>(k - begin), y = 0.5 * std::log(size2);
    n += 1.0;
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  return spread > 0.0 ? (n * sum_xy - sum_x * sum_y) / spread : 0.0;
}

// Measures the rate ln|z| per step at which the slowest mode grows (positive: unstable) or decays.
//
// When a single mode A rᵏ cos(kθ + φ) is left, q(k)² − q(k+s) q(k−s) = A² r²ᵏ sin²(sθ) for any φ. So the logarithm of
// this expression is a straight line over k with slope ln r². The simulation doubles its length until the slope of the
// last quarter equals the slope of the second half within `share`, and the motion has grown or decayed by e⁸. By then a
// mode whose rate has the opposite sign would show, even if that mode started 3000 times smaller.
double growth(const HandModel& hand, const LoopModel& loop, double mass_kg) {
  constexpr double start = 1e-3, share = 0.005, folds = 8.0;
  constexpr int most_steps = 100'000;
  models::FreeSpace<1> nothing;
  AdmittanceProxy<1> proxy(config(loop, mass_kg), nothing);
  // The hand's target is 0, and the proxy is released from rest at the distance `start` from it.
  proxy.start({.q = Vec1(start)});
  static_cast<void>(proxy.set_reference(Vec1::Zero()));
  LinearPlant plant(hand, loop, 0.0, start);
  double h = plant.first_force();
  // A release from rest hardly excites modes near the Nyquist frequency. A force that moves the proxy by the distance
  // `start` for one step excites all modes alike.
  const double aside = mass_kg / (loop.period_s * loop.period_s) * start;
  const std::array<double, 3> kick{aside, -2.0 * aside, aside};
  std::vector<double> q{start};
  int crossings = 0, look_at = 40;
  double rate = 0.0;
  while (q.size() < most_steps) {
    const double pull = q.size() <= kick.size() ? kick[q.size() - 1] : 0.0;
    if (proxy.step(Vec1(h + pull)) != controller::ProxyFault::none) return blew_up;
    const double now = proxy.q()[0];
    h = plant(now);
    crossings += (now < 0.0) != (q.back() < 0.0) ? 1 : 0;
    q.push_back(now);
    if (std::abs(now) > 1e12 * start) return blew_up;
    if (q.size() % 1024 == 0 && std::abs(now) < 1e-12 * start && std::abs(h) < 1e-9 * start * hand.stiffness_N_per_m) {
      return died;
    }
    if (crossings < look_at) continue;
    look_at = 2 * crossings;
    const double last_quarter = slope(q, 0.75);
    rate = slope(q, 0.5);
    const double folded = std::abs(rate) * static_cast<double>(q.size());
    if (folded >= folds && std::abs(rate - last_quarter) <= share * std::abs(rate)) break;
  }
  return crossings >= 40 ? rate : died;
}

struct Contact {
  double bounces = 0.0;      // number of touches in the last third of the run
  double amplitude_m = 0.0;  // of the proxy in the last third of the run, peak to peak
  double growth = 0.0;       // amplitude_m over the amplitude in the second third; 0 if the proxy settles
};

// Simulates a hand that pushes the proxy against a wall 10 mm away. The hand's target is 20 mm behind the wall.
Contact push_against_wall(const HandModel& hand, const LoopModel& loop, double mass_kg) {
  constexpr double start = 0.01, intention = -0.02;
  models::Plane<1> wall(Vec1(0.0), Vec1(1.0));
  AdmittanceProxy<1> proxy(config(loop, mass_kg), wall);
  proxy.start({.q = Vec1(start)});
  LinearPlant plant(hand, loop, intention, start);
  double h = 0.0;
  const int steps = static_cast<int>(std::min(20'000.0, 3.0 / loop.period_s));
  Contact contact;
  std::array<double, 2> low{start, start}, high{-start, -start};  // of the proxy in the last two thirds of the run
  bool touched = false;
  for (int k = 0; k < steps; ++k) {
    if (proxy.step(Vec1(h)) != controller::ProxyFault::none) return {contact.bounces, blew_up, blew_up};
    h = plant(proxy.q()[0]);
    const bool touches = proxy.f()[0] > 0.0;
    const std::size_t third = 3 * k > 2 * steps ? 1 : 0;
    if (third == 1) contact.bounces += touches && !touched ? 1.0 : 0.0;
    if (3 * k > steps) {
      low[third] = std::min(low[third], proxy.q()[0]);
      high[third] = std::max(high[third], proxy.q()[0]);
    }
    touched = touches;
  }
  contact.amplitude_m = std::max(0.0, high[1] - low[1]);
  const double before_m = std::max(0.0, high[0] - low[0]);
  contact.growth = contact.amplitude_m == 0.0 ? 0.0 : before_m > 0.0 ? contact.amplitude_m / before_m : blew_up;
  return contact;
}

// The masses that are tried at walls, as multiples of the smallest stable mass.
constexpr std::array<double, 8> wall_multiples{1.02, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5, 2.0};

// Returns the smallest of the tried multiples of the smallest mass with which, and with all larger ones, bouncing at
// the wall doesn't grow. Returns infinity if bouncing grows with the largest multiple.
double bears_walls_from(const HandModel& hand, const LoopModel& loop, double smallest_kg) {
  double from = std::numeric_limits<double>::infinity();
  for (std::size_t i = wall_multiples.size(); i-- > 0;) {
    if (push_against_wall(hand, loop, wall_multiples[i] * smallest_kg).growth > 1.0) break;
    from = wall_multiples[i];
  }
  return from;
}

std::vector<double> decades(double low, double high, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(low * std::pow(high / low, i / (count - 1.0)));
  return values;
}

struct Grip {
  double damping_Ns_per_m, mass_kg;
};

struct Grid {
  std::vector<double> T, K, L, tau;
  std::vector<Grip> grips;
  std::vector<int> orders{1, 2};

  explicit Grid(bool quick)
      : T(decades(0.25e-3, 8e-3, quick ? 4 : 10)),
        K(decades(100.0, 5000.0, quick ? 4 : 10)),
        L(quick ? std::vector<double>{0.0, 4e-3, 16e-3} : std::vector<double>{0.0, 1e-3, 4e-3, 8e-3, 16e-3}),
        tau(quick ? std::vector<double>{1.6e-3} : std::vector<double>{0.0, 1.6e-3}),
        grips(quick ? std::vector<Grip>{{10.0, 0.0}, {20.0, 1.0}, {40.0, 2.0}}
                    : std::vector<Grip>{{10.0, 0.0}, {20.0, 0.0}, {10.0, 0.5}, {20.0, 1.0}, {40.0, 2.0}}) {}
  [[nodiscard]] std::size_t size() const {
    return T.size() * K.size() * L.size() * tau.size() * grips.size() * orders.size();
  }
};

// Returns the largest relative difference between the smallest stable mass from eigenvalues and the mass from the
// closed form for L = 0.
double d1_error() {
  double worst = 0.0;
  for (const double T : decades(1e-4, 1e-2, 9)) {
    for (const double K : decades(50.0, 5000.0, 9)) {
      for (const double D : {1.0, 10.0, 40.0}) {
        LoopModel loop;
        loop.period_s = T;
        const double exact = K * T * T / 4.0 + D * T / 2.0;
        const double found = controller::smallest_stable_mass({K, D, 0.0}, loop).value_or(0.0);
        worst = std::max(worst, std::abs(found / exact - 1.0));
      }
    }
  }
  return worst;
}

}  // namespace

double measured_boundary_kg(const HandModel& hand, const LoopModel& loop, double guess_kg) {
  // Brackets the boundary: the loop is unstable at `low` and stable at `high`.
  double low = guess_kg / 1.03, high = guess_kg * 1.03;
  double at_low = growth(hand, loop, low), at_high = growth(hand, loop, high);
  for (int i = 0; i < 24 && !(at_low > 0.0); ++i) {
    high = low;
    at_high = at_low;
    low /= 1.06;
    at_low = growth(hand, loop, low);
  }
  for (int i = 0; i < 24 && !(at_high < 0.0); ++i) {
    low = high;
    at_low = at_high;
    high *= 1.06;
    at_high = growth(hand, loop, high);
  }
  if (!(at_low > 0.0 && at_high < 0.0)) return nan_value;
  // Uses bisection instead of regula falsi, because the rate has a kink where another mode becomes the slowest mode.
  for (int i = 0; i < 7; ++i) {
    const double middle = std::sqrt(low * high);
    (growth(hand, loop, middle) > 0.0 ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

std::vector<Column> StabilityMap::columns() const {
  return {{"period_s"},     {"stiffness_N_per_m"}, {"damping_Ns_per_m"},
          {"hand_mass_kg"}, {"delay_s"},           {"drive_time_constant_s"},
          {"order"},        {"predicted_kg"},      {"measured_kg"},
          {"sensitivity"},  {"contact_bounces"},   {"contact_amplitude_m"},
          {"at_walls_kg"},  {"contact_growth"},    {"bears_walls_from"}};
}

// A job computes all stiffnesses of the hand with the other quantities constant, so that jobs aren't too small.
std::size_t StabilityMap::jobs(const Options& options) const {
  const Grid grid(options.quick);
  return grid.size() / grid.K.size();
}

std::vector<Row> StabilityMap::run(std::size_t job, const Options& options) const {
  const Grid grid(options.quick);
  std::size_t rest = job;
  const auto take = [&rest](const auto& list) {
    const auto value = list[rest % list.size()];
    rest /= list.size();
    return value;
  };
  LoopModel loop;
  loop.period_s = take(grid.T);
  loop.delay_s = take(grid.L);
  const Grip grip = take(grid.grips);
  loop.drive_time_constant_s = take(grid.tau);
  loop.order = take(grid.orders);
  loop.with_events = false;
  LoopModel at_walls = loop;
  at_walls.with_events = true;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < grid.K.size(); ++i) {
    const HandModel hand{grid.K[i], grip.damping_Ns_per_m, grip.mass_kg};
    const auto predicted = controller::smallest_stable_mass(hand, loop);
    double measured = nan_value, sensitivity = nan_value;
    Contact contact{nan_value, nan_value, nan_value};
    double bears_from = nan_value;
    const auto predicted_at_walls = controller::smallest_stable_mass(hand, at_walls);
    if (predicted) {
      HandModel stiffer = hand;
      stiffer.stiffness_N_per_m *= 1.01;
      const auto other = controller::smallest_stable_mass(stiffer, loop);
      sensitivity = other ? std::abs(std::log(*other / *predicted)) / std::log(1.01) : 1e3;
      // The guess differs from the prediction by up to 2.7 %, by another factor at each point. If the guess were the
      // prediction itself, a correct prediction would be at the same place in the bisection's last interval at every
      // point.
      const double share = std::fmod(static_cast<double>(job * grid.K.size() + i) * 0.6180339887498949, 1.0);
      measured = measured_boundary_kg(hand, loop, *predicted * std::pow(1.03, 1.8 * (share - 0.5)));
      if ((job + i) % 10 == 0 && predicted_at_walls) {
        contact = push_against_wall(hand, loop, wall_margin * *predicted_at_walls);
        bears_from = bears_walls_from(hand, loop, *predicted_at_walls);
      }
    } else {
      // Compares the signs of the measured and the predicted rate at a mass that oscillates with a period of some
      // hundred steps.
      const double mass = std::clamp(hand.stiffness_N_per_m * std::pow(40.0 * loop.period_s, 2), 1e-2, 1000.0);
      const bool grows = growth(hand, loop, mass) > 0.0;
      measured = grows == (controller::spectral_radius(hand, loop, mass) > 1.0) ? -1.0 : 0.0;
    }
    rows.push_back({loop.period_s, hand.stiffness_N_per_m, hand.damping_Ns_per_m, hand.mass_kg, loop.delay_s,
                    loop.drive_time_constant_s, static_cast<double>(loop.order), predicted.value_or(-1.0), measured,
                    sensitivity, contact.bounces, contact.amplitude_m, predicted_at_walls.value_or(-1.0),
                    contact.growth, bears_from});
  }
  return rows;
}

json StabilityMap::headline(const Table& table, const Options& /*options*/) const {
  const std::size_t predicted = table.column("predicted_kg"), measured = table.column("measured_kg"),
                    sensitivity = table.column("sensitivity"), bounces = table.column("contact_bounces"),
                    bears_from = table.column("bears_walls_from");
  std::int64_t ill = 0, none = 0, none_disagree = 0, not_found = 0, contact = 0, contact_cycles = 0, compared = 0;
  std::int64_t diverged = 0, want_more = 0;
  double worst = 0.0, sum2 = 0.0, most_from = 0.0;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double p = table.number(row, predicted), m = table.number(row, measured);
    if (std::isfinite(table.number(row, bounces))) {
      ++contact;
      contact_cycles += table.number(row, bounces) > 1.0 ? 1 : 0;
      const double from = table.number(row, bears_from);
      diverged += from > wall_margin ? 1 : 0;
      want_more += from > wall_multiples.front() ? 1 : 0;
      most_from = std::max(most_from, from);
    }
    if (p < 0.0) {
      ++none;
      none_disagree += m < 0.0 ? 0 : 1;
    } else if (!(table.number(row, sensitivity) < well_conditioned)) {
      ++ill;
    } else if (!std::isfinite(m)) {
      ++not_found;
    } else {
      const double error = std::abs(m / p - 1.0);
      worst = std::max(worst, error);
      sum2 += error * error;
      ++compared;
    }
  }
  return {
      {"points", table.rows()},
      {"boundary_error_max", worst},
      {"boundary_error_rms", std::sqrt(sum2 / static_cast<double>(std::max<std::int64_t>(1, compared)))},
      {"compared", compared},
      {"ill_conditioned", ill},
      {"no_stable_mass", none},
      {"no_stable_mass_disagree", none_disagree},
      {"not_found", not_found},
      {"contact_points", contact},
      {"contact_cycles", contact_cycles},
      {"contact_diverged", diverged},
      {"contact_want_more", want_more},
      {"contact_bears_from_max", std::isfinite(most_from) ? json(most_from) : json()},
      {"wall_margin", wall_margin},
      {"d1_error_max", d1_error()},
      {"keys",
       {{"points", "combinations of timestep, hand, delay, drive and order"},
        {"boundary_error_max",
         "the largest |measured/predicted - 1| of the smallest stable mass, ill-conditioned apart"},
        {"compared", "points of boundary_error_max"},
        {"ill_conditioned", "points where 1 % of the hand's stiffness moves the boundary by 3 % or more"},
        {"no_stable_mass",
         "points where no mass up to 1000 kg is stable; _disagree: simulation and eigenvalues differ at a mass that "
         "oscillates fast enough to be followed"},
        {"not_found", "points where the simulation showed no boundary near the predicted one"},
        {"contact_points",
         "points that were also simulated against a wall, at 1.02 to 2 times the smallest mass that is stable by "
         "eigenvalues; order 2 steps by (26) at contacts, and must be stable as both"},
        {"contact_cycles", "of those, how many went on making and breaking contact at wall_margin times that mass"},
        {"wall_margin", "from that many times the smallest mass on the map calls a mass stable at walls"},
        {"contact_diverged",
         "of those, how many swing more in the last third of the simulation than in the one before, at wall_margin "
         "times the smallest mass or more; a failure"},
        {"contact_want_more",
         "points that do at 1.02 times or more: eigenvalues know no impacts, each of which goes round the loop as a "
         "pulse that hardly fades where the hand is about as heavy as the proxy"},
        {"contact_bears_from_max", "the multiple of the smallest mass from which on no point does"},
        {"d1_error_max", "ideal drive, no delay beyond one period: error of the prediction against K T^2/4 + D T/2"}}}};
}

std::vector<std::string> StabilityMap::plot(const Table& table, const Options& /*options*/,
                                            const std::filesystem::path& out) const {
  return draw_stability(table, out);
}

std::string StabilityMap::text(const json& headline) const {
  std::ostringstream text;
  char line[300];
  std::snprintf(
      line, sizeof line,
      "%lld points: measured and predicted boundary differ by %.3g %% at most, %.2g %% rms (%lld compared, %lld "
      "ill-conditioned, %lld without a stable mass)\n",
      headline.at("points").get<long long>(), 100.0 * headline.at("boundary_error_max").get<double>(),
      100.0 * headline.at("boundary_error_rms").get<double>(), headline.at("compared").get<long long>(),
      headline.at("ill_conditioned").get<long long>(), headline.at("no_stable_mass").get<long long>());
  text << line << "not found " << headline.at("not_found") << ", disagreeing where no mass is stable "
       << headline.at("no_stable_mass_disagree") << "; K T²/4 + D T/2 to " << headline.at("d1_error_max").get<double>()
       << "\nagainst a wall: " << headline.at("contact_points") << " points, " << headline.at("contact_cycles")
       << " that go on touching, " << headline.at("contact_diverged") << " that diverge at "
       << headline.at("wall_margin") << " times the smallest mass; " << headline.at("contact_want_more")
       << " want more than 1.02 times, " << headline.at("contact_bears_from_max") << " at most\n";
  return text.str();
}

bool StabilityMap::failed(const json& headline) const { return headline.at("contact_diverged").get<int>() > 0; }

}  // namespace proxarm::studies
