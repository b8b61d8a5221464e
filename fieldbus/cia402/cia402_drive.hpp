// One CiA 402 servo drive in a cyclic mode (positions or torques): its configuration, power state machine and PDOs.
//
// At every SYNC the drive sends TPDO1 (180 + node) and receives RPDO1 (200 + node); cia402_mode.hpp lists their
// contents by mode. EMCY (080 + node) and heartbeat (700 + node) come at any time. The identifiers are those of the
// predefined connection set.
//
// In each cycle, call in this order: on_sync(); on_frame() for each received frame; set_target_rad() if following();
// encode_rpdo(), and send the frame. These functions are noexcept and allocate nothing.
//
// The target equals the actual position until the drive follows targets (operation enabled and statusword bit 12, with
// the brake open). Controlword 0F (enable operation) is sent only after at least three SYNCs have latched a target
// equal to the actual position: otherwise the axis would jump. A torque may be set at any time. The drive applies the
// torque once its brake is open; the axis falls if the torque doesn't hold it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/canopen/canopen_emcy.hpp"
#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/canopen/canopen_sequence.hpp"
#include "fieldbus/cia402/cia402_mode.hpp"
#include "fieldbus/cia402/cia402_state.hpp"
#include "fieldbus/cia402/cia402_units.hpp"
#include "fieldbus/cia402/cyclic_drive.hpp"
#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::fieldbus {

// Settings that all drives of a session share. Times that are sent to drives in milliseconds are in milliseconds here.
struct DriveSettings {
  std::int64_t period_ns = 1'000'000;              // period of SYNC; 60C2h and 1006h must be able to hold it exactly
  std::uint8_t master_node = 127;                  // node whose heartbeat the drives watch
  std::uint16_t master_heartbeat_ms = 20;          // period of the heartbeat that the cycle sends
  std::uint16_t master_heartbeat_timeout_ms = 60;  // 1016h:01; after this time without the heartbeat the drives stop
  std::uint16_t drive_heartbeat_ms = 50;           // 1017h: period of the drives' heartbeats
  // Time without a drive's heartbeat after which the master reports heartbeat_lost.
  std::uint16_t drive_heartbeat_timeout_ms = 150;
  // false: the drives' heartbeats end with the set-up. The TPDO at every SYNC then shows that a drive is alive; it
  // comes fifty times as often as the heartbeat, and it also ends when the drive leaves NMT operational. Heartbeats of
  // several drives at the same moment would delay the setpoints on a full bus beyond their deadline.
  bool heartbeat_in_operation = true;
  // RPDO timeout (1400h:05) in periods of SYNC in position modes; rounded up to whole milliseconds.
  std::uint16_t rpdo_timeout_periods = 5;
  // RPDO timeout in periods of SYNC in torque mode; rounded down to whole milliseconds, because the last torque acts
  // until the timeout. After three missing setpoints the drive must have given up the torque.
  std::uint16_t torque_timeout_periods = 3;
  double following_error_window_rad = 0.05;    // 6065h, in radians at the joint
  std::uint16_t following_error_time_ms = 10;  // 6066h
  // A 32-bit object (index << 8 | sub-index) that this drive sends in TPDO2 at every SYNC, such as the digital inputs,
  // 60FDh. 0: the drive sends no TPDO2. ServoDrive doesn't decode TPDO2.
  std::uint32_t inputs_object = 0;
  SdoSequenceConfig sdo{};
  std::int64_t nmt_timeout_ns = 2'000'000'000;  // how long a heartbeat may take to show a new NMT state

  // Makes the drives stop at most `within_s` after the controller's last frame: sets the heartbeat's timeout to that
  // time, and the heartbeat's period to a third of it.
  void stop_without_controller(double within_s) noexcept;
  // Returns the value of 1016h:01, with which a drive watches the controller's heartbeat.
  [[nodiscard]] std::uint32_t consumer_heartbeat() const noexcept {
    return static_cast<std::uint32_t>(master_node) << 16 | master_heartbeat_timeout_ms;
  }
  // Returns the value of 100Dh for a drive that watches the controller by life guarding. The guard time (100Ch) is the
  // period of the controller's heartbeat.
  [[nodiscard]] std::uint8_t life_time_factor() const noexcept {
    return static_cast<std::uint8_t>(std::clamp(master_heartbeat_timeout_ms / master_heartbeat_ms, 1, 255));
  }
  void validate() const;  // throws SetupError if a setting is invalid
};

// An object that depends on the period, with its new and its old value.
struct PeriodStep {
  ObjectAddress object{};
  std::uint8_t bytes = 4;
  std::uint32_t value = 0, old_value = 0;
  bool is_optional = false;  // true: some drives don't have the object
};
using PeriodSteps = std::array<PeriodStep, 4>;

class ServoDrive final : public CyclicDrive {
 public:
  // Throws SetupError if the description or the settings are invalid according to the profile or the drive's EDS.
  ServoDrive(const description::DriveDescription& drive, const DriveSettings& settings);

  // Returns the steps that the profile needs, adapted to the drive's EDS if the cell names one (eds_check.hpp).
  [[nodiscard]] std::vector<SdoStep> configuration_steps() const;
  // Adds losses that were found while the configuration steps were executed. Not for the cycle.
  void note_losses(const std::vector<std::string>& losses);
  // Leaves out optional feedback if `failed` is the step by which the drive refused to map it. Returns true in that
  // case; configuration_steps() then no longer contains this feedback.
  bool give_up_feedback(const SdoStep& failed, std::uint32_t abort_code);
  // Returns one line for each loss: the object that the drive lacks, according to its EDS or its answers, and the
  // effect.
  [[nodiscard]] std::vector<std::string> losses() const;
  // Returns writes that must wait until the drive is operational.
  [[nodiscard]] std::vector<SdoStep> operation_steps() const;
  // Returns the steps that change the period from `from_ns` to `to_ns`, in the order of writing. 60C2h consists of a
  // value and an exponent; the one whose write leads to the longer interim period comes first. Precondition: 60C2h and
  // 1006h can hold both periods.
  [[nodiscard]] PeriodSteps period_steps(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  // Returns the identifiers that the master must receive from this node: TPDO1, EMCY, SDO answers, heartbeat.
  [[nodiscard]] std::array<std::uint32_t, 4> wanted_ids() const noexcept;
  // Returns wanted_ids(), RPDO1 and the identifier of SDO requests.
  [[nodiscard]] std::array<std::uint32_t, 6> used_ids() const noexcept;
  [[nodiscard]] std::uint8_t node() const noexcept { return description_.node; }
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return description_; }
  [[nodiscard]] const DriveSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const CountScale& scale() const noexcept { return scale_; }
  // Begins to watch the drive for faults. Precondition: the drive is NMT operational.
  void start_cycle(std::int64_t now_ns) noexcept;

  // Sets the goal of the power state machine. If the drive is in fault when operation is first requested, for example
  // because its last controller died, the fault is reset. Any later fault is raised, and only the goal fault_reset
  // resets it.
  void request(DriveGoal goal) noexcept override;
  // Must be called when a SYNC is sent. A TPDO received before no longer counts as fresh. Also detects a lost
  // heartbeat.
  void on_sync(std::int64_t now_ns) noexcept override;
  // True if this drive sent the frame.
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept override;
  // Sets a new target. False if the target isn't taken: the drive isn't following() yet, or the target is out of range
  // (fault target_out_of_range).
  bool set_target_rad(double angle_rad) noexcept override;
  // Sets a new torque at the joint, in torque mode. If the torque is out of range, returns false, keeps the old torque
  // and raises target_out_of_range.
  bool set_target_torque_Nm(double torque_Nm) noexcept;
  // Writes the RPDO of this cycle to `frame`. False until the drive's position is known; no RPDO may be sent before.
  bool encode_rpdo(CanFrame& frame) noexcept override;

  // Writes the request for the drive's NMT state to `frame`, if the drive watches the controller by life guarding;
  // false for any other drive. Must be sent once per heartbeat period.
  [[nodiscard]] bool guard_request(CanFrame& frame) const noexcept;

  // ---- the drive's state ----
  // True if a TPDO was received since the last SYNC.
  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }
  // True if a TPDO was ever received.
  [[nodiscard]] bool heard() const noexcept { return heard_; }
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return cycles_without_tpdo_; }
  [[nodiscard]] DriveState state() const noexcept override { return state_; }
  [[nodiscard]] DriveGoal goal() const noexcept { return goal_; }
  // True if the drive takes targets.
  [[nodiscard]] bool following() const noexcept override { return following_; }
  [[nodiscard]] bool torque_mode() const noexcept { return mode_.torque; }
  // Unit of target_torque() and actual_torque() (6071h, 6077h): thousandths of the rated torque. actual_torque_Nm() is
  // the torque at the joint.
  [[nodiscard]] std::int16_t target_torque() const noexcept { return target_torque_; }
  [[nodiscard]] std::int16_t actual_torque() const noexcept { return actual_torque_; }  // 0 without torque feedback
  [[nodiscard]] double actual_torque_Nm() const noexcept { return actual_torque_ / torque_per_Nm_; }
  // Returns nullopt except in torque mode or if the cell's `feedback` contains 6077h.
  [[nodiscard]] std::optional<double> torque_share() const noexcept override;
  // Returns nullopt if the cell has no `gear_torque` for this drive. If `gear_torque` is a second encoder, the torque
  // is stiffness times windup.
  [[nodiscard]] std::optional<double> gear_torque_Nm() const noexcept override;
  [[nodiscard]] std::uint16_t statusword() const noexcept { return statusword_; }
  [[nodiscard]] std::int32_t actual_counts() const noexcept override { return actual_counts_; }
  [[nodiscard]] double actual_rad() const noexcept override { return scale_.angle_rad(actual_counts_); }
  [[nodiscard]] std::int32_t target_counts() const noexcept override { return target_counts_; }
  [[nodiscard]] double target_rad() const noexcept override { return scale_.angle_rad(target_counts_); }
  [[nodiscard]] bool follows_command() const noexcept { return (statusword_ & statusword::follows_command) != 0; }
  [[nodiscard]] bool following_error() const noexcept { return (statusword_ & statusword::following_error) != 0; }
  [[nodiscard]] bool internal_limit() const noexcept { return (statusword_ & statusword::internal_limit_active) != 0; }
  [[nodiscard]] bool warning() const noexcept { return (statusword_ & statusword::warning) != 0; }
  [[nodiscard]] NmtState nmt_state() const noexcept { return heartbeat_.state(); }
  [[nodiscard]] std::uint64_t boot_ups() const noexcept { return heartbeat_.boot_ups(); }

  // The first fault that was raised. It is kept until clear_fault().
  [[nodiscard]] DriveFault fault() const noexcept override { return fault_; }
  void clear_fault() noexcept { fault_ = DriveFault::none; }
  void forget_fault() noexcept override {
    clear_fault();
    old_fault_ = true;
  }
  [[nodiscard]] const Emergency& latest_emergency() const noexcept { return emergency_; }
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  // Number of EMCYs that are warnings.
  [[nodiscard]] std::uint64_t warnings() const noexcept { return warnings_; }
  [[nodiscard]] std::uint64_t repeated_tpdos() const noexcept { return repeated_tpdos_; }
  // Returns state, fault and latest EMCY as text. Not for the cycle.
  [[nodiscard]] std::string describe() const override;

  void archive(StateArchive& state) noexcept override {
    state(heartbeat_, goal_, state_, fault_, statusword_, controlword_, actual_counts_, target_counts_,
          boot_ups_at_start_, cycles_without_tpdo_, held_, held_pending_, cycling_, old_fault_, fresh_, heard_,
          following_, emergency_, emergencies_, repeated_tpdos_, target_torque_, actual_torque_, torque_per_Nm_,
          tpdo_bytes_, torque_feedback_, tpdos_in_cycle_, doubled_cycles_, shown_mode_, stuck_, warnings_,
          gear_torque_);
  }

 private:
  void set_up_torque();
  void lose_feedback(const MappedObject& object);
  void leave_out_what_eds_lacks();
  [[nodiscard]] bool is_gear_torque(const MappedObject& object) const noexcept;
  [[nodiscard]] std::vector<SdoStep> all_profile_steps() const;
  // The steps of the profile, without those that the cell skips.
  [[nodiscard]] std::vector<SdoStep> profile_steps() const;
  void note_skipped();
  bool decode_tpdo(const CanFrame& frame) noexcept;
  void judge_doubled() noexcept;
  [[nodiscard]] bool shows_mode() const noexcept { return !mode_byte_ || shown_mode_ == mode_.number; }
  [[nodiscard]] std::string stuck_text() const;
  void judge_state(bool was_enabled) noexcept;
  void raise(DriveFault fault) noexcept;

  description::DriveDescription description_;
  DriveSettings settings_;
  std::shared_ptr<const description::EdsFile> eds_;  // nullptr if the cell names no EDS
  CyclicMode mode_;
  std::uint8_t tpdo_bytes_, rpdo_bytes_;
  bool torque_feedback_;                     // 6077h is in TPDO1, after the position
  std::optional<std::uint8_t> torque_byte_;  // byte of 6077h in TPDO1 as optional feedback
  std::optional<std::uint8_t> mode_byte_;    // byte of 6061h in TPDO1 as optional feedback; the mode is then watched
  std::optional<std::uint8_t> gear_torque_byte_;
  std::vector<std::string> losses_;
  std::string fixed_by_eds_;  // objects that the EDS says are read-only; cleared by note_losses()
  CountScale scale_;
  double torque_per_Nm_ = 1.0;  // thousandths of the rated torque per Nm at the joint, signed like `direction`
  HeartbeatConsumer heartbeat_;
  DriveGoal goal_ = DriveGoal::none;
  DriveState state_ = DriveState::unknown;
  DriveFault fault_ = DriveFault::none;
  std::uint16_t statusword_ = 0;
  std::uint16_t controlword_ = 0;
  std::int32_t actual_counts_ = 0;
  std::int32_t target_counts_ = 0;
  std::int16_t target_torque_ = 0, actual_torque_ = 0;
  std::int16_t extra_torque_ = 0;  // value at torque_byte_
  std::int32_t gear_torque_ = 0;   // value at gear_torque_byte_, in counts
  std::uint64_t boot_ups_at_start_ = 0;
  std::uint32_t cycles_without_tpdo_ = 0;
  // Number of SYNCs that latched a target equal to the actual position in the state switched on.
  int held_ = 0;
  bool held_pending_ = false;
  bool cycling_ = false;
  bool old_fault_ = true;  // since operation was first requested, the drive has shown no state but fault
  bool fresh_ = false;
  bool heard_ = false;
  bool following_ = false;
  Emergency emergency_{};
  std::uint64_t emergencies_ = 0;
  std::uint64_t repeated_tpdos_ = 0;
  std::uint64_t warnings_ = 0;
  // TPDOs in this cycle, and the number of consecutive cycles with more than one TPDO.
  std::uint32_t tpdos_in_cycle_ = 0, doubled_cycles_ = 0;
  std::int8_t shown_mode_ = 0;  // value at mode_byte_
  // The statusword (with bit 16 set) at the moment when enabling was abandoned before the drive took targets; else 0.
  std::uint32_t stuck_ = 0;
};

}  // namespace proxarm::fieldbus
