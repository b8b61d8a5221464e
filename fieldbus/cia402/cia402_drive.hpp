// One CiA 402 servo drive in a cyclic mode (positions or torques), as the master's cycle sees it.
//
// Wire, every SYNC (identifiers of the predefined connection set): TPDO1 180 + node and RPDO1 200 + node, what they
// carry by mode in cia402_mode.hpp; plus EMCY 080 + node and heartbeat 700 + node, as they come.
//
// A cycle: on_sync(); on_frame() for what comes in; set_target_rad() where following(); encode_rpdo(), send. All of
// that is noexcept and allocates nothing. The target follows the actual position until the drive itself says that it
// follows (operation enabled and statusword bit 12: the brake is open), and at least three SYNCs have latched such a
// target before 0F (enable operation) is sent: otherwise the axis would jump. A torque may be set at any time: the
// drive applies it once its brake is open, and the axis falls where it isn't what holds it.
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

// What all drives of a session share. Times that go on the wire as milliseconds have that unit.
struct DriveSettings {
  std::int64_t period_ns = 1'000'000;              // of SYNC; must fit 60C2h and 1006h exactly
  std::uint8_t master_node = 127;                  // whose heartbeat the drives consume
  std::uint16_t master_heartbeat_ms = 20;          // how often the cycle sends it
  std::uint16_t master_heartbeat_timeout_ms = 60;  // 1016h:01: without it the drives stop by themselves
  std::uint16_t drive_heartbeat_ms = 50;           // 1017h
  std::uint16_t drive_heartbeat_timeout_ms = 150;  // of the master for the drives
  // false: the drives' heartbeats end with the set-up. A TPDO at every SYNC, which ends with NMT operational as well,
  // says the same fifty times as often, and heartbeats that coincide would cost a full bus its setpoints' deadline.
  bool heartbeat_in_operation = true;
  std::uint16_t rpdo_timeout_periods = 5;  // 1400h:05, rounded up to whole milliseconds
  // The same in torque mode, rounded down: the last torque acts until then, and a third one missed must be the last.
  std::uint16_t torque_timeout_periods = 3;
  double following_error_window_rad = 0.05;    // 6065h, at the joint
  std::uint16_t following_error_time_ms = 10;  // 6066h
  // An object of 32 bits (index << 8 | sub-index), such as the digital inputs, 60FDh, that this drive sends in TPDO2 at
  // every SYNC; 0: none. Not for decoding here.
  std::uint32_t inputs_object = 0;
  SdoSequenceConfig sdo{};
  std::int64_t nmt_timeout_ns = 2'000'000'000;  // for a change of NMT state to show in the drive's heartbeat

  // The drives stop within this time of the controller's last word, whatever else they watch: its heartbeat comes three
  // times as often.
  void stop_without_controller(double within_s) noexcept;
  // 1016h:01, by which a drive watches the controller.
  [[nodiscard]] std::uint32_t consumer_heartbeat() const noexcept {
    return static_cast<std::uint32_t>(master_node) << 16 | master_heartbeat_timeout_ms;
  }
  // 100Dh, of a drive that watches the controller by life guarding; 100Ch is the heartbeat's period.
  [[nodiscard]] std::uint8_t life_time_factor() const noexcept {
    return static_cast<std::uint8_t>(std::clamp(master_heartbeat_timeout_ms / master_heartbeat_ms, 1, 255));
  }
  void validate() const;  // throws SetupError
};

// An object that depends on the period: what it is to be, and what it was.
struct PeriodStep {
  ObjectAddress object{};
  std::uint8_t bytes = 4;
  std::uint32_t value = 0, old_value = 0;
  bool is_optional = false;  // left to the maker
};
using PeriodSteps = std::array<PeriodStep, 4>;

class ServoDrive final : public CyclicDrive {
 public:
  // Throws SetupError where the description or the settings can't be what a drive is given, by the profile or its EDS.
  ServoDrive(const description::DriveDescription& drive, const DriveSettings& settings);

  // ---- set-up ----
  // By the profile, and by the drive's EDS where it has one (eds_check.hpp).
  [[nodiscard]] std::vector<SdoStep> configuration_steps() const;
  // After configuration_steps() was answered: what was lost, by the drive itself. Not for the cycle.
  void note_losses(const std::vector<std::string>& losses);
  // A transmit PDO that the drive doesn't take: true where that is for feedback which nothing depends on. It is left
  // out from now on, and configuration_steps() are others.
  bool give_up_feedback(const SdoStep& failed, std::uint32_t abort_code);
  // What the drive lacks, and what is lost by it, a line each; by its EDS, and once it has been configured by itself.
  [[nodiscard]] std::vector<std::string> losses() const;
  // What is left to write once it is in operational.
  [[nodiscard]] std::vector<SdoStep> operation_steps() const;
  // From one period to another, in the order in which they are written; of 60C2h the part comes first with which the
  // period is the longer one until the other part follows. Both periods are such that a drive can hold them.
  [[nodiscard]] PeriodSteps period_steps(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  // What the master must receive from this node: TPDO1, EMCY, SDO answers, heartbeat.
  [[nodiscard]] std::array<std::uint32_t, 4> wanted_ids() const noexcept;
  // All identifiers that the drive and the master use between them: those, RPDO1 and SDO requests.
  [[nodiscard]] std::array<std::uint32_t, 6> used_ids() const noexcept;
  [[nodiscard]] std::uint8_t node() const noexcept { return description_.node; }
  [[nodiscard]] const description::DriveDescription& description() const noexcept override { return description_; }
  [[nodiscard]] const DriveSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const CountScale& scale() const noexcept { return scale_; }
  // Watching for faults of the wire starts here, once the drive is in operational.
  void start_cycle(std::int64_t now_ns) noexcept;

  // ---- cycle ----
  // A fault that the drive is found in when operation is first wanted (its last controller died, say) is reset on the
  // way; any later one is raised as a fault, and only fault_reset leaves it.
  void request(DriveGoal goal) noexcept override;
  // A SYNC is going out: what was received before it is no longer fresh. Also notices a lost heartbeat.
  void on_sync(std::int64_t now_ns) noexcept override;
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept override;  // true when it was this drive's
  // Takes a new target; false where none is taken: not following() yet, or fault target_out_of_range.
  bool set_target_rad(double angle_rad) noexcept override;
  // In torque mode, at the joint. False, and the torque stays as it was: fault target_out_of_range.
  bool set_target_torque_Nm(double torque_Nm) noexcept;
  // The RPDO of this cycle; false while no position is known yet, and then nothing may be sent.
  bool encode_rpdo(CanFrame& frame) noexcept override;

  // Asks for its NMT state: a drive that watches the controller by life guarding wants that as often as a heartbeat
  // comes. False: it doesn't.
  [[nodiscard]] bool guard_request(CanFrame& frame) const noexcept;

  // ---- what is known of the drive ----
  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }  // a TPDO came since the last SYNC
  [[nodiscard]] bool heard() const noexcept { return heard_; }           // a TPDO came ever
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return cycles_without_tpdo_; }
  [[nodiscard]] DriveState state() const noexcept override { return state_; }
  [[nodiscard]] DriveGoal goal() const noexcept { return goal_; }
  [[nodiscard]] bool following() const noexcept override { return following_; }  // takes targets
  [[nodiscard]] bool torque_mode() const noexcept { return mode_.torque; }
  // 6071h and 6077h, thousandths of the rated torque; the latter as torque at the joint, too.
  [[nodiscard]] std::int16_t target_torque() const noexcept { return target_torque_; }
  [[nodiscard]] std::int16_t actual_torque() const noexcept { return actual_torque_; }  // 0 without torque feedback
  [[nodiscard]] double actual_torque_Nm() const noexcept { return actual_torque_ / torque_per_Nm_; }
  // In torque mode, and of a drive that takes positions where the cell's `feedback` has 6077h.
  [[nodiscard]] std::optional<double> torque_share() const noexcept override;
  // Of a cell whose drive has `gear_torque`; a second encoder's is the stiffness times the windup.
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
  [[nodiscard]] std::uint64_t warnings() const noexcept { return warnings_; }  // EMCYs that stop nothing
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
  [[nodiscard]] std::vector<SdoStep> profile_steps() const;  // without those that the cell has it skip
  void note_skipped();
  bool decode_tpdo(const CanFrame& frame) noexcept;
  void judge_doubled() noexcept;
  [[nodiscard]] bool shows_mode() const noexcept { return !mode_byte_ || shown_mode_ == mode_.number; }
  [[nodiscard]] std::string stuck_text() const;
  void judge_state(bool was_enabled) noexcept;
  void raise(DriveFault fault) noexcept;

  description::DriveDescription description_;
  DriveSettings settings_;
  std::shared_ptr<const description::EdsFile> eds_;  // may be none
  CyclicMode mode_;
  std::uint8_t tpdo_bytes_, rpdo_bytes_;
  bool torque_feedback_;                     // in TPDO1, behind the position
  std::optional<std::uint8_t> torque_byte_;  // of 6077h among the feedback that nothing depends on
  std::optional<std::uint8_t> mode_byte_;    // of 6061h among that feedback: it is watched
  std::optional<std::uint8_t> gear_torque_byte_;
  std::vector<std::string> losses_;
  std::string fixed_by_eds_;  // until the drive itself has been asked
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
  std::int16_t extra_torque_ = 0;  // at torque_byte_
  std::int32_t gear_torque_ = 0;   // counts
  std::uint64_t boot_ups_at_start_ = 0;
  std::uint32_t cycles_without_tpdo_ = 0;
  int held_ = 0;  // SYNCs that latched a target equal to the actual position, in the state switched on
  bool held_pending_ = false;
  bool cycling_ = false;
  bool old_fault_ = true;  // no state other than fault has been seen since operation was first wanted
  bool fresh_ = false;
  bool heard_ = false;
  bool following_ = false;
  Emergency emergency_{};
  std::uint64_t emergencies_ = 0;
  std::uint64_t repeated_tpdos_ = 0;
  std::uint64_t warnings_ = 0;
  std::uint32_t tpdos_in_cycle_ = 0, doubled_cycles_ = 0;  // the latter in a row, with more than one
  std::int8_t shown_mode_ = 0;                             // at mode_byte_
  // Operation was given up before the drive took targets: its statusword then, with bit 16 set; 0: no such thing.
  std::uint32_t stuck_ = 0;
};

}  // namespace proxarm::fieldbus
