// Makes the motion of the admittance type: the hand's force moves a proxy, and the arm follows the proxy.
//
//   hand's wrench ─▶ proxy (26) in the scene, within what the arm can follow ─▶ step of the arm ─▶ elastic gears ─▶
//   (hand_judge.hpp)  (rendering/)            (arm_step/)                       (arm_step.hpp)   (elastic_setpoint.hpp)
//   ─▶ final setpoints
//   (final_setpoints.hpp)
//
// The limits of a step contain only places that the arm can reach, so the arm is sent to the proxy's place. With
// lookahead the arm is sent to the proxy's predicted place (sent_point.hpp). A second arm step then keeps the proxy at
// places that the arm could reach if it were sent to the proxy. Records and reports describe the proxy.
//
// If a drive doesn't follow or a guard holds a setpoint back, the motion continues from the commanded setpoints
// (go_on_from_setpoints()). It doesn't catch up with the wanted setpoints later.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "controller/arm_step/arm_step.hpp"
#include "controller/limits/limits_work.hpp"
#include "controller/limits/sent_point.hpp"
#include "controller/limits/step_limits.hpp"
#include "controller/motion/final_setpoints.hpp"
#include "controller/motion/hand_judge.hpp"
#include "controller/motion/motion.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/setpoints/gear_damping.hpp"
#include "controller/setpoints/link_filter.hpp"
#include "controller/stability/passivity.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

class AdmittanceMotion final : public Motion {
 public:
  // Precondition: `arm` outlives this object.
  AdmittanceMotion(AdmittanceParts parts, const models::Arm& arm, std::vector<description::DriveDescription> drives,
                   const description::CellLimits& limits, const description::SupervisionDescription& supervision,
                   const SessionSettings& settings, const HeldTool& tool = {});

  void wait_for_drives(const Measured& measured) noexcept override { final_.start(measured.drive_target_rad); }
  void stand(const Measured& measured) noexcept override;
  bool render(const MotionCycle& cycle) noexcept override;
  bool free(const MotionCycle& cycle) noexcept override;
  void run_out() noexcept override { active_.add(final_.run_out()); }

  void start(const Measured& measured, Beginning beginning) noexcept override;
  void start_run_out() noexcept override { final_.start_run_out(); }
  bool prepare_freeing(const Command& command, const Measured& measured) noexcept override;
  bool start_yielding(const Measured& measured) noexcept override;
  void set(const Change& change) noexcept override;
  void hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept override;
  void carry(const HeldTool& tool, const models::ToolInertia& behind) noexcept override;
  void set_period(double period_s) noexcept override;

  [[nodiscard]] Setpoints setpoints() const noexcept override {
    return {Setpoints::Kind::angles_rad, final_.target_rad()};
  }
  [[nodiscard]] bool can_hold() const noexcept override { return true; }
  [[nodiscard]] bool stands() const noexcept override { return final_.has_run_out(); }
  [[nodiscard]] bool backs_off() const noexcept override { return parts_.release->backs_off(); }
  [[nodiscard]] const models::Wrench* resting_wrench_W() const noexcept override { return hand_.resting_wrench_W(); }
  [[nodiscard]] std::optional<MissingWeight> missing_weight() const noexcept override;
  [[nodiscard]] bool wants_hold() const noexcept override { return hand_.wants_hold(); }
  [[nodiscard]] const models::Vec3& proxy_W() const noexcept override { return state_.q_k1_W; }
  [[nodiscard]] Eigen::Quaterniond proxy_R_WT() const noexcept override { return tool().R_WT(); }
  [[nodiscard]] const MotionWork* work() const noexcept override { return &work_; }

  void archive(fieldbus::StateArchive& state) noexcept override;

 private:
  // The state that isn't contained in proxy, arm step, filter or setpoints.
  struct State {
    models::Vec3 q_k1_W = models::Vec3::Zero();         // the proxy's place after the last cycle
    models::Vec3 q_k2_W = models::Vec3::Zero();         // the proxy's place one cycle before q_k1_W
    double speed_limit_m_per_s = 0.0;                   // present speed limit of the tool
    models::Vec3 last_normal_W = models::Vec3::Zero();  // normal of the last contact; zero: none yet
    double mass_kg = 0.0, damping_Ns_per_m = 0.0;       // the proxy's, in its last step
    bool touches = false;                               // the proxy's last step ended in contact
    bool limited = false;                               // the tool's speed limit acted in the proxy's last step
    bool freeing = false;                               // release, back-off or yield: the tool moves without the scene
  };
  // For lookahead: the commanded point, and an arm step and filter as if the arm were sent to the proxy.
  struct Ahead {
    SentPoint point;
    ArmStep proxy_step;
    LinkFilter proxy_filter;
    StepLimits limits;  // around the commanded point
  };

  // The moving tool: a point without a scene while the tool is being freed, else the tool in the scene.
  [[nodiscard]] RenderedTool& tool() const noexcept {
    if (state_.freeing) return parts_.release->tool();
    return *parts_.tool;
  }
  [[nodiscard]] ProxyMotion proxy_motion() const noexcept;
  void make_limits(const MotionCycle& cycle) noexcept;
  [[nodiscard]] ArmStepStart arm_start(const LinkFilter& filter, const models::JointVector& twist_rad) noexcept;
  void limit_speed(const MotionCycle& cycle) noexcept;
  [[nodiscard]] bool take(const WorldStep& step, const MotionCycle& cycle) noexcept;
  [[nodiscard]] bool follow_proxy(const MotionCycle& cycle) noexcept;
  void judge_limits(const WorldStep& step, const models::Vec3& from_W, const MotionCycle& cycle) noexcept;
  bool go(ArmStep& step, const models::Vec3& q_W, const MotionCycle& cycle) noexcept;
  void put_proxy_where(const ArmStep& step) noexcept;
  void put_proxy_to(const models::Vec3& q_W, const models::Vec3& velocity_W) noexcept;
  void turn_on_from(const ArmStep& step, const Eigen::Quaterniond& from) noexcept;
  [[nodiscard]] TurnSets turn_limits() const noexcept;
  void send(const Measured& measured) noexcept;
  void go_on_from_setpoints(std::uint8_t blocked) noexcept;
  [[nodiscard]] double most_turning_rad_per_s() const noexcept;
  [[nodiscard]] double turned_away_m(const Measured& measured) const noexcept;
  [[nodiscard]] models::Vec3 moving_force_W(const models::Vec3& force_W) const noexcept;
  // The present horizon of the lookahead; 0 while the tool is being freed, since nobody feels a mass then.
  [[nodiscard]] double ahead_s() const noexcept { return state_.freeing ? 0.0 : ahead_->point.horizon_s(); }
  void count_work(const WorldStep& step) noexcept;
  void observe_hand(const Measured& measured) noexcept;
  [[nodiscard]] double gyration_m2() const noexcept;
  void observe_proxy(const WorldStep& step) noexcept;
  void record_passivity(const WorldStep& step, CycleRecord& record) noexcept;

  AdmittanceParts parts_;
  const models::Arm& arm_;
  description::CellLimits limits_;
  description::SupervisionDescription supervision_;
  double period_s_, tool_mass_kg_;
  // drives_lag_s_: delay of setpoint filter and slowest drive. horizon_s_: horizon of the lookahead.
  double drives_lag_s_, horizon_s_;
  models::Mat3 R_TS_;                           // orientation of the sensor in the tool
  std::optional<PassivityObserver> passivity_;  // nullopt: switched off
  HandJudge hand_;
  StepLimiter limiter_;
  ArmStep arm_step_;  // makes the commanded angles
  std::unique_ptr<Ahead> ahead_;
  std::optional<GearDamping> gear_damping_;  // nullopt: no gear torque is measured, or damping is off
  FinalSetpoints final_;
  LimitsWork limits_work_;
  StepLimits step_limits_;  // limits of this cycle's step, around the proxy
  State state_;
  MotionWork work_;
};

}  // namespace proxarm::controller
