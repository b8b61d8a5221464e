// Runs the session that proves an arm, by small slow motions of each joint and by pushes, under the same supervision as
// any session. With a Task, the session reads the resting arm at other stations.
//
// After enabling and taring, the session goes through the stations of its plan. At each station: move, settle, exercise
// if there is an exercise, read. At a station with a push: move, settle, wait for the push, read, wait for the push's
// end. At the end, the session switches the drives off and watches the brakes for a second.
//
// The tool moves at proof_speed_m_per_s at most, and the joints move on minimum-jerk paths from rest to rest. Any
// fault, any hold and a released enabling input end the session: the motion runs out within a tenth of a second, and
// the drives are switched off. run_cycle() never allocates, locks, throws or prints. begin_plan() does so, between
// cycles.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "controller/cycle/bus_image.hpp"
#include "controller/cycle/cycle_recorder.hpp"
#include "controller/cycle/fault_monitor.hpp"
#include "controller/cycle/timestep_change.hpp"
#include "controller/extras/proof/exercise.hpp"
#include "controller/extras/proof/proof.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/supervisor.hpp"

namespace proxarm::proof {

// The tool's speed limit. Paths stay below it. A measured speed above 1.2 times this limit is the fault tool_too_fast.
inline constexpr double proof_speed_m_per_s = 0.1;

// What the person is asked to do. Any thread may read it.
enum class Asked : std::uint8_t { nothing, press, push, let_go };

// The stations, computed from the motors' initial angles, and how long the arm settles and is read at each station.
struct Task {
  std::function<std::vector<Station>(const models::JointVector& motor_rad)> stations;  // empty: plan()
  double settle_s = 0.4, read_s = 0.3;
  std::shared_ptr<Exercise> exercise = nullptr;  // between settling and reading; null: none
};

class ProofSession {
 public:
  ProofSession(controller::CycleParts parts, const controller::SessionSettings& settings, const description::Cell& cell,
               Task task = {});
  ProofSession(const ProofSession&) = delete;
  ProofSession& operator=(const ProofSession&) = delete;

  void run_cycle(std::int64_t t_k_ns) noexcept;
  // Whether the arm stands and waits for its plan.
  [[nodiscard]] bool needs_plan() const noexcept;
  // Makes the plan. Throws SetupError if no plan is possible. Precondition: needs_plan().
  void begin_plan();
  [[nodiscard]] bool done() const noexcept { return supervisor_.phase() == controller::Phase::done; }
  void shut_down() noexcept { bus_.shut_down(controller::ns_of(settings_.period_s)); }

  // ---- any thread
  void request_stop() noexcept { stop_.store(true); }
  [[nodiscard]] Asked asked() const noexcept { return asked_.load(); }
  // Returns the station of the requested push, as an index of readings() and stations().
  [[nodiscard]] std::size_t station() const noexcept { return station_.load(); }

  // ---- between cycles
  [[nodiscard]] const std::vector<Station>& stations() const noexcept { return stations_; }

  // ---- after the last cycle
  [[nodiscard]] bool complete() const noexcept { return !readings_.empty() && station_ == stations_.size(); }
  // Whether the session waited in vain for a push, or for the end of a push.
  [[nodiscard]] bool not_pushed() const noexcept { return not_pushed_; }
  [[nodiscard]] const std::vector<Reading>& readings() const noexcept { return readings_; }
  // Returns the fault that stopped the arm, else the fault that caused the hold; Fault::none: no fault.
  [[nodiscard]] const controller::FaultReport& fault() const noexcept {
    return supervisor_.faulted() ? supervisor_.report() : supervisor_.held_for();
  }
  // Returns how far the joints moved on their brakes, rad; nullopt if the session ended before the brakes were watched.
  [[nodiscard]] std::optional<double> slipped_rad() const noexcept { return slipped_rad_; }
  [[nodiscard]] const controller::CycleParts& parts() const noexcept { return parts_; }

 private:
  enum class Step : std::uint8_t { moving, settling, exercising, waiting, reading, releasing };
  // The sum of the samples of the present reading, and what their accuracy needs.
  struct Gathered {
    models::Wrench sum_S, last_S, step_squares_S;
    int samples = 0;
  };
  class NoListener final : public controller::FrameListener {
   public:
    bool on_frame(std::size_t /*bus*/, const fieldbus::CanFrame& /*frame*/) noexcept override { return false; }
  };

  void heed(std::int64_t t_k_ns) noexcept;
  void enter(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] fieldbus::DriveGoal goal_off() const noexcept;
  void act(std::int64_t t_k_ns) noexcept;
  void wait_for_drives(double in_phase_s) noexcept;
  void tare(double in_phase_s) noexcept;
  void follow_plan() noexcept;
  void move() noexcept;
  void exercise() noexcept;
  void wait_for_push(bool pressed) noexcept;
  void read() noexcept;
  void add_sample(const models::Wrench& reading_S) noexcept;
  void next_station() noexcept;
  void begin_move(const models::JointVector& to_rad) noexcept;
  void watch_brakes(double in_phase_s) noexcept;
  void go_to(Step step) noexcept;

  controller::CycleParts parts_;
  controller::SessionSettings settings_;
  description::Cell cell_;
  Task task_;
  description::CellLimits limits_;
  std::uint64_t cycle_ = 0;
  controller::Supervisor supervisor_;
  controller::Alarm alarm_;
  controller::CycleRecorder recorder_;
  controller::BusImage bus_;
  controller::Measurement measurement_;
  controller::FaultMonitor faults_;
  NoListener listener_;
  controller::Phase entered_ = controller::Phase::idle;
  std::int64_t first_ns_ = 0, since_ns_ = 0;
  std::atomic<bool> stop_{false};
  std::atomic<Asked> asked_{Asked::nothing};
  std::atomic<std::size_t> station_{0};
  controller::Setpoints setpoints_;

  std::vector<Station> stations_;
  std::vector<Reading> readings_;
  Step step_ = Step::moving;
  // step_s_: time in this step. pressed_s_: how long the push, or its end, has lasted so far.
  double step_s_ = 0.0, pressed_s_ = 0.0;
  models::JointVector from_rad_, way_rad_;
  double duration_s_ = 0.0, path_s_ = 0.0, exercise_s_ = 0.0, rate_ = 1.0;
  models::Vec3 unpushed_S_ = models::Vec3::Zero();
  Gathered gathered_;
  bool not_pushed_ = false;
  models::JointVector braked_rad_;
  std::optional<double> slipped_rad_;
};

}  // namespace proxarm::proof
