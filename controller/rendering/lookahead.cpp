#include "controller/rendering/lookahead.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

using models::Vec3;

namespace {

// H/T is a quotient of decimal numbers. A quotient that rounding makes slightly smaller than a whole number counts as
// this number.
constexpr double rounding_steps = 1e-9;

}  // namespace

template <int N>
Lookahead<N>::Lookahead(const scenes::Scene& scene, const AdmittanceConfig& config)
    : scene_(scenes::compile(scene)),
      changes_(scene_, config.period_s),
      limited_(scene_.algorithm<N>()),
      proxy_(config, limited_) {}

template <int N>
auto Lookahead<N>::operator()(const AdmittanceProxy<N>& proxy, const LimitedAlgorithm<N>& limited,
                              const SceneChanges& changes, const V& h, const StepLimits& limits, const Basis& basis,
                              double horizon_s) noexcept -> V {
  const double steps = std::min(horizon_s / proxy.config().period_s, static_cast<double>(most_steps));
  const int whole = static_cast<int>(std::floor(steps + rounding_steps));
  const double rest = std::max(0.0, steps - static_cast<double>(whole));
  const int count = rest > 0.0 ? whole + 1 : whole;
  if (count == 0) return proxy.q();
  proxy_.follow(proxy);
  limited_.follow(limited);
  changes_.follow(changes);
  double reach_m = 0.0;
  for (std::size_t i = 0; i < limits.hard_count; ++i) {
    if (limits.hard[i].limit == Limit::speed) reach_m = count * limits.hard[i].radius_m;
  }
  gather_limits(limits, reach_m);
  V before = proxy.q();
  for (int k = 1; k <= count; ++k) {
    before = proxy_.q();
    changes_.step();
    shift_limits(basis * (before - proxy.q()));
    limited_.set_limits(ahead_, basis, before);
    if (proxy_.step(h) != ProxyFault::none || limited_.squeezed()) return before;
  }
  return rest > 0.0 ? V(before + rest * (proxy_.q() - before)) : proxy_.q();
}

// Collects the limits that the prediction can reach. The bound of a border's plane falls by plane.share of the motion
// towards the plane.
template <int N>
void Lookahead<N>::gather_limits(const StepLimits& limits, double reach_m) noexcept {
  ahead_.soft_count = ahead_.hard_count = ahead_.plane_count = 0;
  double most_m = reach_m;  // the largest step
  for (std::size_t i = 0; i < limits.hard_count; ++i) {
    if (limits.hard[i].limit != Limit::speed) continue;
    ahead_.hard[ahead_.hard_count++] = limits.hard[i];
    most_m = limits.hard[i].radius_m;
  }
  for (std::size_t i = 0; i < limits.soft_count; ++i) {
    if (limits.soft[i].limit == Limit::power) ahead_.soft[ahead_.soft_count++] = limits.soft[i];
  }
  for (std::size_t i = 0; i < limits.plane_count; ++i) {
    const LimitPlane<3>& plane = limits.planes[i];
    if (plane.bound_m - plane.share * reach_m > most_m) continue;
    bounds_m_[ahead_.plane_count] = plane.bound_m;
    ahead_.planes[ahead_.plane_count++] = plane;
  }
}

template <int N>
void Lookahead<N>::shift_limits(const Vec3& way_W) noexcept {
  for (std::size_t i = 0; i < ahead_.plane_count; ++i) {
    LimitPlane<3>& plane = ahead_.planes[i];
    const double nearer_m = plane.share * plane.normal.dot(way_W);
    plane.bound_m = std::max(0.0, bounds_m_[i] - std::max(0.0, nearer_m));
  }
}

template class Lookahead<1>;
template class Lookahead<2>;
template class Lookahead<3>;

}  // namespace proxarm::controller
