// Changes the timestep of a running session, in stages.
//
//   coming_to_rest   the arm is in a hold, and stands for some cycles
//   telling          the drives get the new period (cia402_period.hpp); the cycle runs at the shorter of both periods
//   taking_back      a drive refused, or the hold ended: drives that got the new period get the old one again
//   unknown          a drive confirms neither period: fault timestep_unknown. Only a new session, which configures the
//                    drives, can continue
//
// When step() returns a timestep, its caller recomputes everything that depends on T. The arm stands then, and constant
// setpoints may come at any rate. A change can therefore be taken back in any phase.
//
// No allocation, lock or throw after construction.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "controller/cycle/frame_listener.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/rendering/change.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "fieldbus/cia402/cia402_period.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

[[nodiscard]] std::int64_t ns_of(double period_s) noexcept;
// Whether the values can be a timestep; from a file they may be anything.
[[nodiscard]] bool plausible(const Timestep& timestep) noexcept;
// The timestep of these settings.
[[nodiscard]] Timestep timestep_of(const SessionSettings& settings) noexcept;

class TimestepChange final : public FrameListener {
 public:
  // Conditions for step().
  struct Surroundings {
    bool held = false;    // the supervisor's phase is holding
    bool stands = false;  // the arm is at rest in that hold
  };
  // Tasks for the caller of step().
  struct Step {
    std::optional<Timestep> now;  // timestep from this cycle on
    bool resumes = false;         // the change is over, and rendering continues
  };

  explicit TimestepChange(std::span<const fieldbus::DriveSlot> drives) : exchange_(drives) {}

  // Begins a change. `resumes`: rendering continues after it, unless a person or fault holds the arm meanwhile.
  // Precondition: the arm is in a hold or about to enter one, and no other change is under way.
  void begin(const Timestep& from, const Timestep& to, bool resumes, Alarm& alarm) noexcept;
  // One cycle of the change. Precondition: called once per cycle. Records refusals.
  Step step(std::int64_t t_k_ns, const Surroundings& surroundings, Alarm& alarm, CycleRecord& record) noexcept;
  // The next due request to a drive; false if there is none. The caller sends it behind the cycle's own frames, so it
  // delays the next ones by at most one frame.
  [[nodiscard]] bool next_request(std::int64_t t_k_ns, std::size_t& bus, fieldbus::CanFrame& frame) noexcept;
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept override;

  // Restarts the wait for rest, after a parameter change that was checked for the old timestep.
  void wait_again() noexcept { state_.rest_cycles = 0; }
  // Prevents rendering from continuing after the change.
  void stay_in_hold() noexcept { state_.resumes = false; }

  [[nodiscard]] bool under_way() const noexcept { return state_.stage != Stage::none; }
  // Whether SDO answers are on the buses, beside the cycle's frames.
  [[nodiscard]] bool telling() const noexcept {
    return state_.stage == Stage::telling || state_.stage == Stage::taking_back;
  }
  // Whether no change can still take effect.
  [[nodiscard]] bool settled() const noexcept { return state_.stage == Stage::none || state_.stage == Stage::unknown; }

  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  enum class Stage : std::uint8_t { none, coming_to_rest, telling, taking_back, unknown };
  struct State {
    Stage stage = Stage::none;
    Timestep wanted, old;
    bool resumes = false;
    std::uint8_t rest_cycles = 0;
  };

  Step come_to_rest(const Surroundings& surroundings, CycleRecord& record) noexcept;
  Step tell(const Surroundings& surroundings, CycleRecord& record) noexcept;
  Step take_back(Alarm& alarm) noexcept;
  Step give_up(const fieldbus::PeriodRefusal& refusal, CycleRecord& record) noexcept;
  Step end(std::optional<Timestep> now) noexcept;

  fieldbus::PeriodExchange exchange_;
  State state_;
};

}  // namespace proxarm::controller
