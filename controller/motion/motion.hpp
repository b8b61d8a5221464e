// What the drives are told, and all of its history. This is the one class that starts, moves, stops and winds back
// whatever lies between the hand's force and the setpoints. It knows no bus.
//
//   AdmittanceMotion   force in, motor angles out: the proxy (26), limits, inverse kinematics, elastic gears, guards
//                      of joints and tool
//   TorqueMotion       position in, joint torques out: (23)
//
// In each cycle the caller calls one function of "each cycle", chosen by the phase. It calls those of "between" when a
// phase begins or when somebody asks for something. All of them are noexcept; none allocates, locks or prints.
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

// What a step is given, and where it reports what it did.
struct MotionCycle {
  const Measured& measured;
  bool slowed = false;  // the tool keeps below the speed of the reaction `slow`
  Alarm& alarm;
  CycleRecord& record;
};

// Where rendering starts from.
enum class Beginning : std::uint8_t {
  first,     // the sensor has been tared
  resuming,  // from a hold; if somebody moved the tool into an object meanwhile, it leaves it slowly
  freeing,   // from a hold, without the scene
};

// A joint whose hold takes more torque than the weight of the model.
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
  // Drives are being enabled. A drive that already takes setpoints stays where it is until the others do, too.
  virtual void wait_for_drives(const Measured& measured) noexcept = 0;
  // The drives are enabled and the arm stands still while the sensor is tared.
  virtual void stand(const Measured& measured) noexcept = 0;
  // Takes one step of rendering. Returns true if the world has advanced by a period.
  virtual bool render(const MotionCycle& cycle) noexcept = 0;
  // Moves slowly and without the scene. Returns true when this is over.
  virtual bool free(const MotionCycle& cycle) noexcept = 0;
  // Every joint keeps its share of the last motion while the speed shrinks to zero.
  virtual void run_out() noexcept = 0;

  // ---- between
  // Precondition: the arm is at rest at the last setpoints.
  virtual void start(const Measured& measured, Beginning beginning) noexcept = 0;
  virtual void start_run_out() noexcept = 0;
  // Prepares what free() does after the order release or back_off. Returns false if no direction can be told.
  virtual bool prepare_freeing(const Command& command, const Measured& measured) noexcept = 0;
  // Prepares free() to back off from what presses on the tool. Precondition: the arm stands. Returns false if little
  // presses.
  virtual bool start_yielding(const Measured& /*measured*/) noexcept { return false; }
  virtual void set(const Change& change) noexcept = 0;
  // Another tool behind the sensor (tool_change.hpp): what is felt of it, with the proxy's mass, at once; and what the
  // models of arm and hand take for it, as that is faded in.
  virtual void hang(double /*proxy_mass_kg*/, const models::ToolInertia& /*behind*/) noexcept {}
  virtual void carry(const HeldTool& /*tool*/, const models::ToolInertia& /*behind*/) noexcept {}
  // The period of the cycles to come. Precondition: the arm stands. What was commanded and rendered stays as it is.
  virtual void set_period(double period_s) noexcept = 0;

  // ---- asked
  [[nodiscard]] virtual Setpoints setpoints() const noexcept = 0;
  // Whether the arm can stand with its drives enabled. Holds need this, and so does all that leads out of them.
  [[nodiscard]] virtual bool can_hold() const noexcept = 0;
  // The run-out has ended, and the arm is at rest.
  [[nodiscard]] virtual bool stands() const noexcept = 0;
  [[nodiscard]] virtual bool backs_off() const noexcept = 0;
  // The hand's wrench as it is read while nobody holds the handle and the proxy has come to rest: all of it is the
  // sensor's bias. Null if somebody may be holding the handle.
  [[nodiscard]] virtual const models::Wrench* resting_wrench_W() const noexcept { return nullptr; }
  // What the model of the arm's weight lacks, where that is more than may be: with torques, more than may be carried;
  // with gears that are damped by their torque, a reading of the wrong sign. Precondition: the hold before the first
  // start is over.
  [[nodiscard]] virtual std::optional<MissingWeight> missing_weight() const noexcept { return {}; }
  // Nobody holds the handle, and the cell asks for a hold in this case.
  [[nodiscard]] virtual bool wants_hold() const noexcept { return false; }
  [[nodiscard]] virtual const models::Vec3& proxy_W() const noexcept = 0;
  [[nodiscard]] virtual Eigen::Quaterniond proxy_R_WT() const noexcept { return Eigen::Quaterniond::Identity(); }
  // The limits that were active in this cycle.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  // Null: nothing is counted.
  [[nodiscard]] virtual const MotionWork* work() const noexcept { return nullptr; }
  // This cycle's setpoints are made already. A second step in the same cycle would double the speed.
  [[nodiscard]] bool made_setpoints() const noexcept { return made_setpoints_; }

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;

 protected:
  ActiveLimits active_;
  bool made_setpoints_ = false;
};

// Writes what a step of the world did to the record.
void record_world(const WorldStep& step, CycleRecord& record) noexcept;

// Returns the descriptions of these drives.
std::vector<description::DriveDescription> descriptions(const std::vector<DriveOnBus>& drives);

// Builds the Motion of the session's type and moves CycleParts::rendering into it. Precondition: `parts.arm` outlives
// the result.
std::unique_ptr<Motion> make_motion(CycleParts& parts, const SessionSettings& settings,
                                    const description::CellLimits& limits);

}  // namespace proxarm::controller
