// Motion of the admittance type: the hand's force moves a proxy, and the arm's motors follow it.
//
//   force ─▶ proxy (26) in the scene, within limits ─▶ inverse kinematics ─▶ elastic gears ─▶ guards ─▶ setpoints
//             ▲                                                                                  │
//             └────────── wind_back(): from what was commanded, where it couldn't be followed ───┘
//
// With lookahead, inverse kinematics gets a predicted position of the proxy instead of the present one
// (sent_point.hpp). Records and reports still tell of the proxy itself.
//
// Each of these stages has a history of its own. Only this class starts them, winds them back and changes their T, and
// it does so to all of them together. make_final() is the one place where setpoints become final.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "controller/handle/empty_handle.hpp"
#include "controller/handle/force_plausibility.hpp"
#include "controller/limits/joint_limits.hpp"
#include "controller/limits/sent_point.hpp"
#include "controller/limits/step_limits.hpp"
#include "controller/motion/motion.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/setpoints/joint_guard.hpp"
#include "controller/setpoints/setpoint_envelope.hpp"
#include "controller/setpoints/tool_guard.hpp"
#include "controller/stability/passivity.hpp"
#include "models/arm/inverse_kinematics.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

class AdmittanceMotion final : public Motion {
 public:
  // `arm` must outlive this.
  AdmittanceMotion(AdmittanceParts parts, const models::Arm& arm, std::vector<description::DriveDescription> drives,
                   const description::CellLimits& limits, const description::SupervisionDescription& supervision,
                   const SessionSettings& settings, double tool_mass_kg = 0.0);

  void wait_for_drives(const Measured& measured) noexcept override { start_guards(measured.drive_target_rad); }
  void stand(const Measured& /*measured*/) noexcept override {}
  bool render(const MotionCycle& cycle) noexcept override;
  bool free(const MotionCycle& cycle) noexcept override;
  void run_out() noexcept override;

  void start(const Measured& measured, Beginning beginning) noexcept override;
  void start_run_out() noexcept override;
  bool prepare_freeing(const Command& command, const Measured& measured) noexcept override;
  bool start_yielding(const Measured& measured) noexcept override;
  void set(const Change& change) noexcept override;
  void set_period(double period_s) noexcept override;

  [[nodiscard]] Setpoints setpoints() const noexcept override {
    return {Setpoints::Kind::angles_rad, guard_.target_rad()};
  }
  [[nodiscard]] bool can_hold() const noexcept override { return true; }
  [[nodiscard]] bool stands() const noexcept override { return state_.run_out_share <= 0.0 && guard_.at_rest(); }
  [[nodiscard]] bool backs_off() const noexcept override { return parts_.release->backs_off(); }
  [[nodiscard]] const models::Wrench* resting_wrench_W() const noexcept override {
    return empty_handle_ && empty_handle_->rests() ? &empty_handle_->wrench_W() : nullptr;
  }
  [[nodiscard]] bool wants_hold() const noexcept override {
    return supervision_.let_go == description::LetGo::hold && empty_handle_ && empty_handle_->empty();
  }
  [[nodiscard]] const models::Vec3& proxy_W() const noexcept override { return state_.q_k1_W; }
  [[nodiscard]] Eigen::Quaterniond proxy_R_WT() const noexcept override {
    return parts_.pose != nullptr ? parts_.pose->orientation() : parts_.orientation.R_WT();
  }
  [[nodiscard]] const MotionWork* work() const noexcept override { return &work_; }

  void archive(fieldbus::StateArchive& state) noexcept override;

 private:
  // What lasts from cycle to cycle. The histories of proxy, filter and guards are in their own objects.
  struct State {
    models::Vec3 q_k1_W = models::Vec3::Zero();         // the proxy of the last cycle
    models::Vec3 q_k2_W = models::Vec3::Zero();         // and of the one before
    models::JointVector link_rad;                       // of the links, for q_k1; inverse kinematics starts from here
    models::JointVector link_step_rad;                  // the links' last step
    models::JointVector run_out_rad_per_s;              // each joint's speed when the run-out began
    double run_out_share = 1.0;                         // the share of that speed that is left
    double run_out_per_cycle = 1.0;                     // by which the share shrinks in each cycle
    double force_share = 1.0;                           // the share of the hand's force that is let in
    double speed_limit_m_per_s = 0.0;                   // the tool's present speed limit
    models::Vec3 last_normal_W = models::Vec3::Zero();  // the normal of the last contact; zero: there was none
    double mass_kg = 0.0, damping_Ns_per_m = 0.0;       // those of the proxy's last step
    bool touches = false;                               // the proxy's last step ended in contact
    bool turns_less = false;                            // joints couldn't turn the tool as its proxy turns
    bool freeing = false;                               // the tool is being freed: it moves without the scene
  };

  // Null while the tool is freed, which is without the scene.
  [[nodiscard]] PoseWorld* pose() noexcept { return state_.freeing ? nullptr : parts_.pose; }
  [[nodiscard]] ProxyFault turn(const models::Vec3& torque_W) noexcept;
  [[nodiscard]] RenderedWorld& world() noexcept { return state_.freeing ? parts_.release->world() : *parts_.world; }
  void make_limits(const MotionCycle& cycle) noexcept;
  void make_sent_limits(StepStart start) noexcept;
  void send_ahead() noexcept;
  [[nodiscard]] const models::Vec3& sent_W() const noexcept { return sent_ ? sent_->c_k1_W() : state_.q_k1_W; }
  // The horizon that is looked ahead; zero while the arm is freed, since nobody feels a mass then.
  [[nodiscard]] double ahead_s() const noexcept { return state_.freeing ? 0.0 : sent_->horizon_s(); }
  [[nodiscard]] double most_turning_rad_per_s() const noexcept;
  [[nodiscard]] double turned_away_m(const Measured& measured) const noexcept;
  [[nodiscard]] bool turn_less(const models::JointVector& link_k1_rad, const models::Pose& X_WT) noexcept;
  [[nodiscard]] models::JointVector braking_step(const models::JointVector& most_change) const noexcept;
  [[nodiscard]] models::StepRoom step_room(double acceleration_share) const noexcept;
  [[nodiscard]] models::JointVector most_change() const noexcept;
  void tell_limits(const models::StepRoom& room, const models::JointVector& step_rad) noexcept;
  void turn_on_from(const models::Mat3& reached_k1) noexcept;
  void go_on_from(const models::Vec3& c_W, const models::Vec3& velocity_W) noexcept;
  void limit_speed(const MotionCycle& cycle) noexcept;
  void let_force_in(CycleRecord& record) noexcept;
  [[nodiscard]] models::Wrench acting_wrench_W(const MotionCycle& cycle) noexcept;
  void judge_force(const MotionCycle& cycle, const models::Vec3& v_W, bool empty) noexcept;
  [[nodiscard]] models::Vec3 moving_force_W(const models::Vec3& force_W) const noexcept;
  void advance_proxy(const models::Vec3& q_W) noexcept;
  void count_work(const WorldStep& step) noexcept;
  void observe_hand(const Measured& measured) noexcept;
  [[nodiscard]] double gyration_m2() const noexcept;
  void observe_proxy(const WorldStep& step) noexcept;
  void record_passivity(const WorldStep& step, CycleRecord& record) noexcept;
  void follow_proxy(const MotionCycle& cycle) noexcept;
  void shorten_step(const models::JointVector& link_k1_rad, const models::Vec3& reached_k1_W) noexcept;
  void move_motors(const models::JointVector& motor_rad, const Measured& measured) noexcept;
  std::uint8_t find_blocked(const models::JointVector& motor_rad, const Measured& measured,
                            models::JointVector& wanted_rad) noexcept;
  bool make_final(const models::JointVector& wanted_rad, double max_speed_m_per_s) noexcept;
  void follow_setpoints(const Measured& measured, std::uint8_t blocked) noexcept;
  void start_guards(const models::JointVector& target_rad) noexcept;
  void wind_back(std::uint8_t blocked) noexcept;

  AdmittanceParts parts_;
  const models::Arm& arm_;
  std::vector<description::DriveDescription> drives_;
  description::CellLimits limits_;
  description::SupervisionDescription supervision_;
  double period_s_, tool_mass_kg_;
  models::Mat3 R_TS_;                           // of the sensor in the tool
  std::optional<PassivityObserver> passivity_;  // nullopt: not wanted
  std::optional<EmptyHandle> empty_handle_;     // nullopt: the proxy coasts
  ReversedForce reversed_;
  StraightForce straight_;
  StepLimiter limiter_;
  JointLimits joint_limits_;
  std::optional<SentPoint> sent_;  // nullopt: the arm is sent to the proxy itself
  JointGuard guard_;
  ToolGuard tool_guard_;
  SetpointEnvelope envelope_;  // of the setpoints; a blocked joint's is frozen
  State state_;
  MotionWork work_;

  // The values of this cycle:
  StepLimits step_limits_;
  StepLimits sent_limits_;                    // around the point that the arm is sent to (with lookahead)
  models::InverseKinematicsResult solution_;  // for the pose that the arm is sent to
};

}  // namespace proxarm::controller
