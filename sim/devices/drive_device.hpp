// A simulated CANopen servo drive with the CiA 402 profile. Its modes are cyclic synchronous position (6060h = 8),
// interpolated position (7) and cyclic synchronous torque (10).
//
// At each SYNC the drive latches the target (607Ah) that it has received since the last SYNC, and samples position and
// statusword for its transmit PDO. It reaches the target one interpolation period (60C2h) later, at the next SYNC. If
// no new target has come, it decelerates within a limit (6085h) and never jumps. A torque (6071h, limited by 6072h)
// acts until the next torque comes. The drive stops by itself, in torque mode too, when one of these fails:
//   SYNC          missing for 2010h:01 interpolation periods     EMCY 8700h, fault reaction 605Eh
//   receive PDO   missing for its event timer, 1400h:05          EMCY 8250h, reaction 6007h
//   heartbeat     missing for the time in 1016h                  EMCY 8130h, reaction 6007h, then 1029h
//
// The drive refuses operation while 6061h doesn't show the mode, while 60C2h isn't set or doesn't match the SYNCs, or
// while the target isn't at the actual position. It then stays switched on, sets statusword bit 7, and gives the reason
// in 2001h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"
#include "sim/canopen/canopen_slave.hpp"
#include "sim/devices/drive_state_machine.hpp"
#include "sim/devices/servo_axis.hpp"

namespace proxarm::sim {

// The incremental encoder of a drive. The encoder counts from its position at power on until the drive is homed (mode
// 6) at its switch.
struct IncrementalEncoder {
  std::int32_t home_counts = 0;  // position of the axis at the switch
  bool homed = false;            // true: the drive was homed before this power on
};

struct DriveDeviceConfig {
  CanopenSlaveConfig canopen;
  std::uint32_t following_error_window_counts = 100'000;  // 6065h: window of the following error
  std::uint16_t following_error_time_ms = 10;             // 6066h
  std::uint32_t quick_stop_deceleration = 1'000'000;      // 6085h, in counts/s²
  std::uint32_t profile_deceleration = 500'000;           // 6084h: deceleration of the slow-down ramp, in counts/s²
  std::uint32_t rated_torque_mNm = 1000;                  // 6076h: rated torque of the motor
  std::int32_t position_min = 0, position_max = 0;        // 607Dh; no limit if both are equal
  std::optional<IncrementalEncoder> incremental;          // nullopt: the encoder is absolute
  std::int64_t brake_release_ns = 30'000'000;             // time from enabling until the drive follows the target
  std::uint8_t sync_tolerance_periods = 3;                // 2010h:01; 0: SYNC isn't watched
  // Objects that the drive has in place of the profile's, as index << 8 | sub-index.
  description::DriveObjects objects{};
  std::uint32_t position_target = 0x607A00, interpolated_target = 0x60C101, torque_target = 0x607100;
  std::optional<description::GearTorque> gear_torque{};  // how the drive reports its gear torque
  // File of the drive's object dictionary (eds_objects.hpp); nullptr: default dictionary.
  const description::EdsFile* eds = nullptr;
};

// The reason why operation was refused, 2001h.
enum class RefusalReason : std::uint8_t {
  none = 0,
  mode_not_displayed = 1,
  interpolation_period_not_set = 2,
  no_sync = 3,
  sync_period_mismatch = 4,    // the mean interval of eight SYNCs differs from 60C2h by more than 20 %
  target_far_from_actual = 5,  // the difference exceeds the following error window
  not_operational = 6,         // the NMT state isn't operational
};

class DriveDevice final : public BusDevice, private CanopenApplication {
 public:
  DriveDevice(const DriveDeviceConfig& config, ServoAxis& axis, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  // Must be called at least once a millisecond. Precondition: the physics has been advanced to time_ns.
  void on_time(std::int64_t time_ns) noexcept override;

  [[nodiscard]] DriveState state() const noexcept { return state_; }
  [[nodiscard]] std::uint16_t statusword() const noexcept;
  // The number of the transition in CiA 402.
  [[nodiscard]] int last_transition() const noexcept { return last_transition_; }
  [[nodiscard]] CanopenSlave& canopen() noexcept { return slave_; }
  [[nodiscard]] const CanopenSlave& canopen() const noexcept { return slave_; }

  // Makes the drive trip with this EMCY code (transition 13). The fault stays until it is reset.
  void inject_fault(std::uint16_t code, std::int64_t time_ns) noexcept;
  // true: the drive refuses to write 60C2h while operation is enabled (08000022h).
  void fix_period_while_enabled(bool fixed) noexcept { period_fixed_ = fixed; }
  // true: STO is open; the motor has no power, and no command leaves "switch on disabled".
  void open_sto(bool open) noexcept;
  // true: 6061h shows the mode only while operation is enabled.
  void show_mode_late(bool late) noexcept { shows_mode_late_ = late; }
  // true: statusword bit 12 stays 0.
  void never_say_following(bool on) noexcept { never_following_ = on; }
  // Makes the drive report that it follows targets (bit 12) only while these bits of the controlword are set.
  void want_controlword_bits(std::uint16_t bits) noexcept { wanted_bits_ = bits; }
  // Makes 6061h show `mode` instead of the value of 6060h; nullopt ends that.
  void show_mode(std::optional<std::int8_t> mode) noexcept { shown_mode_ = mode; }
  // Sets 60FDh, the digital inputs that are wired to the drive.
  void set_digital_inputs(std::uint32_t bits) noexcept { digital_inputs_->set(bits); }

 private:
  static constexpr std::int64_t never = INT64_MIN;
  static constexpr int intervals = 8;

  void on_sync(std::int64_t time_ns) override;
  void on_nmt_state(NmtState from, NmtState to, std::int64_t time_ns) override;
  void on_communication_lost(std::uint16_t code, std::int64_t time_ns) override;
  void on_reset(std::int64_t time_ns) override;

  void add_objects(const DriveDeviceConfig& config);
  ObjectEntry& add(std::uint32_t address, DataType type, Access access, std::int64_t value, bool mappable = false);
  void add_own_objects(const DriveDeviceConfig& config);
  void add_option_codes();
  void add_cyclic_objects(const DriveDeviceConfig& config);
  void on_controlword();
  void execute(DriveTransition transition);
  void enter(DriveState to, int transition);
  void begin_stop(DriveState after, int transition, double deceleration_counts_per_s2);
  void finish_stop();
  void power_off() noexcept;
  void trip(std::uint16_t code, std::uint8_t register_bits);
  void react_to_connection(std::int64_t option, std::uint16_t code);
  [[nodiscard]] RefusalReason refusal() const noexcept;
  [[nodiscard]] bool energised() const noexcept;
  [[nodiscard]] bool latches() const noexcept { return slave_.config().stack == StackBehaviour::latching; }
  [[nodiscard]] bool brake_open() const noexcept { return powered_ && now_ns_ >= brake_open_ns_; }
  void set_period();
  [[nodiscard]] double deceleration(std::uint16_t object) const noexcept;
  void latch_target();
  void latch_torque();
  void add_homing_objects();
  void start_homing();
  void advance_homing();
  void power_on_encoder() noexcept;
  [[nodiscard]] bool homes() const noexcept;
  // position() and demand() are relative to the drive's zero.
  [[nodiscard]] std::int64_t position() const noexcept { return axis_.position_counts() - zero_counts_; }
  [[nodiscard]] std::int64_t demand() const noexcept { return axis_.demand_counts() - zero_counts_; }
  void supervise_sync();
  void supervise_following_error();
  void publish() noexcept;
  void show_mode() noexcept;

  CanopenSlave slave_;
  ServoAxis& axis_;
  std::int64_t brake_release_ns_;
  std::uint32_t sdo_request_id_;
  enum class HomingState : std::uint8_t { none, running, attained, failed };
  std::optional<IncrementalEncoder> incremental_;
  HomingState homing_ = HomingState::none;
  double homing_counts_ = 0.0;    // position of the axis that the homing motion has reached
  std::int64_t homing_ns_ = 0;    // time of homing_counts_
  std::int64_t zero_counts_ = 0;  // position of the axis at the drive's zero
  // Stand-ins for 2001h and 2010h:01 in a drive with its maker's dictionary.
  std::array<ObjectEntry, 2> unlisted_{};
  std::int64_t period_ns_ = 0;  // period in 60C2h; 0: 60C2h isn't set

  // Dictionary entries that are used in every cycle.
  ObjectEntry *controlword_ = nullptr, *statusword_ = nullptr, *target_ = nullptr, *position_ = nullptr,
              *demand_ = nullptr, *velocity_ = nullptr, *following_error_ = nullptr, *torque_ = nullptr,
              *mode_ = nullptr, *mode_display_ = nullptr, *error_code_ = nullptr, *refusal_ = nullptr,
              *period_value_ = nullptr, *period_index_ = nullptr, *following_window_ = nullptr,
              *interpolated_target_ = nullptr, *sync_tolerance_ = nullptr, *target_torque_ = nullptr,
              *max_torque_ = nullptr, *gear_torque_ = nullptr, *digital_inputs_ = nullptr;

  std::int64_t now_ns_ = 0;
  DriveState state_ = DriveState::not_ready_to_switch_on;
  int last_transition_ = 0;
  std::uint16_t controlword_before_ = 0;
  bool powered_ = false;
  bool period_fixed_ = false;
  bool sto_open_ = false, shows_mode_late_ = false, never_following_ = false;
  std::optional<std::int8_t> shown_mode_;
  std::uint16_t wanted_bits_ = 0;
  std::int64_t brake_open_ns_ = 0;
  bool stopping_ = false;  // the axis is on a ramp, after which the drive enters after_stop_
  DriveState after_stop_ = DriveState::switch_on_disabled;
  int after_stop_transition_ = 0;
  std::uint16_t fault_code_ = 0;  // code of the latched fault; 0: no fault
  bool target_taken_ = false;     // a target was taken since the power stage was last switched on
  bool target_fresh_ = false;     // 607Ah was written since the last SYNC
  bool following_ = false;        // bit 12 of the statusword
  bool target_limited_ = false;   // 607Dh or 6072h limits the target
  std::int64_t following_error_since_ns_ = never;
  std::int64_t last_sync_ns_ = never;
  std::int64_t intervals_ns_[intervals] = {};
  int interval_count_ = 0, interval_next_ = 0;
};

}  // namespace proxarm::sim
