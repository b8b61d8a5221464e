// A simulated CANopen servo drive with the CiA 402 profile: cyclic synchronous position (6060h = 8), interpolated
// position (7), cyclic synchronous torque (10).
//
// At each SYNC it latches the target (607Ah) received since the last one, samples position and statusword for its
// transmit PDO, and reaches the target within the interpolation period (60C2h), at the next SYNC. On a SYNC without a
// new target it decelerates within a limit (6085h) and never jumps; a torque (6071h, limited by 6072h) acts until the
// next one. The drive stops by itself, also from a torque, when one of these fails:
//   SYNC          2010h:01 interpolation periods without one     EMCY 8700h, fault reaction 605Eh
//   receive PDO   its event timer, 1400h:05                      EMCY 8250h, reaction 6007h
//   heartbeat     1016h                                          EMCY 8130h, reaction 6007h, then 1029h
//
// It refuses operation (stays switched on, statusword bit 7 set, reason in 2001h) while 6061h doesn't show the mode,
// 60C2h isn't set or doesn't match the SYNCs, or the target isn't at the actual position.
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

// For a drive with an incremental encoder: it counts from its position at power on, until it is homed (mode 6) at its
// switch.
struct IncrementalEncoder {
  std::int32_t home_counts = 0;  // axis position at the switch
  bool homed = false;            // before this power on
};

struct DriveDeviceConfig {
  CanopenSlaveConfig canopen;
  std::uint32_t following_error_window_counts = 100'000;  // 6065h
  std::uint16_t following_error_time_ms = 10;             // 6066h
  std::uint32_t quick_stop_deceleration = 1'000'000;      // 6085h, counts/s²
  std::uint32_t profile_deceleration = 500'000;           // 6084h, counts/s²: slow-down ramp
  std::uint32_t rated_torque_mNm = 1000;                  // 6076h, of the motor
  std::int32_t position_min = 0, position_max = 0;        // 607Dh; equal: no limit
  std::optional<IncrementalEncoder> incremental;          // nullopt: absolute encoder
  std::int64_t brake_release_ns = 30'000'000;             // from enabling until it follows the target
  std::uint8_t sync_tolerance_periods = 3;                // 2010h:01; 0: SYNC isn't watched
  // Objects that differ from the profile, as index << 8 | sub-index.
  description::DriveObjects objects{};
  std::uint32_t position_target = 0x607A00, interpolated_target = 0x60C101, torque_target = 0x607100;
  std::optional<description::GearTorque> gear_torque{};  // how it reports its gear torque
  const description::EdsFile* eds = nullptr;  // file of its dictionary (eds_objects.hpp); nullptr: default dictionary
};

// Why operation was refused, 2001h.
enum class RefusalReason : std::uint8_t {
  none = 0,
  mode_not_displayed = 1,
  interpolation_period_not_set = 2,
  no_sync = 3,
  sync_period_mismatch = 4,    // average of eight SYNCs differs from 60C2h by more than 20 %
  target_far_from_actual = 5,  // by more than the following-error window
  not_operational = 6,         // NMT
};

class DriveDevice final : public BusDevice, private CanopenApplication {
 public:
  DriveDevice(const DriveDeviceConfig& config, ServoAxis& axis, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  // Precondition: the physics has been advanced to this time. Call at least once a millisecond.
  void on_time(std::int64_t time_ns) noexcept override;

  [[nodiscard]] DriveState state() const noexcept { return state_; }
  [[nodiscard]] std::uint16_t statusword() const noexcept;
  [[nodiscard]] int last_transition() const noexcept { return last_transition_; }  // CiA 402 number
  [[nodiscard]] CanopenSlave& canopen() noexcept { return slave_; }
  [[nodiscard]] const CanopenSlave& canopen() const noexcept { return slave_; }

  // A fault of the drive, with its EMCY code: transition 13. Stays until it is reset.
  void inject_fault(std::uint16_t code, std::int64_t time_ns) noexcept;
  // true: refuses to write 60C2h while operation is enabled (08000022h).
  void fix_period_while_enabled(bool fixed) noexcept { period_fixed_ = fixed; }
  // Open: no power, and no command leaves "switch on disabled".
  void open_sto(bool open) noexcept;
  // show_mode_late(): 6061h shows the mode only while operation is enabled. never_say_following(): statusword bit 12
  // stays 0. show_mode(): 6061h shows `mode` instead of 6060h.
  void show_mode_late(bool late) noexcept { shows_mode_late_ = late; }
  void never_say_following(bool on) noexcept { never_following_ = on; }
  // Reports that it follows (bit 12) only while these bits of the controlword are set.
  void want_controlword_bits(std::uint16_t bits) noexcept { wanted_bits_ = bits; }
  void show_mode(std::optional<std::int8_t> mode) noexcept { shown_mode_ = mode; }
  // 60FDh, the inputs wired to it.
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
  // Relative to the drive's zero.
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
  double homing_counts_ = 0.0;             // axis position of the homing motion
  std::int64_t homing_ns_ = 0;             // time of homing_counts_
  std::int64_t zero_counts_ = 0;           // axis position of the drive's zero
  std::array<ObjectEntry, 2> unlisted_{};  // replace 2001h and 2010h:01 in a drive with its maker's dictionary
  std::int64_t period_ns_ = 0;             // 60C2h; 0: not set

  // Entries used in every cycle.
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
  bool stopping_ = false;  // on a ramp that ends in after_stop_
  DriveState after_stop_ = DriveState::switch_on_disabled;
  int after_stop_transition_ = 0;
  std::uint16_t fault_code_ = 0;  // latched fault; 0: none
  bool target_taken_ = false;     // since power on
  bool target_fresh_ = false;     // 607Ah was written since the last SYNC
  bool following_ = false;        // bit 12
  bool target_limited_ = false;   // by 607Dh or 6072h
  std::int64_t following_error_since_ns_ = never;
  std::int64_t last_sync_ns_ = never;
  std::int64_t intervals_ns_[intervals] = {};
  int interval_count_ = 0, interval_next_ = 0;
};

}  // namespace proxarm::sim
