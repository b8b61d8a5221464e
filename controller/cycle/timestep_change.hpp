// A change of the timestep in a running session: what is asked of the drives, stage by stage.
//
//   coming_to_rest   the arm is in a hold, and stands for some cycles
//   telling          the drives are told (cia402_period.hpp). As long as that lasts, the cycle runs at the shorter one
//   of
//                    both periods
//   taking_back      a drive has refused, or the hold has ended: those that were told are told the old period again
//   unknown          a drive confirms neither period: the fault timestep_unknown, and only a new session, which
//                    configures the drives, goes on
//
// Who owns the cycle makes everything that holds T anew where step() says so. The arm stands then, and a setpoint that
// doesn't change may come as often as it likes; so a change is taken back in whatever phase.
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
// Read from a file it may be anything.
[[nodiscard]] bool plausible(const Timestep& timestep) noexcept;
// Of these settings.
[[nodiscard]] Timestep timestep_of(const SessionSettings& settings) noexcept;

class TimestepChange final : public FrameListener {
 public:
  // What step() finds.
  struct Surroundings {
    bool held = false;    // the supervisor's phase is holding
    bool stands = false;  // the arm is at rest in that hold
  };
  // What its caller does.
  struct Step {
    std::optional<Timestep> now;  // the timestep from this cycle on
    bool resumes = false;         // the change is over, and rendering goes on
  };

  explicit TimestepChange(std::span<const fieldbus::DriveSlot> drives) : exchange_(drives) {}

  // Begins. `resumes`: rendering goes on after it, unless somebody or something holds the arm meanwhile. The arm must
  // come into a hold; no other change is under way.
  void begin(const Timestep& from, const Timestep& to, bool resumes, Alarm& alarm) noexcept;
  // Once per cycle. Refusals go into the record.
  Step step(std::int64_t t_k_ns, const Surroundings& surroundings, Alarm& alarm, CycleRecord& record) noexcept;
  // The next request to a drive that is due now; false: none (any more). Sent behind all of the cycle's own frames, it
  // delays none by more than the one that is on the wire.
  [[nodiscard]] bool next_request(std::int64_t t_k_ns, std::size_t& bus, fieldbus::CanFrame& frame) noexcept;
  bool on_frame(std::size_t bus, const fieldbus::CanFrame& frame) noexcept override;

  // The arm begins to wait anew: a change of a parameter, which was checked for the old timestep, has just been taken.
  void wait_again() noexcept { state_.rest_cycles = 0; }
  // Rendering doesn't go on by itself.
  void stay_in_hold() noexcept { state_.resumes = false; }

  [[nodiscard]] bool under_way() const noexcept { return state_.stage != Stage::none; }
  // SDO answers are on the buses, beside the cycle's frames.
  [[nodiscard]] bool telling() const noexcept {
    return state_.stage == Stage::telling || state_.stage == Stage::taking_back;
  }
  // Nothing more will come of it.
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
