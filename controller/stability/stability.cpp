#include "controller/stability/stability.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "controller/stability/order2_polynomials.hpp"
#include "controller/stability/smallest.hpp"
#include "models/base/option_check.hpp"
#include "models/geometry/eigenvalues.hpp"

namespace proxarm::controller {
namespace {

using Complex = std::complex<double>;
using Polynomial = std::vector<double>;  // coefficients of w⁰, w¹, …

constexpr double least_mass_kg = 1e-6;

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

Polynomial operator*(double factor, Polynomial a) {
  for (double& coefficient : a) coefficient *= factor;
  return a;
}

Polynomial operator+(Polynomial a, const Polynomial& b) {
  if (a.size() < b.size()) a.resize(b.size(), 0.0);
  for (std::size_t i = 0; i < b.size(); ++i) a[i] += b[i];
  return a;
}

template <std::size_t N>
Polynomial polynomial(const std::array<double, N>& coefficients) {
  return {coefficients.begin(), coefficients.end()};
}

// Returns w^n for n = `periods` ≥ 0. A fraction of a period is interpolated linearly.
Polynomial delay(double periods) {
  // 1e-9, because L/T is a quotient of decimal numbers, and rounding may put the quotient just below a whole number.
  const double whole = std::floor(periods + 1e-9), rest = std::max(0.0, periods - whole);
  Polynomial w(static_cast<std::size_t>(whole) + 2, 0.0);
  w[static_cast<std::size_t>(whole)] = 1.0 - rest;
  w[static_cast<std::size_t>(whole) + 1] = rest;
  if (rest == 0.0) w.pop_back();
  return w;
}

// X and Y of C(w) = M X(w) + Y(w), both multiplied by T² so that the coefficients have similar sizes.
struct Loop {
  Polynomial X, Y;
};

Loop make_loop(const HandModel& hand, const LoopModel& loop) {
  const double T = loop.period_s, B = loop.damping_Ns_per_m;
  const double beta = loop.drive_time_constant_s > 0.0 ? std::exp(-T / loop.drive_time_constant_s) : 0.0;
  const double pole = loop.filter_s > 0.0 ? std::exp(-T / loop.filter_s) : 0.0;
  const Polynomial difference{1.0, -1.0}, one_lag{1.0, -pole};
  const Polynomial lag = Polynomial{1.0, -beta} * (one_lag * one_lag);
  const double delay_s = std::max(0.0, loop.delay_s - 2.0 * loop.filter_s);
  const Polynomial damper = loop.explicit_damping ? Polynomial{0.0, 1.0} * difference
                            : loop.order == 2     ? polynomial(order2_difference)
                                                  : difference;  // difference quotient times T
  const double m = hand.mass_kg + loop.handle_mass_kg;
  const Polynomial grip = Polynomial{hand.stiffness_N_per_m * T * T} + hand.damping_Ns_per_m * T * difference +
                          m * (difference * difference);
  Polynomial force = (1.0 - beta) * (1.0 - pole) * (1.0 - pole) * (delay(1.0 + delay_s / T) * grip);
  if (loop.horizon_s > 0.0) {
    force = (Polynomial{1.0} + loop.horizon_s / T * difference) * force;
  }
  Polynomial own = B * T * damper + Polynomial{loop.spring_N_per_m * T * T};
  if (loop.order == 2) {
    own = polynomial(order2_weights) * own;
    force = polynomial(order2_force) * force;
  }
  return {lag * (difference * difference), lag * own + force};
}

// Returns p(w) by Horner's scheme, written out: std::complex would test each product for NaN, which would take most of
// a sweep's time.
Complex evaluate(const Polynomial& p, Complex w) {
  double re = 0.0, im = 0.0;
  for (std::size_t i = p.size(); i-- > 0;) {
    const double next = re * w.real() - im * w.imag() + p[i];
    im = re * w.imag() + im * w.real();
    re = next;
  }
  return {re, im};
}

// Returns the largest |z| of the roots z = 1/w of C. The roots are the eigenvalues of the companion matrix of zⁿ
// C(1/z).
double spectral_radius(const Loop& loop, double M) {
  Polynomial c = M * loop.X + loop.Y;
  while (c.size() > 1 && c.back() == 0.0) c.pop_back();
  const auto n = static_cast<Eigen::Index>(c.size()) - 1;
  if (n < 1) return 0.0;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    companion(0, i) = -c[static_cast<std::size_t>(i) + 1] / c[0];
    if (i > 0) companion(i, i - 1) = 1.0;
  }
  return models::spectral_radius(companion);
}

Complex on_circle(double theta) { return std::polar(1.0, -theta); }

// Returns Im(−Y/X) up to a positive factor. Where the result changes sign, a real mass puts a root at z = exp(jθ).
double imaginary_part(const Loop& loop, double theta) {
  const Complex w = on_circle(theta);
  return (-evaluate(loop.Y, w) * std::conj(evaluate(loop.X, w))).imag();
}

double mass_at(const Loop& loop, double theta) {
  const Complex w = on_circle(theta);
  return (-evaluate(loop.Y, w) / evaluate(loop.X, w)).real();
}

// Returns all masses in (0, max_mass_kg] that put a root on the unit circle, in descending order.
std::vector<double> critical_masses(const Loop& loop, double max_mass_kg) {
  constexpr double pi = std::numbers::pi;
  // The grid of θ has 200 points per decade at its lower end, because a large mass M has slow roots, at θ = T√(K/M). At
  // its upper end the grid has at least 40 points for each turn of w^n around the circle.
  std::vector<double> grid;
  for (int i = 0; i <= 1200; ++i) grid.push_back(0.1 * std::pow(10.0, (i - 1200) / 200.0));
  const std::size_t even = 40 * std::max<std::size_t>(loop.Y.size(), 25);
  for (std::size_t i = 1; i < even; ++i) {
    grid.push_back(0.1 + (pi - 0.1) * static_cast<double>(i) / static_cast<double>(even));
  }
  grid.push_back(pi * (1.0 - 1e-9));  // at π itself the imaginary part is zero for every mass
  std::vector<double> masses{mass_at(loop, pi)};
  double before = imaginary_part(loop, grid.front());
  for (std::size_t i = 1; i < grid.size(); ++i) {
    const double now = imaginary_part(loop, grid[i]);
    if ((before < 0.0) != (now < 0.0)) {
      double low = grid[i - 1], high = grid[i];
      for (int halving = 0; halving < 60; ++halving) {
        const double middle = 0.5 * (low + high);
        ((imaginary_part(loop, middle) < 0.0) == (before < 0.0) ? low : high) = middle;
      }
      masses.push_back(mass_at(loop, 0.5 * (low + high)));
    }
    before = now;
  }
  std::erase_if(masses, [max_mass_kg](double m) { return !(m > least_mass_kg && m < max_mass_kg); });
  std::sort(masses.rbegin(), masses.rend());
  return masses;
}

// A contact adds two things to the proxy: a spring in the tool's space, and the directions N in which friction holds
// the proxy.
struct Touch {
  Eigen::MatrixXd spring, forbidden;
};

// Returns a basis of the directions orthogonal to n. Precondition: n has two or three dimensions.
Eigen::MatrixXd across(const Eigen::VectorXd& n) {
  Eigen::MatrixXd basis(n.size(), n.size() - 1);
  if (n.size() == 2) {
    basis << -n.y(), n.x();
    return basis;
  }
  const models::Vec3 n_3 = n, one = n_3.unitOrthogonal();
  basis << one, n_3.cross(one);
  return basis;
}

// Returns free motion first, then the layers that the arm's tool can press on.
std::vector<Touch> touches_of(const ElasticArm& arm, const LoopModel& loop) {
  // Smallest length of a unit normal's part in the tool's space. Below it, friction would hold the tool more than the
  // layer does.
  constexpr double least_share = 0.05;
  const Eigen::Index d = arm.jacobian.rows();
  std::vector<Touch> touches{{Eigen::MatrixXd::Zero(d, d), Eigen::MatrixXd(d, 0)}};
  if (!loop.layers || arm.axes.cols() != d) return touches;
  for (const LayerTouch& layer : *loop.layers) {
    Touch touch{arm.axes.transpose() * layer.spring_W * arm.axes, Eigen::MatrixXd(d, 0)};
    if (layer.sticks_along_W) {
      const Eigen::VectorXd n = arm.axes.transpose() * *layer.sticks_along_W;
      if (d < 2 || n.norm() < least_share) continue;
      touch.forbidden = across(n.normalized());
    }
    touches.push_back(std::move(touch));
  }
  return touches;
}

bool damps_gears(const LoopModel& loop) {
  return loop.gear_damping.damping_per_s > 0.0 && loop.gear_damping.joints != 0 && loop.arms;
}

// The drives with which a loop is judged. A horizon is chosen and judged only with drives that lag, since lookahead
// compensates for lags.
enum class Drives { lag, both };

// Returns the loops that must be stable: the given loop and, with torque-damped gears, this loop with each of the
// errors of stability.hpp, since stability then rests on the torque measurement. Soft gears come first, because they
// require the most mass.
std::vector<LoopModel> with_torque_errors(const LoopModel& loop) {
  if (!damps_gears(loop)) return {loop};
  LoopModel soft = loop, late = loop;
  soft.gear_stiffness_ratio = gear_margins.front();
  late.gear_torque_ratio = 1.0 + torque_margin;
  late.gear_torque_late_s = late_torque_s;
  if (loop.gear_stiffness_ratio != 1.0) return {loop, late};
  return {soft, loop, late};
}

LoopModel feeding_forward(LoopModel loop) {
  loop.feed_forward = true;
  return loop;
}

// The loops in all poses, in free motion and on all layers, with both kinds of drive, since the cell doesn't say which
// kind it has.
class ElasticLoops {
 public:
  ElasticLoops(const HandModel& hand, const LoopModel& loop, Drives drives = Drives::both)
      : damping_(loop.damping_Ns_per_m), spring_(loop.spring_N_per_m) {
    std::vector<LoopModel> ways = with_torque_errors(loop);
    const bool lags = drives == Drives::lag || !loop.either_drive || loop.horizon_s > 0.0;
    if (!lags && loop.drive_time_constant_s > 0.0 && !loop.feed_forward) {
      for (const LoopModel& way : with_torque_errors(loop)) ways.push_back(feeding_forward(way));
    }
    for (const ElasticArm& arm : *loop.arms) {
      for (const LoopModel& way : ways) loops_.push_back({ElasticLoop(arm, hand, way), touches_of(arm, loop)});
    }
  }
  [[nodiscard]] double spectral_radius(double proxy_mass_kg) const {
    double largest = 0.0;
    for (const Posed& posed : loops_) {
      for (const Touch& touch : posed.touches)
        largest = std::max(largest, spectral_radius(posed.loop, touch, proxy_mass_kg));
    }
    return largest;
  }
  // Returns the mass above which every mass up to max_mass_kg is stable. Most touches are stable at the mass that
  // earlier touches require; these touches aren't searched.
  [[nodiscard]] std::optional<double> smallest_stable(double max_mass_kg) const {
    constexpr double least_kg = 1e-3, close_enough = 1.002;
    double smallest = 0.0;
    for (const Posed& posed : loops_) {
      for (const Touch& touch : posed.touches) {
        const auto holds = [&](double mass_kg) { return spectral_radius(posed.loop, touch, mass_kg) < 1.0; };
        if (smallest > 0.0 && holds_from(smallest, max_mass_kg, holds)) continue;
        const auto here = smallest_from_above(holds, max_mass_kg, least_kg, close_enough);
        if (!here) return std::nullopt;
        smallest = std::max(smallest, *here);
      }
    }
    return smallest;
  }

 private:
  struct Posed {
    ElasticLoop loop;
    std::vector<Touch> touches;
  };

  [[nodiscard]] double spectral_radius(const ElasticLoop& loop, const Touch& touch, double proxy_mass_kg) const {
    const Eigen::Index d = touch.spring.rows();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(d, d);
    return loop.spectral_radius({proxy_mass_kg / elastic_margin * one, damping_ * one, spring_ * one + touch.spring},
                                touch.forbidden);
  }

  // Returns whether some masses from the smallest to the largest are stable, since a layer's unstable masses can lie
  // above stable ones.
  template <class Holds>
  static bool holds_from(double smallest_kg, double largest_kg, const Holds& holds) {
    for (const double share : {0.0, 0.1, 0.25, 1.0}) {
      if (!holds(smallest_kg * std::pow(largest_kg / smallest_kg, share))) return false;
    }
    return true;
  }

  double damping_, spring_;
  std::vector<Posed> loops_;
};

// Returns K_v of the rigid loop in free motion, and K_v plus the largest stiffness of each entry of `layers`, without
// duplicates.
std::vector<double> springs_of(const LoopModel& loop) {
  std::vector<double> springs{loop.spring_N_per_m};
  if (!loop.layers) return springs;
  for (const LayerTouch& layer : *loop.layers) {
    springs.push_back(loop.spring_N_per_m + models::symmetric_eigenvalues(layer.spring_W).maxCoeff());
  }
  std::sort(springs.begin(), springs.end());
  const auto same = [](double a, double b) { return b - a <= 1e-9 * b; };
  springs.erase(std::unique(springs.begin(), springs.end(), same), springs.end());
  return springs;
}

// Above this proxy mass the loop is judged with a rigid arm. The gears don't matter there, since the hand's mass is
// small compared to the proxy's. Besides, rounding couldn't separate the eigenvalues of the slowest modes from 1; a
// proxy has two eigenvalues close to 1.
constexpr double heaviest_on_gears_kg = 50.0;

// A usual felt mass, between the lightest felt mass and the arm's own mass.
constexpr double usual_kg = 10.0;

// Returns the smallest stable mass with a rigid arm: searches from max_mass_kg down to the first interval of unstable
// masses.
std::optional<double> smallest_on_rigid(const Loop& loop, double max_mass_kg) {
  if (!(spectral_radius(loop, max_mass_kg) < 1.0)) return std::nullopt;
  double smallest = max_mass_kg;
  std::vector<double> edges = critical_masses(loop, max_mass_kg);
  edges.push_back(least_mass_kg);
  double above = max_mass_kg;
  for (const double edge : edges) {
    if (above > edge && !(spectral_radius(loop, std::sqrt(above * edge)) < 1.0)) break;
    smallest = above = edge;
  }
  return smallest;
}

// Returns the two loops of order 2 with events: order 2 in free motion, and order 1 for the steps in which contacts
// change.
std::pair<LoopModel, LoopModel> both_methods(const LoopModel& loop) {
  LoopModel free = loop, at_events = loop;
  free.with_events = false;
  at_events.order = 1;
  return {free, at_events};
}

LoopModel with_layers(const LoopModel& loop, std::vector<LayerTouch> layers) {
  LoopModel with = loop;
  with.layers = layers.empty() ? nullptr : std::make_shared<const std::vector<LayerTouch>>(std::move(layers));
  return with;
}

std::string text(const char* pattern, double value) {
  char buffer[80];
  std::snprintf(buffer, sizeof buffer, pattern, value);
  return buffer;
}

}  // namespace

double round_up(double mass) {
  const double unit = std::pow(10.0, std::floor(std::log10(mass)) - 1.0);
  return std::ceil(mass / unit * (1.0 + 1e-9)) * unit;
}

namespace {
double largest_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg, Drives drives) {
  if (loop.order == 2 && loop.with_events) {
    const auto [free, at_events] = both_methods(loop);
    return std::max(largest_radius(hand, free, proxy_mass_kg, drives),
                    largest_radius(hand, at_events, proxy_mass_kg, drives));
  }
  if (loop.arms && proxy_mass_kg <= heaviest_on_gears_kg)
    return ElasticLoops(hand, loop, drives).spectral_radius(proxy_mass_kg);
  double largest = 0.0;
  LoopModel pressed = loop;
  for (const double spring : springs_of(loop)) {
    pressed.spring_N_per_m = spring;
    largest = std::max(largest, spectral_radius(make_loop(hand, pressed), proxy_mass_kg));
  }
  return largest;
}
}  // namespace

double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg) {
  return largest_radius(hand, loop, proxy_mass_kg, Drives::both);
}

std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& model, double max_mass_kg) {
  if (model.order == 2 && model.with_events) {
    const auto [free, at_events] = both_methods(model);
    const auto one = smallest_stable_mass(hand, free, max_mass_kg);
    const auto other = smallest_stable_mass(hand, at_events, max_mass_kg);
    return one && other ? std::optional(std::max(*one, *other)) : std::nullopt;
  }
  if (model.arms) {
    LoopModel rigid = model;
    rigid.arms = nullptr;
    const auto without_gears = smallest_stable_mass(hand, rigid, max_mass_kg);
    if (!without_gears || *without_gears > heaviest_on_gears_kg) return without_gears;
    return ElasticLoops(hand, model).smallest_stable(std::min(max_mass_kg, heaviest_on_gears_kg));
  }
  double smallest = 0.0;
  LoopModel pressed = model;
  for (const double spring : springs_of(model)) {
    pressed.spring_N_per_m = spring;
    const std::optional<double> there = smallest_on_rigid(make_loop(hand, pressed), max_mass_kg);
    if (!there) return std::nullopt;
    smallest = std::max(smallest, *there);
  }
  return smallest;
}

bool with_margins(const HandModel& hand, const LoopModel& loop,
                  const std::function<bool(const HandModel&, const LoopModel&)>& holds) {
  for (const double stiffer : {1.0, hand_margin}) {
    for (const double heavier : {1.0, hand_margin}) {
      for (const double later : {1.0, delay_margin}) {
        HandModel other = hand;
        other.stiffness_N_per_m *= stiffer;
        other.mass_kg *= heavier;
        LoopModel slower = loop;
        slower.delay_s *= later;
        if (!holds(other, slower)) return false;
      }
    }
  }
  return true;
}

namespace {

struct Held {
  HandModel hand;
  LoopModel loop;
};

// Returns one loop for each combination of pose, hand, delay and gear stiffness for which a horizon must be stable.
std::vector<Held> held_in_all_ways(const HandModel& hand, const LoopModel& model, double proxy_mass_kg) {
  std::vector<LoopModel> poses;
  if (!model.arms) poses = {model};
  for (std::size_t i = 0; model.arms && i < model.arms->size(); ++i) {
    poses.push_back(model);
    poses.back().arms = std::make_shared<const std::vector<ElasticArm>>(1, (*model.arms)[i]);
  }
  std::vector<Held> all;
  for (LoopModel loop : poses) {
    loop = with_worst_layers(hand, loop, proxy_mass_kg);
    const double unsure_s = loop.delay_s - 2.0 * loop.filter_s;
    for (const double ratio : gear_margins) {
      loop.gear_stiffness_ratio = ratio;
      for (const double stiffer : {1.0, hand_margin}) {
        for (const double heavier : {1.0, heavy_hand}) {
          for (const double later : {1.0, delay_margin}) {
            all.push_back({hand, loop});
            all.back().hand.stiffness_N_per_m *= stiffer;
            all.back().hand.mass_kg *= heavier;
            all.back().loop.delay_s += (later - 1.0) * unsure_s;
          }
        }
      }
    }
  }
  return all;
}

}  // namespace

double stable_horizon_s(const HandModel& hand, const LoopModel& model, double proxy_mass_kg) {
  if (!(proxy_mass_kg > 0.0)) return 0.0;
  const double T = model.period_s;
  const auto radius = [&](Held& held, int steps) {
    held.loop.horizon_s = steps * T;
    return largest_radius(held.hand, held.loop, proxy_mass_kg, Drives::lag);
  };
  std::vector<Held> all = held_in_all_ways(hand, model, proxy_mass_kg);
  std::vector<double> without;
  for (Held& held : all) without.push_back(radius(held, 0));
  const double worst = *std::max_element(without.begin(), without.end());
  int steps = static_cast<int>(auto_share * (T + model.delay_s + model.drive_time_constant_s) / T);
  for (std::size_t i = 0; i < all.size(); ++i) {
    while (steps > 0) {
      const double with = radius(all[i], steps);
      if (with < 1.0 || (without[i] >= 1.0 && with <= worst)) break;
      --steps;
    }
  }
  return steps * T;
}

namespace {
// Returns whether gears of gear_margins.back() times their stiffness come to rest under 10 and 50 kg, in the given hand
// and in a heavy one.
bool stiff_gears_hold(const HandModel& hand, LoopModel loop) {
  loop.gear_stiffness_ratio = gear_margins.back();
  HandModel heavy = hand;
  heavy.mass_kg *= heavy_hand;
  for (const double mass_kg : {heaviest_on_gears_kg, usual_kg}) {
    if (!(spectral_radius(hand, loop, mass_kg) < 1.0) || !(spectral_radius(heavy, loop, mass_kg) < 1.0)) return false;
  }
  return true;
}
}  // namespace

double best_gear_damping_per_s(const HandModel& hand, const LoopModel& model) {
  if (model.gear_damping.joints == 0) return 0.0;
  LoopModel loop = model;
  loop.horizon_s = 0.0;
  loop.order = 1;
  loop.layers = nullptr;
  loop.gear_damping.damping_per_s = 0.0;
  // A κ that is unstable at this share of the smallest mass so far is skipped.
  constexpr double lighter = 0.98;
  double best = 0.0, least_kg = smallest_stable_mass(hand, loop).value_or(heaviest_on_gears_kg);
  for (const double tried : tried_gear_dampings_per_s) {
    loop.gear_damping.damping_per_s = tried;
    if (!(spectral_radius(hand, loop, lighter * least_kg) < 1.0) || !stiff_gears_hold(hand, loop)) continue;
    const std::optional<double> smallest = smallest_stable_mass(hand, loop);
    if (!smallest || *smallest >= least_kg) continue;
    best = tried;
    least_kg = *smallest;
  }
  return best;
}

LoopModel with_worst_layers(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg) {
  constexpr std::size_t most = 2;
  if (!loop.layers || loop.layers->size() <= most) return loop;
  std::vector<std::pair<double, const LayerTouch*>> by_radius;
  for (const LayerTouch& layer : *loop.layers)
    by_radius.emplace_back(spectral_radius(hand, with_layers(loop, {layer}), proxy_mass_kg), &layer);
  std::stable_sort(by_radius.begin(), by_radius.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  return with_layers(loop, {*by_radius[0].second, *by_radius[1].second});
}

// Tries each layer just below the smallest stable mass: the layer that requires this mass is unstable there. If no mass
// is stable, tries the layers at heaviest_on_gears_kg, since a layer's unstable masses can lie above stable ones.
std::optional<LayerLimit> decisive_layer(const HandModel& hand, const LoopModel& loop) {
  constexpr double more = 1.01;  // a factor larger than the search's tolerance
  if (!loop.layers) return std::nullopt;
  const std::optional<double> smallest = smallest_stable_mass(hand, loop);
  const std::optional<double> without = smallest_stable_mass(hand, with_layers(loop, {}));
  if (!without || (smallest && *smallest <= more * *without)) return std::nullopt;
  const double unstable_kg = smallest ? *smallest / more : heaviest_on_gears_kg;
  for (const LayerTouch& layer : *loop.layers) {
    if (!(spectral_radius(hand, with_layers(loop, {layer}), unstable_kg) < 1.0))
      return LayerLimit{layer.what, smallest};
  }
  return std::nullopt;
}

std::optional<DampedMass> least_damping(const LoopModel& loop, double most_kg,
                                        const std::function<std::optional<double>(const LoopModel&)>& smallest,
                                        double unit) {
  LoopModel damped = loop;
  for (const double tried : tried_dampings) {
    damped.damping_Ns_per_m = unit * tried;
    if (!(damped.damping_Ns_per_m > loop.damping_Ns_per_m)) continue;
    const std::optional<double> mass = smallest(damped);
    if (mass && *mass <= most_kg) return DampedMass{damped.damping_Ns_per_m, *mass};
  }
  return std::nullopt;
}

namespace {

// Words of a check, for a mass or for an inertia about a point. `damping` scales tried_dampings: 20 Ns/m at a distance
// of 0.1 m are 0.2 Nms/rad.
struct Words {
  const char *option, *unit, *what, *damping_option;
  const char *stiffness_unit, *damping_unit;
  double damping;
};
constexpr Words of_mass{"--mass", "kg", "mass", "--damping", "N/m", "Ns/m", 1.0};
constexpr Words of_inertia{"--inertia", "kg m²", "inertia", "--turning-damping", "Nm/rad", "Nms/rad", 0.01};

// A damping above this isn't advised for the sake of a light mass.
constexpr double honey_Ns_per_m = 50.0;

// Returns for example "--damping 20 Ns/m, with which 12 kg are stable"; empty if no tried damping suffices.
std::string damping_text(const HandModel& hand, const LoopModel& loop, double most_felt, double most_damping,
                         const Words& w) {
  const double handle = loop.handle_mass_kg;
  const auto smallest = [&](const LoopModel& damped) { return smallest_stable_mass(hand, damped); };
  const auto found = least_damping(loop, most_felt - handle, smallest, w.damping);
  if (!found || found->damping_Ns_per_m > most_damping * w.damping) return "";
  return w.damping_option + text(" %.3g ", found->damping_Ns_per_m) + w.damping_unit +
         text(", with which %.2g ", round_up(found->mass_kg + handle)) + w.unit + " are stable";
}

void require_stable(double felt, const HandModel& hand, const LoopModel& loop, bool force_unstable, const Words& w) {
  const double handle = loop.handle_mass_kg;
  const std::string unit = std::string(" ") + w.unit;
  const auto refuse = [&](const std::string& expected, const std::string& advice) {
    throw description::SetupError(
        {.key = w.option, .found = text("%.6g", felt) + unit, .expected = expected, .advice = advice});
  };
  if (!std::isfinite(felt) || !(felt > handle)) {
    refuse(text("more than the handle's own %.3g", handle) + unit,
           "the handle sits after the sensor, so no control can make it lighter");
  }
  if (force_unstable || spectral_radius(hand, loop, felt - handle) < 1.0) return;
  const std::optional<LayerLimit> layer = decisive_layer(hand, loop);
  const std::string grip = (layer ? "on " + layer->what + " " : "") +
                           text("with a hand of %.4g ", hand.stiffness_N_per_m) + w.stiffness_unit +
                           text(", %.4g ", hand.damping_Ns_per_m) + w.damping_unit + text(", %.3g", hand.mass_kg) +
                           unit + text(" and a delay of %.3g ms", 1e3 * (loop.period_s + loop.delay_s)) +
                           text(" (drives: %.3g ms)", 1e3 * loop.drive_time_constant_s);
  const auto smallest = smallest_stable_mass(hand, loop);
  if (!smallest) {
    // If B + D_h ≤ K_h L, no mass is stable.
    const std::string some = damping_text(hand, loop, HUGE_VAL, HUGE_VAL, w);
    const std::string wanted = damping_text(hand, loop, felt, honey_Ns_per_m, w);
    const std::string add =
        some.empty() ? "" : "add " + some + (wanted == some || wanted.empty() ? "" : ", or " + wanted) + "; or ";
    refuse(std::string("a loop that some ") + w.what + " makes stable; " + grip + " none does",
           add + "shorten the delay by a smaller --timestep (--force-unstable overrides, in simulation)");
  }
  const std::string wanted = damping_text(hand, loop, felt, honey_Ns_per_m, w);
  refuse(text("at least %.2g", round_up(*smallest + handle)) + unit + ", the smallest that is stable " + grip,
         std::string("choose a larger ") + w.what + (wanted.empty() ? "" : ", or add " + wanted) +
             " (--force-unstable overrides, in simulation)");
}

}  // namespace

void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable) {
  require_stable(felt_mass_kg, hand, loop, force_unstable, of_mass);
}

void require_stable_inertia(double felt_inertia_kg_m2, const HandModel& hand, const LoopModel& loop,
                            bool force_unstable) {
  require_stable(felt_inertia_kg_m2, hand, loop, force_unstable, of_inertia);
}

}  // namespace proxarm::controller
