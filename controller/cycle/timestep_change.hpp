// Changes the timestep of a running session, in stages.
//
//   coming_to_rest   The change waits until the arm has stood in a hold for some cycles.
//   telling          The drives get the new period (cia402_period.hpp). The cycle runs at the old or the new period,
//                    whichever is shorter.
//   taking_back      A drive has refused, or the hold has ended: drives that got the new period get the old one again.
//   unknown          A drive confirms neither period, which is the fault timestep_unknown. Only a new session, which
//                    configures the drives, can continue.
//
// When step() returns a timestep, the caller recomputes everything that depends on T. The arm then stands, and constant
// setpoints may come at any rate. So a change can be taken back in every phase of the session.
//
// Nothing allocates, locks or throws after construction.
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
// Whether the values can be a timestep. Values that come from a file may be anything.
[[nodiscard]] bool plausible(const Timestep& timestep) noexcept;
// Returns the timestep of these settings.
[[nodiscard]] Timestep timestep_of(const SessionSettings& settings) noexcept;

class TimestepChange final : public FrameListener {
 public:
  // Conditions for step().
  struct Surroundings {
    bool held = false;    // the supervisor's phase is holding
    bool stands = false;  // the arm is at rest in a hold
  };
  // Tasks for the caller of step().
  struct Step {
    std::optional<Timestep> now;  // the timestep to use from this cycle on; nullopt: it doesn't change
    bool resumes = false;         // the change is over, and rendering shall continue
  };

  explicit TimestepChange(std::span<const fieldbus::DriveSlot> drives) : exchange_(drives) {}

  // Begins a change. `resumes`: rendering shall continue after the change, unless a person or a fault holds the arm
  // during the change. Precondition: the arm is in a hold or about to enter a hold, and no other change is under way.
  void begin(const Timestep& from, const Timestep& to, bool resumes, Alarm& alarm) noexcept;
  // Continues the change and records refusals. Precondition: called once per cycle.
  Step step(std::int64_t t_k_ns, const Surroundings& surroundings, Alarm& alarm, CycleRecord& record) noexcept;
  // Gets the next due request to a drive. Returns false if no request is due. The caller sends the request behind the
  // cycle's frames, so the request delays the next cycle's frames by at most one frame.
  [[nodiscard]] bool next_request(std::int64_t t_k_ns, std::size_t& bus, fieldbus::CanFrame& frame) noexcept;
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept override;

  // Restarts the wait for rest, after a parameter change that was checked for the old timestep.
  void wait_again() noexcept { state_.rest_cycles = 0; }
  // Prevents rendering from continuing after the change.
  void stay_in_hold() noexcept { state_.resumes = false; }

  [[nodiscard]] bool under_way() const noexcept { return state_.stage != Stage::none; }
  // Whether SDO answers are on the buses, besides the cycle's frames.
  [[nodiscard]] bool telling() const noexcept {
    return state_.stage == Stage::telling || state_.stage == Stage::taking_back;
  }
  // Whether no change of the timestep is under way that can still take effect.
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
