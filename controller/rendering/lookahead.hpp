// Predicts the proxy's motion: steps a copy of its state through a second 𝒢, under a given force h. AdmittanceMotion,
// which sends the arm to the result, uses h = 0: the proxy coasts (admittance_motion.cpp explains why).
//
//   q(k+1|k), q(k+2|k), …   each by the proxy's own method, (26) or order 2, with this h
//   p(k)                    the point a horizon H after q(k), linearly interpolated between two steps
//
// In free motion at order 1, p = q + Hv + ½H(H + T)a to rounding, with v the mean velocity of the last step and a =
// h/M: a straight line if the proxy coasts without damping and spring. In contact, p is a point of the same world: it
// isn't inside a flat wall, and it sticks or leaves like the proxy under h. Moving objects are predicted, too: each
// step has its own time, and driven objects and changing frictions continue (scene_changes.hpp).
//
// The prediction keeps the limits that can matter within H: speed, power and the planes within reach. The bound of a
// border's plane falls as the prediction approaches it, so the prediction slows down like the proxy. Acceleration and
// leash apply to the commanded point, see controller/limits/sent_point.hpp.
//
// The scene is compiled a second time, since a 𝒢 has memory; the prediction has none and begins anew in each cycle. No
// allocation, lock or throw after construction.
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

  // Largest number of steps; longer horizons are cut. The longest horizon at the shortest timestep would take more than
  // a cycle.
  static constexpr int most_steps = 200;

  Lookahead(const scenes::Scene& scene, const AdmittanceConfig& config);

  // `h`: force during the prediction. Precondition: called after the proxy's step, which was made within `limits`. If a
  // predicted step fails, returns the point before it.
  V operator()(const AdmittanceProxy<N>& proxy, const SceneChanges& changes, const V& h, const StepLimits& limits,
               const Basis& basis, double horizon_s) noexcept;

 private:
  void gather_limits(const StepLimits& limits, double reach_m) noexcept;
  void shift_limits(const models::Vec3& way_W) noexcept;

  scenes::CompiledScene scene_;
  SceneChanges changes_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  StepLimits ahead_;                                       // of the predicted step
  std::array<double, StepLimits::max_planes> bounds_m_{};  // of its planes, in the proxy's own step
};

extern template class Lookahead<1>;
extern template class Lookahead<2>;
extern template class Lookahead<3>;

}  // namespace proxarm::controller
