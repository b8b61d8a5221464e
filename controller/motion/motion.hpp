// Makes the setpoints of the drives and owns the setpoints' history. Motion alone starts, moves, stops and rewinds
// everything between the hand's force and the setpoints. It doesn't use a bus.
//
//   AdmittanceMotion   Makes motor angles from the hand's force: the proxy (26), limits, inverse kinematics, elastic
//                      gears, guards of joints and tool.
//   TorqueMotion       Makes joint torques from the tool's position: (23).
//
// In each cycle, after begin_cycle(), the caller calls the function of "each cycle" that belongs to the session's
// phase. If the phase changes before the setpoints are made, the caller then calls the new phase's function. The caller
// calls functions of "between" at the start of a phase or on request. All functions are noexcept; no function
// allocates, locks or prints.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/motion/motion_work.hpp"
#include "controller/motion/setpoints.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/rendering/change.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/command.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

struct MotionCycle {
  const Measured& measured;
  bool slowed = false;  // the reaction `slow` limits the tool's speed
  Alarm& alarm;
  CycleRecord& record;
};

enum class Beginning : std::uint8_t {
  first,     // rendering begins after the tare
  resuming,  // rendering continues after a hold; a tool that is inside an object leaves it slowly
  freeing,   // after a hold, the tool moves without the scene
};

// A joint that needs another torque to hold the arm than the model's weight gives.
struct MissingWeight {
  std::int32_t joint;
  double torque_Nm, limit_Nm;
};

class Motion {
 public:
  Motion() = default;
  Motion(const Motion&) = delete;
  Motion& operator=(const Motion&) = delete;
  virtual ~Motion() = default;

  // ---- each cycle
  void begin_cycle() noexcept {
    active_ = {};
    made_setpoints_ = false;
  }
  // One cycle while drives are being enabled. Drives that already take setpoints stay in place until all drives do.
  virtual void wait_for_drives(const Measured& measured) noexcept = 0;
  // One cycle of the tare: the drives are enabled, and the arm stands.
  virtual void stand(const Measured& measured) noexcept = 0;
  // One step of rendering. Returns true if the world has advanced by a period.
  virtual bool render(const MotionCycle& cycle) noexcept = 0;
  // One step of slow motion without the scene. Returns true when the motion has ended.
  virtual bool free(const MotionCycle& cycle) noexcept = 0;
  // One step of braking: all joints slow down in proportion to their last speeds.
  virtual void run_out() noexcept = 0;

  // ---- between
  // Prepares render() or free(). Precondition: the arm is at rest at the last setpoints.
  virtual void start(const Measured& measured, Beginning beginning) noexcept = 0;
  virtual void start_run_out() noexcept = 0;
  // Prepares free() after the order release or back_off. Returns false if the direction of the back-off is unknown.
  virtual bool prepare_freeing(const Command& command, const Measured& measured) noexcept = 0;
  // Prepares free() to back off along the force on the tool. Precondition: the arm stands. Returns false if this force
  // is small.
  virtual bool start_yielding(const Measured& /*measured*/) noexcept { return false; }
  virtual void set(const Change& change) noexcept = 0;
  // Sets, at once, the mass of the proxy and the inertia of the tool behind the sensor. The hand feels both
  // (tool_change.hpp).
  virtual void hang(double /*proxy_mass_kg*/, const models::ToolInertia& /*behind*/) noexcept {}
  // Sets the figures of the tool behind the sensor for the models of arm and hand. Call in each cycle in which these
  // figures change.
  virtual void carry(const HeldTool& /*tool*/, const models::ToolInertia& /*behind*/) noexcept {}
  // Sets the period of the following cycles. Precondition: the arm stands. Setpoints and proxy don't change.
  virtual void set_period(double period_s) noexcept = 0;

  // ---- asked
  [[nodiscard]] virtual Setpoints setpoints() const noexcept = 0;
  // Whether the arm can stand with enabled drives. Holds and all orders within a hold need this.
  [[nodiscard]] virtual bool can_hold() const noexcept = 0;
  // Whether the run-out has ended and the arm is at rest.
  [[nodiscard]] virtual bool stands() const noexcept = 0;
  [[nodiscard]] virtual bool backs_off() const noexcept = 0;
  // The hand's wrench while nobody holds the handle and the proxy is at rest; this wrench is then the sensor's bias.
  // Null if somebody may be holding the handle, or if the proxy moves.
  [[nodiscard]] virtual const models::Wrench* resting_wrench_W() const noexcept { return nullptr; }
  // The weight that is missing from the arm's model, if it exceeds its limit. With torques, the limit is the largest
  // weight that may be compensated. With gear damping, a gear's torque reading with the wrong sign exceeds the limit.
  // Precondition: the tare is complete.
  [[nodiscard]] virtual std::optional<MissingWeight> missing_weight() const noexcept { return {}; }
  // Whether nobody holds the handle and the cell demands a hold in this case (let_go: hold).
  [[nodiscard]] virtual bool wants_hold() const noexcept { return false; }
  [[nodiscard]] virtual const models::Vec3& proxy_W() const noexcept = 0;
  [[nodiscard]] virtual Eigen::Quaterniond proxy_R_WT() const noexcept { return Eigen::Quaterniond::Identity(); }
  // Limits that were active in this cycle.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  // Null: this motion doesn't count its computations.
  [[nodiscard]] virtual const MotionWork* work() const noexcept { return nullptr; }
  // Whether this cycle's setpoints have been made. A second step in one cycle would double the speed.
  [[nodiscard]] bool made_setpoints() const noexcept { return made_setpoints_; }

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;

 protected:
  ActiveLimits active_;
  bool made_setpoints_ = false;
};

void record_world(const WorldStep& step, CycleRecord& record) noexcept;

std::vector<description::DriveDescription> descriptions(const std::vector<DriveOnBus>& drives);

// Builds the Motion of the session's type, and moves CycleParts::rendering into this Motion. Precondition: `parts.arm`
// outlives the result.
std::unique_ptr<Motion> make_motion(CycleParts& parts, const SessionSettings& settings,
                                    const description::CellLimits& limits);

}  // namespace proxarm::controller
