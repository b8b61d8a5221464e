// Predicts where the proxy is going to be: a copy of its state is stepped on through a 𝒢 of its own, with the force
// held.
//
//   q(k+1|k), q(k+2|k), …   each by the proxy's own method, (26) or order 2, with h(k)
//   p(k)                    the point a horizon H after q(k), linearly interpolated between two steps
//
// At order 1, p = q + Hv + ½H²a to rounding in free motion under a constant force. In contact, p is a point of the same
// world: it isn't inside of a flat wall, it sticks where the proxy will stick, and it leaves where the proxy will
// leave. Moving objects are predicted, too: each step has its own time, and objects that are driven, or whose friction
// changes, go on as they would (scene_changes.hpp).
//
// Of the step's limits, the prediction keeps those that can matter within H: speed, power, and the planes that the
// proxy can reach. The bound of a border's plane falls as the prediction approaches it, so the prediction slows down as
// the proxy will. Acceleration and leash limit what is commanded and are kept there (controller/limits/sent_point.hpp).
//
// The scene is compiled a second time, since a 𝒢 has memory. The prediction itself has none and begins anew in each
// cycle. Neither allocates, locks nor throws after construction.
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

  // The bound on the number of steps: more than the longest horizon has at the shortest timestep would cost more than a
  // cycle. Longer horizons are cut.
  static constexpr int most_steps = 200;

  Lookahead(const scenes::Scene& scene, const AdmittanceConfig& config);

  // Precondition: called after the proxy's step under h within `limits`. If a step of the prediction fails, returns the
  // point before it.
  V operator()(const AdmittanceProxy<N>& proxy, const SceneChanges& changes, const V& h, const StepLimits& limits,
               const Basis& basis, double horizon_s) noexcept;

 private:
  void gather_limits(const StepLimits& limits, double reach_m) noexcept;
  void shift_limits(const StepLimits& limits, const models::Vec3& way_W) noexcept;

  scenes::CompiledScene scene_;
  SceneChanges changes_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  StepLimits ahead_;                                      // of the predicted step
  std::array<std::size_t, StepLimits::max_planes> of_{};  // for each of these planes, the index of the proxy's plane
};

extern template class Lookahead<1>;
extern template class Lookahead<2>;
extern template class Lookahead<3>;

}  // namespace proxarm::controller
