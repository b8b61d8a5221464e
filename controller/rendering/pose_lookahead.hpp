// Predicts where the proxy of a rigid tool will be. AdmittanceMotion sends the arm there, as with a point
// (lookahead.hpp).
//
//   c      the place that the reference point reaches within the horizon H if it coasts (h = 0) in an empty world, with
//          damping and spring
//   l      the point of the limits' sets for H that is nearest to c: speed, power, and the planes of borders
//   p(k)   = 𝒢(K, (l, R), (q, R)):   one step of 𝒢 for the whole of H, with the orientation R held
//
// One step of 𝒢 instead of one for each period, since a step costs microseconds. At a flat face both give the same
// place: the tool loses the speed v_n across the face, and μ v_n along it. A tool that would stick at the face is sent
// less far along the face: its way before the impact is missing. At p(k) the tool with orientation R is outside all
// objects. The commanded point brakes within the limits of acceleration (limits/sent_point.hpp), so after an impact at
// 0.4 m/s the arm goes on into the object by one or two millimetres.
//
// 𝒢 is a clone, since 𝒢 has memory. Where objects move, the clone takes the state of the original before each
// prediction; scripted objects go on for H, driven objects stay.
#pragma once

#include <memory>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/pose_proxy.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "models/surfaces/free_space.hpp"

namespace proxarm::controller {

class PoseLookahead {
 public:
  // `g`: 𝒢 of the proxy that is predicted. Precondition: `g` outlives this object.
  explicit PoseLookahead(const models::PoseAlgorithm& g) : of_proxy_(&g), g_(g.clone()), limits_(no_world_) {}

  PoseLookahead(const PoseLookahead&) = delete;  // limits_ refers to no_world_
  PoseLookahead& operator=(const PoseLookahead&) = delete;

  void set_friction(std::int32_t object, double friction) noexcept { g_->set_friction(object, friction); }

  // Returns p(k), W. Precondition: called after the proxy's step, which was made within `limits`. Returns q if the
  // predicted step fails. Nothing allocates, locks or throws.
  [[nodiscard]] models::Vec3 operator()(const PoseProxy& proxy, const StepLimits& limits, double horizon_s) noexcept;

 private:
  void make_limits(const StepLimits& limits, const models::Vec3& q_W, double reach_m, double steps) noexcept;

  const models::PoseAlgorithm* of_proxy_;
  std::unique_ptr<models::PoseAlgorithm> g_;
  models::FreeSpace<3> no_world_;
  LimitedAlgorithm<3> limits_;
  StepLimits ahead_;
};

}  // namespace proxarm::controller
