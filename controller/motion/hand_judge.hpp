// Computes the hand's wrench on the proxy, and checks whether a hand can have made this wrench.
//
// The check uses the wrench without the tool's inertia (handle/hand_force.hpp). After a start the wrench on the proxy
// rises from zero over ramp_in_s. If nobody holds the handle, a braking force replaces the hand's wrench
// (handle/empty_handle.hpp). Forces that a hand can't have made, by the motion that follows them, raise faults
// (handle/force_plausibility.hpp). Nothing allocates, locks or throws after construction.
#pragma once

#include <optional>

#include "controller/handle/empty_handle.hpp"
#include "controller/handle/force_plausibility.hpp"
#include "controller/handle/hand_force.hpp"
#include "controller/motion/motion.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/supervision.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct ProxyMotion {
  models::Vec3 q_W = models::Vec3::Zero(), v_W = models::Vec3::Zero();
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;
  bool touches = false;
  bool limited = false;                                  // the tool's speed limit held the proxy back
  models::Vec3 braking_torque_W = models::Vec3::Zero();  // brings the tool's turning to rest
};

// Returns the signs of a hand for EmptyHandle: the hand's wrench, the tare's noise, and the velocity and mass of the
// proxy or device. Precondition: `hand_W` and `v_W` outlive the result.
[[nodiscard]] HandSigns hand_signs(const models::Wrench& hand_W, const SensorBias& bias, const models::Vec3& v_W,
                                   double mass_kg, bool at_handle) noexcept;

struct HandJudgeConfig {
  HeldTool tool;
  double lever_m = 0.0;      // lever that converts a torque to a force; 0: torques don't count
  double lag_s = 0.0;        // delay from the proxy to the real arm
  bool always_held = false;  // a hand or a load always holds the handle, so no force counts as a bias
};

class HandJudge {
 public:
  HandJudge(const description::SupervisionDescription& supervision, const HandJudgeConfig& config, double period_s);

  void set_period(double period_s, double lag_s) noexcept;
  void set_tool(const HeldTool& tool) noexcept;
  void start() noexcept;
  // Returns the wrench on the proxy in this cycle. Raises faults and sets flags in `cycle`.
  [[nodiscard]] models::Wrench step(const MotionCycle& cycle, const ProxyMotion& proxy) noexcept;

  // See Motion.
  [[nodiscard]] const models::Wrench* resting_wrench_W() const noexcept {
    return empty_ && empty_->rests() ? &empty_->wrench_W() : nullptr;
  }
  [[nodiscard]] bool wants_hold() const noexcept {
    return supervision_.let_go == description::LetGo::hold && empty_ && empty_->empty();
  }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  void let_in(CycleRecord& record) noexcept;
  void judge(const MotionCycle& cycle, const ProxyMotion& proxy, bool empty) noexcept;

  description::SupervisionDescription supervision_;
  double period_s_;
  bool always_held_;
  double share_ = 1.0;  // share of the hand's wrench that acts on the proxy; rises during the ramp-in
  HandForce hand_;
  std::optional<EmptyHandle> empty_;  // nullopt: the proxy isn't braked when nobody holds the handle
  ReversedForce reversed_;
  StraightForce straight_;
};

}  // namespace proxarm::controller
