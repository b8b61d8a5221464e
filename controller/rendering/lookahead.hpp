// Predicts the proxy's motion: moves a copy of the proxy through a second 𝒢, under a given force h. AdmittanceMotion
// sends the arm to the result. It uses h = 0, so the predicted proxy coasts (admittance_motion.cpp explains why).
//
//   q(k+1|k), q(k+2|k), …   predicted steps under h, by the proxy's method: (26) or order 2
//   p(k)                    the predicted place a horizon H after q(k), linearly interpolated between two steps
//
// In free motion at order 1, p = q + Hv + ½H(H + T)a to rounding, where v is the mean velocity of the last step and
// a = h/M. If the proxy coasts without damping and spring, p is on a straight line. In contact, p keeps the proxy's
// world: it isn't inside a flat wall, and it sticks or leaves like the proxy under h. Moving objects are predicted,
// too: each step has its own time, and driven objects and changing frictions continue (scene_changes.hpp).
//
// The prediction keeps the limits that can matter within H: speed, power and the planes that it can reach. The bound of
// a border's plane falls as the prediction approaches the plane, so the prediction slows down like the proxy.
// Acceleration and leash apply to the commanded point (controller/limits/sent_point.hpp).
//
// The scene is compiled a second time, since a 𝒢 has memory. The prediction begins anew in each cycle. Nothing
// allocates, locks or throws after construction.
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

  // Largest number of predicted steps; longer horizons are shortened. The prediction for the longest horizon at
  // the shortest timestep would take more than a cycle.
  static constexpr int most_steps = 200;

  Lookahead(const scenes::Scene& scene, const AdmittanceConfig& config);

  // Returns p(k). `h`: force during the prediction. Precondition: called after the proxy's step, which was made within
  // `limits`. If a predicted step fails, returns the point before this step.
  V operator()(const AdmittanceProxy<N>& proxy, const LimitedAlgorithm<N>& limited, const SceneChanges& changes,
               const V& h, const StepLimits& limits, const Basis& basis, double horizon_s) noexcept;

 private:
  void gather_limits(const StepLimits& limits, double reach_m) noexcept;
  void shift_limits(const models::Vec3& way_W) noexcept;

  scenes::CompiledScene scene_;
  SceneChanges changes_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  StepLimits ahead_;                                       // limits of the predicted step
  std::array<double, StepLimits::max_planes> bounds_m_{};  // bounds of the planes in ahead_ before the prediction
};

extern template class Lookahead<1>;
extern template class Lookahead<2>;
extern template class Lookahead<3>;

}  // namespace proxarm::controller
