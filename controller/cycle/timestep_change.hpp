// A change of the timestep in a running session: what is asked of the drives, stage by stage.
//
//   coming_to_rest   the arm is in a hold, and stands for some cycles
//   telling          the drives are told (cia402_period.hpp); meanwhile the cycle runs at the shorter of both periods
//   taking_back      a drive has refused, or the hold has ended: those that were told are told the old period again
//   unknown          a drive confirms neither period: the fault timestep_unknown. Only a new session, which configures
//                    the drives, can go on
//
// When step() returns a timestep, its caller computes everything that depends on T anew. The arm stands then, and
// setpoints that don't change may come at any rate. A change can therefore be taken back in any phase.
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
// Whether the values can be those of a timestep; one that was read from a file may be anything.
[[nodiscard]] bool plausible(const Timestep& timestep) noexcept;
// The timestep that these settings hold.
[[nodiscard]] Timestep timestep_of(const SessionSettings& settings) noexcept;

class TimestepChange final : public FrameListener {
 public:
  // The conditions that step() needs to know.
  struct Surroundings {
    bool held = false;    // the supervisor's phase is holding
    bool stands = false;  // the arm is at rest in that hold
  };
  // What the caller of step() has to do.
  struct Step {
    std::optional<Timestep> now;  // the timestep from this cycle on
    bool resumes = false;         // the change is over, and rendering goes on
  };

  explicit TimestepChange(std::span<const fieldbus::DriveSlot> drives) : exchange_(drives) {}

  // Begins a change. `resumes`: rendering goes on after it, unless somebody or something holds the arm meanwhile.
  // Precondition: the arm is in a hold or about to enter one, and no other change is under way.
  void begin(const Timestep& from, const Timestep& to, bool resumes, Alarm& alarm) noexcept;
  // Runs one cycle of the change. Precondition: called once per cycle. Refusals go into the record.
  Step step(std::int64_t t_k_ns, const Surroundings& surroundings, Alarm& alarm, CycleRecord& record) noexcept;
  // The next request to a drive that is due now; false if there is none (any more). The caller sends it behind all of
  // the cycle's own frames, so it delays the next ones by no more than the one frame that is on the wire.
  [[nodiscard]] bool next_request(std::int64_t t_k_ns, std::size_t& bus, fieldbus::CanFrame& frame) noexcept;
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept override;

  // Restarts the wait for rest. A change of a parameter, which was checked for the old timestep, has just been taken.
  void wait_again() noexcept { state_.rest_cycles = 0; }
  // Keeps rendering from going on by itself after the change.
  void stay_in_hold() noexcept { state_.resumes = false; }

  [[nodiscard]] bool under_way() const noexcept { return state_.stage != Stage::none; }
  // Whether SDO answers are on the buses, beside the cycle's frames.
  [[nodiscard]] bool telling() const noexcept {
    return state_.stage == Stage::telling || state_.stage == Stage::taking_back;
  }
  // Whether no change is under way that could still take effect.
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
