// One CiA 402 servo drive in a cyclic mode (positions or torques): its configuration, power state machine and PDOs.
//
// Wire, every SYNC (identifiers of the predefined connection set): TPDO1 180 + node and RPDO1 200 + node, with contents
// by mode (cia402_mode.hpp); EMCY 080 + node and heartbeat 700 + node at any time.
//
// A cycle: on_sync(); on_frame() for received frames; set_target_rad() if following(); encode_rpdo(), send. These are
// noexcept and allocate nothing. The target follows the actual position until the drive follows targets (operation
// enabled and statusword bit 12: the brake is open). At least three SYNCs must have latched such a target before 0F
// (enable operation) is sent: otherwise the axis would jump. A torque may be set at any time: the drive applies it once
// its brake is open, and the axis falls if the torque doesn't hold it.
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

// Settings that all drives of a session share. Times that are sent in milliseconds are in milliseconds here.
struct DriveSettings {
  std::int64_t period_ns = 1'000'000;              // of SYNC; 60C2h and 1006h must hold it exactly
  std::uint8_t master_node = 127;                  // node whose heartbeat the drives consume
  std::uint16_t master_heartbeat_ms = 20;          // period of the cycle's heartbeat
  std::uint16_t master_heartbeat_timeout_ms = 60;  // 1016h:01; without the heartbeat the drives stop
  std::uint16_t drive_heartbeat_ms = 50;           // 1017h
  std::uint16_t drive_heartbeat_timeout_ms = 150;  // the master's timeout for drives
  // false: the drives' heartbeats end with the set-up. A TPDO at every SYNC, which also ends outside of operational,
  // shows the same fifty times as often, and coinciding heartbeats would delay a full bus's setpoints beyond their
  // deadline.
  bool heartbeat_in_operation = true;
  std::uint16_t rpdo_timeout_periods = 5;  // 1400h:05, rounded up to whole milliseconds
  // The same in torque mode, rounded down: the last torque acts until then, and the third missed one must be the last.
  std::uint16_t torque_timeout_periods = 3;
  double following_error_window_rad = 0.05;    // 6065h, at the joint
  std::uint16_t following_error_time_ms = 10;  // 6066h
  // A 32-bit object (index << 8 | sub-index) that this drive sends in TPDO2 at every SYNC, such as the digital inputs,
  // 60FDh; 0: none. Not decoded here.
  std::uint32_t inputs_object = 0;
  SdoSequenceConfig sdo{};
  std::int64_t nmt_timeout_ns = 2'000'000'000;  // for a change of NMT state to show in the heartbeat

  // Makes the drives stop within this time of the controller's last frame. The controller's heartbeat is sent three
  // times as often.
  void stop_without_controller(double within_s) noexcept;
  // 1016h:01, with which a drive watches the controller.
  [[nodiscard]] std::uint32_t consumer_heartbeat() const noexcept {
    return static_cast<std::uint32_t>(master_node) << 16 | master_heartbeat_timeout_ms;
  }
  // 100Dh, for a drive that watches the controller by life guarding; 100Ch is the heartbeat's period.
  [[nodiscard]] std::uint8_t life_time_factor() const noexcept {
    return static_cast<std::uint8_t>(std::clamp(master_heartbeat_timeout_ms / master_heartbeat_ms, 1, 255));
  }
  void validate() const;  // throws SetupError
};

// The new and the old value of an object that depends on the period.
struct PeriodStep {
  ObjectAddress object{};
  std::uint8_t bytes = 4;
  std::uint32_t value = 0, old_value = 0;
  bool is_optional = false;  // not every drive has it
};
using PeriodSteps = std::array<PeriodStep, 4>;

class ServoDrive final : public CyclicDrive {
 public:
  // Throws SetupError if description or settings are invalid by the profile or the drive's EDS.
  ServoDrive(const description::DriveDescription& drive, const DriveSettings& settings);

  // ---- set-up ----
  // By the profile and, if the drive has one, its EDS (eds_check.hpp).
  [[nodiscard]] std::vector<SdoStep> configuration_steps() const;
  // Adds the losses found by configuration_steps(). Not for the cycle.
  void note_losses(const std::vector<std::string>& losses);
  // Leaves out optional feedback that the drive refused to map in a transmit PDO; then returns true, and
  // configuration_steps() no longer has it.
  bool give_up_feedback(const SdoStep& failed, std::uint32_t abort_code);
  // Objects that the drive lacks, by its EDS and by its answers, and the effects; one line each.
  [[nodiscard]] std::vector<std::string> losses() const;
  // Writes that must wait until the drive is operational.
  [[nodiscard]] std::vector<SdoStep> operation_steps() const;
  // Steps from one period to another, in the order of writing. First comes that part of 60C2h which makes the interim
  // period the longer one. Precondition: 60C2h and 1006h can hold both periods.
  [[nodiscard]] PeriodSteps period_steps(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  // Identifiers that the master must receive from this node: TPDO1, EMCY, SDO answers, heartbeat.
  [[nodiscard]] std::array<std::uint32_t, 4> wanted_ids() const noexcept;
  // wanted_ids(), RPDO1 and SDO requests.
  [[nodiscard]] std::array<std::uint32_t, 6> used_ids() const noexcept;
  [[nodiscard]] std::uint8_t node() const noexcept { return description_.node; }
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return description_; }
  [[nodiscard]] const DriveSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const CountScale& scale() const noexcept { return scale_; }
  // Begins to watch for faults; the drive must be operational.
  void start_cycle(std::int64_t now_ns) noexcept;

  // ---- cycle ----
  // Resets a fault that is present when operation is first requested (its last controller died, say). A later fault is
  // raised, and only fault_reset leaves it.
  void request(DriveGoal goal) noexcept override;
  // Call when a SYNC is sent: frames received before are no longer fresh. Also detects a lost heartbeat.
  void on_sync(std::int64_t now_ns) noexcept override;
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept override;  // true if the frame was this drive's
  // Sets a new target. False if it isn't taken: not following() yet, or fault target_out_of_range.
  bool set_target_rad(double angle_rad) noexcept override;
  // In torque mode, at the joint. If out of range: false, keeps the old torque, fault target_out_of_range.
  bool set_target_torque_Nm(double torque_Nm) noexcept;
  // The RPDO of this cycle; false until a position is known: then nothing may be sent.
  bool encode_rpdo(CanFrame& frame) noexcept override;

  // For a drive that watches the controller by life guarding: requests its NMT state, once per heartbeat period.
  // Others: false.
  [[nodiscard]] bool guard_request(CanFrame& frame) const noexcept;

  // ---- the drive's state ----
  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }  // a TPDO was received since the last SYNC
  [[nodiscard]] bool heard() const noexcept { return heard_; }           // a TPDO was ever received
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return cycles_without_tpdo_; }
  [[nodiscard]] DriveState state() const noexcept override { return state_; }
  [[nodiscard]] DriveGoal goal() const noexcept { return goal_; }
  [[nodiscard]] bool following() const noexcept override { return following_; }  // takes targets
  [[nodiscard]] bool torque_mode() const noexcept { return mode_.torque; }
  // 6071h and 6077h in thousandths of the rated torque; actual_torque_Nm() at the joint.
  [[nodiscard]] std::int16_t target_torque() const noexcept { return target_torque_; }
  [[nodiscard]] std::int16_t actual_torque() const noexcept { return actual_torque_; }  // 0 without torque feedback
  [[nodiscard]] double actual_torque_Nm() const noexcept { return actual_torque_ / torque_per_Nm_; }
  // In torque mode, or if the cell's `feedback` has 6077h.
  [[nodiscard]] std::optional<double> torque_share() const noexcept override;
  // If the drive has `gear_torque` in the cell. From a second encoder: stiffness times windup.
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

  [[nodiscard]] DriveFault fault() const noexcept override {
    return fault_;
  }  // the first one, kept until clear_fault()
  void clear_fault() noexcept { fault_ = DriveFault::none; }
  void forget_fault() noexcept override {
    clear_fault();
    old_fault_ = true;
  }
  [[nodiscard]] const Emergency& latest_emergency() const noexcept { return emergency_; }
  [[nodiscard]] std::uint64_t emergencies() const noexcept { return emergencies_; }
  [[nodiscard]] std::uint64_t warnings() const noexcept { return warnings_; }  // EMCYs that are warnings
  [[nodiscard]] std::uint64_t repeated_tpdos() const noexcept { return repeated_tpdos_; }
  // State, fault and latest EMCY in words; not for the cycle.
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
  [[nodiscard]] std::vector<SdoStep> profile_steps() const;  // without those that the cell skips
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
  bool torque_feedback_;                     // in TPDO1, after the position
  std::optional<std::uint8_t> torque_byte_;  // byte of 6077h in the optional feedback
  std::optional<std::uint8_t> mode_byte_;    // byte of 6061h in that feedback: it is watched
  std::optional<std::uint8_t> gear_torque_byte_;
  std::vector<std::string> losses_;
  std::string fixed_by_eds_;  // objects that the EDS has as read-only; cleared by note_losses()
  CountScale scale_;
  double torque_per_Nm_ = 1.0;  // signed
  HeartbeatConsumer heartbeat_;
  DriveGoal goal_ = DriveGoal::none;
  DriveState state_ = DriveState::unknown;
  DriveFault fault_ = DriveFault::none;
  std::uint16_t statusword_ = 0;
  std::uint16_t controlword_ = 0;
  std::int32_t actual_counts_ = 0;
  std::int32_t target_counts_ = 0;
  std::int16_t target_torque_ = 0, actual_torque_ = 0;
  std::int16_t extra_torque_ = 0;  // the value at torque_byte_
  std::int32_t gear_torque_ = 0;   // counts
  std::uint64_t boot_ups_at_start_ = 0;
  std::uint32_t cycles_without_tpdo_ = 0;
  int held_ = 0;  // SYNCs that latched a target equal to the actual position, in the state switched on
  bool held_pending_ = false;
  bool cycling_ = false;
  bool old_fault_ = true;  // no state but fault has been seen since operation was first requested
  bool fresh_ = false;
  bool heard_ = false;
  bool following_ = false;
  Emergency emergency_{};
  std::uint64_t emergencies_ = 0;
  std::uint64_t repeated_tpdos_ = 0;
  std::uint64_t warnings_ = 0;
  std::uint32_t tpdos_in_cycle_ = 0, doubled_cycles_ = 0;  // doubled_cycles_: consecutive cycles with more than one
  std::int8_t shown_mode_ = 0;                             // the value at mode_byte_
  // Statusword (with bit 16 set) when enabling was abandoned before the drive took targets; else 0.
  std::uint32_t stuck_ = 0;
};

}  // namespace proxarm::fieldbus
