// The hand's wrench as it acts on the proxy, and whether a hand can have made it.
//
// Whether it is a hand's is asked of the wrench without the tool's inertia (handle/hand_force.hpp).
//
// After a start the wrench is let in over `ramp_in_s`. If nobody holds the handle, a braking force acts instead
// (handle/empty_handle.hpp). Forces that don't fit the motion that followed raise faults
// (handle/force_plausibility.hpp). Neither allocates, locks nor throws after construction.
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

// The proxy's last step, as the judge of the hand sees it.
struct ProxyMotion {
  models::Vec3 q_W = models::Vec3::Zero(), v_W = models::Vec3::Zero();
  double mass_kg = 0.0, damping_Ns_per_m = 0.0;
  bool touches = false;
  bool limited = false;                                  // by the tool's speed
  models::Vec3 braking_torque_W = models::Vec3::Zero();  // that would bring its turning to rest
};

// The hand's wrench beside the noise that the tare found, for a proxy or a device of this velocity and mass.
// Precondition: `hand_W` and `v_W` outlive the result.
[[nodiscard]] HandSigns hand_signs(const models::Wrench& hand_W, const SensorBias& bias, const models::Vec3& v_W,
                                   double mass_kg, bool at_handle) noexcept;

struct HandJudgeConfig {
  HeldTool tool;
  double lever_m = 0.0;      // a torque counts as the force that makes it at this lever; 0: the orientation is held
  double lag_s = 0.0;        // from the proxy to the steel
  bool always_held = false;  // by a hand or a load: no force is taken for a bias
};

class HandJudge {
 public:
  HandJudge(const description::SupervisionDescription& supervision, const HandJudgeConfig& config, double period_s);

  // `lag_s` as in HandJudgeConfig.
  void set_period(double period_s, double lag_s) noexcept;
  void set_tool(const HeldTool& tool) noexcept;
  void start() noexcept;
  // The wrench that acts in this cycle; raises faults and notes flags in it.
  [[nodiscard]] models::Wrench step(const MotionCycle& cycle, const ProxyMotion& proxy) noexcept;

  // As Motion has them.
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
  double share_ = 1.0;  // of the hand's wrench that is let in
  HandForce hand_;
  std::optional<EmptyHandle> empty_;  // nullopt: the proxy coasts
  ReversedForce reversed_;
  StraightForce straight_;
};

}  // namespace proxarm::controller
