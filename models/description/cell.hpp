// A cell as its file states it: the arm, its tool, the buses, a drive per joint, the sensor, the limits.
//
// Plain numbers and strings, in SI units unless the name says otherwise; no behaviour. Loaded by load_cell(), used by
// the controller, by the field bus and, for the far end of the wire, by the simulated arm.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "models/description/sensor_choices.hpp"
#include "models/description/supervision.hpp"

namespace proxarm::description {

class YamlNode;

// A pose as files give it: metres, and roll, pitch, yaw in radians (fixed axes x, y, z: R = Rz(y) Ry(p) Rx(r), as
// URDF).
struct PoseDescription {
  std::array<double, 3> position_m{};
  std::array<double, 3> rpy_rad{};

  bool operator==(const PoseDescription&) const = default;
};

struct BusDescription {
  std::string name;
  std::int64_t bitrate = 1'000'000;  // bit/s, arbitration phase
  std::int64_t data_bitrate = 0;     // bit/s, CAN FD data phase; 0 for a classic bus

  bool operator==(const BusDescription&) const = default;
};

// A line with Modbus drives, a Modbus sensor, or both: a TCP connection to each of them, or one serial line for all. A
// CAN bus it is not: SYNC,
// `--bus` and the bus budget know nothing of it.
struct ModbusLineDescription {
  std::string name;
  std::string host;    // TCP: numeric IPv4 address; empty for a serial line
  int port = 502;      // TCP
  std::string device;  // RTU: such as /dev/ttyUSB0
  int baud = 115200;
  std::string parity = "even";  // none, even, odd
  int stop_bits = 1;
  bool echo = false;  // RTU: the adapter receives what it sends, as some on RS-485 do

  [[nodiscard]] bool serial() const noexcept { return host.empty(); }

  bool operator==(const ModbusLineDescription&) const = default;
};

// The behaviour of a joint's drive that only a simulation needs to know.
struct SimulatedDrive {
  double coulomb_friction_Nm = 0.0;  // at the joint, motor side of the gear
  double viscous_friction_Nms_per_rad = 0.0;
  double gear_damping_Nms_per_rad = 0.0;  // of the gear's elasticity
  double gear_stiffness_ratio = 1.0;      // real stiffness over gear_stiffness_Nm_per_rad: no data sheet is exact
  double backlash_rad = 0.0;              // total play at the joint
  double gear_hysteresis_rad = 0.0;       // how wide the loop of torque over windup is where the torque is 0
  double torque_ripple_Nm = 0.0;          // amplitude of the motor's, at the joint, with current or without
  int torque_ripple_per_revolution = 6;   // periods of it in a turn of the motor
  double max_torque_Nm = 0.0;             // current limit, as torque at the joint
  // Of `gear_torque`, beside what is true: a factor, a constant, a standard deviation of white noise, and how wide the
  // loop of readings is over the true torque.
  double gear_torque_ratio = 1.0, gear_torque_offset_Nm = 0.0, gear_torque_noise_Nm = 0.0;
  double gear_torque_hysteresis_Nm = 0.0;
  double brake_torque_Nm = 0.0;        // that the closed brake holds or brakes with; 0: without limit
  double brake_delay_s = 0.0;          // from the power being gone to the brake being closed
  double position_gain_per_s = 0.0;    // outer loop of the cascade
  double velocity_bandwidth_Hz = 0.0;  // inner loop
  double velocity_feedforward = 1.0;   // of the interpolated setpoint
  double acceleration_feedforward = 1.0;
  double servo_rate_Hz = 4000.0;
  // "strict", "latching", "lazy", "holding", "insisting": sim/canopen/stack_behaviour.hpp
  std::string stack = "strict";
  std::optional<double> brake_release_s;  // from enabling to where the target is followed; none: 0.03

  bool operator==(const SimulatedDrive&) const = default;
};

// How a drive with an incremental encoder finds its zero after power on: its own homing, CiA 402's mode 6.
struct HomingDescription {
  int method = 0;                        // 6098h
  double speed_rad_per_s = 0.0;          // 6099h:01, towards the switch or stop; at the joint
  double slow_speed_rad_per_s = 0.0;     // 6099h:02, towards the zero
  double acceleration_rad_per_s2 = 0.0;  // 609Ah
  double angle_rad = 0.0;                // of the joint where the zero is; its counts there go to 607Ch
  double timeout_s = 60.0;

  bool operator==(const HomingDescription&) const = default;
};

// Objects that a CANopen drive has elsewhere than the profile CiA 402 says, as index << 8 | sub-index.
struct DriveObjects {
  std::uint32_t target = 0;  // 0: what the mode has, 607Ah, 60C1h:01 or 6071h
  std::uint32_t controlword = 0x604000, statusword = 0x604100, position = 0x606400, torque = 0x607700;
  std::uint32_t mode = 0x606000, mode_display = 0x606100, supported_modes = 0x650200;
  std::uint32_t interpolation_value = 0x60C201, interpolation_index = 0x60C202;

  bool operator==(const DriveObjects&) const = default;
};

// One more object in the drive's TPDO1.
struct DriveFeedback {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 0;     // 8, 16, 32

  bool operator==(const DriveFeedback&) const = default;
};

// Of `gear_torque`: what comes later damps nothing at the frequencies that arms swing with.
inline constexpr double longest_gear_torque_delay_s = 0.005;

// How a drive tells the torque of its joint's gear: by a torque sensor on the link's side, or by a second encoder
// there, whose angle the gear's windup is found from. It is in TPDO1, last.
struct GearTorque {
  std::uint32_t object = 0;            // index << 8 | sub-index
  std::uint8_t bits = 16;              // 16, 32; signed
  double Nm_per_count = 0.0;           // by the joint's sense, may be negative; 0: a second encoder
  double counts_per_revolution = 0.0;  // of the second encoder, at the joint, likewise
  double delay_s = 0.0;                // from the gear to the SYNC whose TPDO has it

  bool operator==(const GearTorque&) const = default;
};

// An object that is written before the PDOs are mapped, and read back.
struct StartUpWrite {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 0;     // 8, 16, 32
  std::uint32_t value = 0;   // as the bytes are

  bool operator==(const StartUpWrite&) const = default;
};

// What stops a drive by itself when the controller is gone.
enum class StopsBy : std::uint8_t {
  heartbeat,       // 1016h: it misses the controller's heartbeat
  setpoint_timer,  // 1400h:05 alone: it misses its setpoints
  life_guarding,   // 100Ch, 100Dh: nobody asks for its state any more
};

// What a drive needs to come up besides what the profile has, as its manual or its stack wants it.
struct BringUp {
  std::optional<double> enable_timeout_s;  // from where operation is wanted to where it takes targets; none: the
                                           // session's, 5 s
  // cia402:
  double start_timeout_s = 2.0;     // until it first answers, and until a change of its NMT state shows
  double answer_timeout_s = 0.2;    // of each SDO request, which is sent three times
  bool shows_mode_enabled = false;  // 6061h shows the mode only once operation is enabled
  StopsBy stops_by = StopsBy::heartbeat;
  std::uint16_t controlword_bits = 0;  // set with `enable operation`, besides the mode's own
  std::vector<std::uint32_t> skip;     // optional objects that aren't touched, as index << 8 | sub-index
  std::vector<StartUpWrite> write;     // in this order

  bool operator==(const BringUp&) const = default;
};

// Bits of the controlword that a mode or a maker may want set (CiA 402: 4 to 6 and 9, the mode's; 11 to 15, the
// maker's).
inline constexpr std::uint16_t free_controlword_bits = 0xFA70;

struct DriveDescription {
  std::string joint;      // name in the URDF; of a linear one, read m for rad, N for Nm and kg for kg m² all along
  std::string bus;        // CAN bus or Modbus line
  std::uint8_t node = 0;  // 1..127; of a Modbus drive its unit, 1..247
  std::string profile = "cia402";  // or "modbus"
  std::string description;         // modbus: path of the register map, absolute (in the file: relative to its folder)
  std::string mode = "csp";        // "csp", "ip", "cst"
  std::string eds;                 // cia402: path of the maker's EDS or DCF file, absolute; may be empty
  DriveObjects objects;            // cia402
  bool fd = false;                 // cia402: its PDOs are CAN FD frames at the data bitrate
  std::vector<DriveFeedback> feedback;       // cia402: behind what the controller needs, for the record
  std::optional<GearTorque> gear_torque;     // cia402, modes csp and ip; none: it isn't measured
  std::optional<std::uint32_t> device_type;  // expected in 1000h; none: what `eds` says, or a CiA 402 servo drive's
  double counts_per_motor_revolution = 1048576.0;
  double gear_ratio = 100.0;       // motor revolutions per joint revolution
  int direction = 1;               // +1 or −1: sign of counts against the URDF's joint
  std::int32_t offset_counts = 0;  // counts at joint angle zero
  std::array<double, 2> range_rad{};
  double max_speed_rad_per_s = 0.0;
  double max_acceleration_rad_per_s2 = 0.0;
  double rated_torque_Nm = 0.0;  // 6076h times the gear ratio, what 1000 in 6071h and 6077h is at the joint;
                                 // 0: not said
  double max_torque_Nm = 0.0;    // mode cst: what the joint may be asked for; others: what the drive has at
                                 // the joint, which its setpoints are kept to; 0: not said
  BringUp bring_up;
  bool word_order_tried = false;            // modbus: somebody has seen that the file's word_order is this drive's
  std::optional<HomingDescription> homing;  // of an incremental encoder; none: an absolute one
  double rotor_inertia_kg_m2 = 0.0;         // reflected to the joint
  double position_bandwidth_Hz = 100.0;     // of the drive's position loop, as its maker or a test states it: the lag
                                            // that the stability check counts on
  double gear_stiffness_Nm_per_rad = 0.0;   // 0: taken as rigid; used to compensate gravity's deflection
  std::optional<double> gear_damping_Nms_per_rad;  // for the stability check; none: not known
  SimulatedDrive simulation;

  [[nodiscard]] double counts_per_rad() const noexcept;                // signed by `direction`
  [[nodiscard]] double angle_rad(std::int32_t counts) const noexcept;  // of the motor, at the joint
  [[nodiscard]] bool on_can() const noexcept { return profile != "modbus"; }

  bool operator==(const DriveDescription&) const = default;
};

struct ToolDescription {
  double mass_kg = 0.0;  // all that hangs after the sensor: handle and what is fixed to it
  std::array<double, 3> centre_of_mass_S_m{};
  std::array<double, 6> inertia_kg_m2{};  // ixx iyy izz ixy ixz iyz about the centre of mass, axes of S
  PoseDescription handle_S;               // X_ST: the rendered point and its axes
  std::string shape;                      // path of a tool file, absolute; empty: what is rendered is a point

  bool operator==(const ToolDescription&) const = default;
};

struct SensorPlacement {
  std::string description;  // path of the sensor's file, absolute (in the cell's file: relative to its folder)
  std::string bus;
  std::uint32_t base_id = 0;  // meaning is the sensor's own; some have none
  SensorChoices choices;      // keys settings, force_range_N, torque_range_Nm
  std::string link;           // link of the URDF that carries it (the flange)
  PoseDescription pose_link;  // X_LS
  double noise_N = 0.0;       // simulated sensor only: standard deviation per axis
  double noise_Nm = 0.0;
  // The stability check counts on these three.
  double sample_rate_Hz = 0.0;  // of its converter, not synchronised with anything
  double bandwidth_Hz = 0.0;    // its own low-pass; 0: none
  double delay_s = 0.0;         // by which its readings are older than that
  // By which its zero may differ from the one that is known when it is tared; 0: zero_drift_N() of its range.
  double zero_drift_N = 0.0;

  bool operator==(const SensorPlacement&) const = default;
};

inline constexpr double longest_sensor_delay_s = 0.1;

// A box with its faces along the axes of W.
struct BoxDescription {
  std::array<double, 3> min_m{};
  std::array<double, 3> max_m{};

  bool operator==(const BoxDescription&) const = default;
};

struct CellLimits {
  double max_tool_speed_m_per_s = 0.5;
  double max_elbow_speed_m_per_s = 0.5;  // of elbow and wrist; a cell that doesn't say has the tool's
  double max_tool_acceleration_m_per_s2 = 20.0;
  double max_turning_speed_rad_per_s = 2.0;               // of the tool, where the hand may turn it
  double max_turn_rad = 0.7;                              // of the tool, from its orientation at the start; 0 to 3
  std::optional<double> max_tilt_rad{}, max_twist_rad{};  // 0 to 3: of an axis of the tool, and about it
  std::array<double, 3> tilt_axis{0.0, 0.0, 1.0};         // in T, unit
  double max_force_N = 200.0;                             // above it the sensor's reading is taken as a fault
  double max_power_W = 80.0;          // that the arm gives to the hand or takes from it; 0: no limit
  double leash_m = 0.02;              // from the tool, as measured, to the proxy
  double following_error_rad = 1e-3;  // of a drive that stands still: beyond it, setpoints wait for it
  std::array<double, 3> workspace_min_m{-std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity()};  // of the rendered point, in W
  std::array<double, 3> workspace_max_m{std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity()};
  std::vector<BoxDescription> keep_out;  // where the rendered point may not go
  double setpoint_bandwidth_Hz = 25.0;   // of the filter that keeps elastic gears from ringing; 0: none

  bool operator==(const CellLimits&) const = default;
};

// What a cell says it is used for, and what is therefore required of it (profile.hpp).
enum class Profile : std::uint8_t { none, hand_guiding };

struct Cell {
  std::filesystem::path file;  // as given, made absolute
  std::string name;
  std::filesystem::path urdf;  // resolved
  PoseDescription base_W;      // X_WB
  std::array<double, 3> gravity_W_m_per_s2{0.0, 0.0, -9.80665};
  std::vector<double> start_rad;  // joint angles at the start, in the order of `drives`
  ToolDescription tool;
  std::vector<BusDescription> buses;
  std::vector<ModbusLineDescription> modbus_lines;
  std::vector<DriveDescription> drives;
  SensorPlacement sensor;
  CellLimits limits;
  Profile profile = Profile::none;
  std::string passivity = "auto";  // "off", "observe", "auto", "on" (--passivity); off with drives that take torques
  SupervisionDescription supervision;
  std::optional<EnablingInputDescription> enabling_input;
  double receive_window = 0.45;  // of the timestep, in which feedback and samples are taken; then setpoints leave
  double default_period_s = 1e-3;
  double default_mass_kg = 4.0, default_damping_Ns_per_m = 0.0;
  std::string default_scene;  // path, absolute (in the cell's file: relative to its folder); may be empty
  std::string default_hand;   // likewise

  bool operator==(const Cell&) const = default;
};

// Reads and checks a cell: all that can be checked without its URDF. The file's keys are the names of the fields above,
// nested as the structs are, but for limits.workspace_m {min, max} and limits.keep_out_m [{min, max}, …]; docs/files.md
// says what may be left out. Throws SetupError, with file, line and key.
Cell load_cell(const std::filesystem::path& file);
// The same of a file that has been read already.
Cell read_cell(const YamlNode& root);
// The cell's default_scene or default_hand (KEY), which a run may do without, must be a file. Throws SetupError.
void require_default_file(const Cell& cell, const char* key, const std::filesystem::path& path);

}  // namespace proxarm::description
