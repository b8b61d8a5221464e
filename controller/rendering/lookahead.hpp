// Predicts where the proxy is going to be: a copy of its state is stepped on through a 𝒢 of its own, under a force h
// that the caller chooses. AdmittanceMotion, which sends the arm there, passes h = 0: the proxy coasts, whatever the
// hand does meanwhile (admittance_motion.cpp says why).
//
//   q(k+1|k), q(k+2|k), …   each by the proxy's own method, (26) or order 2, with this h
//   p(k)                    the point a horizon H after q(k), linearly interpolated between two steps
//
// In free motion at order 1, p = q + Hv + ½H(H + T)a to rounding, with v the mean velocity of the last step and a =
// h/M: a straight line if the proxy coasts, without damping and spring. In contact, p is a point of the same world: it
// isn't inside of a flat wall, and it sticks or leaves where the proxy would under h. Moving objects are predicted,
// too: each step has its own time, and objects that are driven, or whose friction changes, go on as they would
// (scene_changes.hpp).
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

  // `h`: the force during the prediction, whatever the proxy's own step was made with. Precondition: called after that
  // step, which was made within `limits`. If a step of the prediction fails, returns the point before it.
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
  std::array<double, StepLimits::max_planes> bounds_m_{};  // of its planes, for the proxy's own step
};

extern template class Lookahead<1>;
extern template class Lookahead<2>;
extern template class Lookahead<3>;

}  // namespace proxarm::controller
