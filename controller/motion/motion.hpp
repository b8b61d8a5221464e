// What the drives are told, and all of its history: the one class that starts, moves, stops and winds back whatever
// lies between the hand's force and the setpoints. It knows no bus.
//
//   AdmittanceMotion   force in, motor angles out: proxy (26), limits, inverse kinematics, elastic gears, guards of
//   joints and tool TorqueMotion       position in, joint torques out: (23)
//
// The cycle calls one of "each cycle" by its phase, and those of "between" when a phase begins or somebody asks for
// something. All of it is noexcept and allocates, locks and prints nothing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/motion/setpoints.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/rendering/change.hpp"
#include "controller/rendering/rendered_world.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/command.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

// What a step is given, and where it says what it did.
struct MotionCycle {
  const Measured& measured;
  bool slowed = false;  // the tool keeps below the speed of the reaction "slow"
  Alarm& alarm;
  CycleRecord& record;
};

// Where rendering begins from.
enum class Beginning : std::uint8_t {
  first,     // the sensor has been tared
  resuming,  // out of a hold. The tool may have been led into an object meanwhile: slowly out of it
  freeing,   // out of a hold, without the scene
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
  // Drives are being enabled: one that takes setpoints already, while others don't yet, stays where it is.
  virtual void wait_for_drives(const Measured& measured) noexcept = 0;
  // The drives stand, and the sensor is tared.
  virtual void stand(const Measured& measured) noexcept = 0;
  // True: the world has gone on by a period.
  virtual bool render(const MotionCycle& cycle) noexcept = 0;
  // Slowly and without the scene. True: it is over.
  virtual bool free(const MotionCycle& cycle) noexcept = 0;
  // Every joint keeps its share of the last motion while that shrinks to nothing.
  virtual void run_out() noexcept = 0;

  // ---- between
  // At rest, where the setpoints are.
  virtual void start(const Measured& measured, Beginning beginning) noexcept = 0;
  virtual void start_run_out() noexcept = 0;
  // Release or back_off: what free() is to do. False: nothing says which way.
  virtual bool prepare_freeing(const Command& command, const Measured& measured) noexcept = 0;
  // Away from what presses on the tool of an arm that stands: what free() is to do then. False: little does.
  virtual bool start_yielding(const Measured& /*measured*/) noexcept { return false; }
  virtual void set(const Change& change) noexcept = 0;
  // T of the cycles to come; the arm stands. What was commanded and rendered stays as it is.
  virtual void set_period(double period_s) noexcept = 0;

  // ---- asked
  [[nodiscard]] virtual Setpoints setpoints() const noexcept = 0;
  // Whether it can stand with drives enabled, which holds, and all that leads out of them, need.
  [[nodiscard]] virtual bool can_hold() const noexcept = 0;
  // Run out, and at rest.
  [[nodiscard]] virtual bool stands() const noexcept = 0;
  [[nodiscard]] virtual bool backs_off() const noexcept = 0;
  // Nobody holds the handle, and the proxy has come to rest: what is read as the hand's wrench is the sensor's bias.
  // Null: somebody may be there.
  [[nodiscard]] virtual const models::Wrench* resting_wrench_W() const noexcept { return nullptr; }
  // Nobody holds the handle, and the cell wants a hold then.
  [[nodiscard]] virtual bool wants_hold() const noexcept { return false; }
  [[nodiscard]] virtual const models::Vec3& proxy_W() const noexcept = 0;
  // Which limits were active in this cycle.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  // This cycle's setpoints are made: a second step would be one of twice the speed.
  [[nodiscard]] bool made_setpoints() const noexcept { return made_setpoints_; }

  virtual void archive(fieldbus::StateArchive& state) noexcept = 0;

 protected:
  ActiveLimits active_;
  bool made_setpoints_ = false;
};

// What a step of the world leaves in the record.
void record_world(const WorldStep& step, CycleRecord& record) noexcept;

// The descriptions of these drives.
std::vector<description::DriveDescription> descriptions(const std::vector<DriveOnBus>& drives);

// Of the type that `parts` are for, and with them.
std::unique_ptr<Motion> make_motion(CycleParts& parts, const SessionSettings& settings,
                                    const description::CellLimits& limits);

}  // namespace proxarm::controller
