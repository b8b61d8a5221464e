// Where the proxy is going to be: a copy of its state, stepped on through a 𝒢 of its own under the force held.
//
//   q(k+1|k), q(k+2|k), …   each by the proxy's own method, (26) or order 2, with h(k)
//   p(k) = the point a horizon H after q(k); between two steps by the straight line
//
// In free flight under a constant force p = q + Hv + ½H²a to rounding at order 1. In contact p is a point of the same
// world: it doesn't lie in a flat wall, it sticks where the proxy will stick, and it leaves where the proxy will leave.
// Objects that move are where they will be then: the time of each step is its own, and objects that are driven, or
// whose friction changes, go on as they would (scene_changes.hpp).
//
// Of the step's limits the prediction keeps those that can matter within H: speed and power, and the planes that the
// proxy can reach. A border's plane falls behind as the prediction nears it, so that it slows down as the proxy will.
// Acceleration and leash are limits of what is commanded, and are kept there (controller/limits/sent_point.hpp).
//
// The scene is compiled a second time, since a 𝒢 remembers. Nothing here is state: the next cycle begins anew. Neither
// allocates, locks nor throws after construction.
#pragma once

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "controller/rendering/scene_changes.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

template <int N>
class Lookahead {
 public:
  using V = models::Vec<N>;
  using Basis = Eigen::Matrix<double, 3, N>;

  // More steps than the longest horizon has at the shortest timestep would cost more than a cycle; beyond, the horizon
  // is cut.
  static constexpr int most_steps = 200;

  Lookahead(const scenes::Scene& scene, const AdmittanceConfig& config);

  // After the proxy's step under h within `limits`. Where a step ahead fails, the point before it.
  V operator()(const AdmittanceProxy<N>& proxy, const SceneChanges& changes, const V& h, const StepLimits& limits,
               const Basis& basis, double horizon_s) noexcept;

 private:
  void gather_limits(const StepLimits& limits, double reach_m) noexcept;
  void shift_limits(const StepLimits& limits, const models::Vec3& way_W) noexcept;

  scenes::CompiledScene scene_;
  SceneChanges changes_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  StepLimits ahead_;                                      // of the step that is predicted
  std::array<std::size_t, StepLimits::max_planes> of_{};  // which of the proxy's planes each of its planes is
};

extern template class Lookahead<1>;
extern template class Lookahead<2>;
extern template class Lookahead<3>;

}  // namespace proxarm::controller
