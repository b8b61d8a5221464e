// A cell as its file describes it: the arm, its tool, the buses, a drive per joint, the sensor, the limits.
//
// Plain data, in SI units unless a name says otherwise. load_cell() reads it; the controller, the field bus and the
// simulated arm use it.
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

// A pose as in files: metres, and roll, pitch, yaw in radians (fixed axes x, y, z: R = Rz(y) Ry(p) Rx(r), as in URDF).
struct PoseDescription {
  std::array<double, 3> position_m{};
  std::array<double, 3> rpy_rad{};

  bool operator==(const PoseDescription&) const = default;
};

struct BusDescription {
  std::string name;
  std::int64_t bitrate = 1'000'000;  // bit/s, arbitration phase
  std::int64_t data_bitrate = 0;     // bit/s, CAN FD data phase; 0: classic bus

  bool operator==(const BusDescription&) const = default;
};

// A line with Modbus drives, a Modbus sensor, or both: one TCP connection for each of them, or one serial line for all.
// It isn't a CAN bus: SYNC, `--bus` and the bus budget don't include it.
struct ModbusLineDescription {
  std::string name;
  std::string host;    // TCP: numeric IPv4 address; empty for a serial line
  int port = 502;      // TCP
  std::string device;  // RTU: for example /dev/ttyUSB0
  int baud = 115200;
  std::string parity = "even";  // none, even, odd
  int stop_bits = 1;
  bool echo = false;  // RTU: the adapter receives what it sends, as some on RS-485 do

  [[nodiscard]] bool serial() const noexcept { return host.empty(); }

  bool operator==(const ModbusLineDescription&) const = default;
};

// Properties of a joint's drive that only a simulation uses.
struct SimulatedDrive {
  double coulomb_friction_Nm = 0.0;  // at the joint, motor side of the gear
  double viscous_friction_Nms_per_rad = 0.0;
  double gear_damping_Nms_per_rad = 0.0;  // of the elastic gear
  double gear_stiffness_ratio = 1.0;      // real stiffness over gear_stiffness_Nm_per_rad: data sheets aren't exact
  double backlash_rad = 0.0;              // total play at the joint
  double gear_hysteresis_rad = 0.0;       // width of the loop of torque over windup, at zero torque
  double torque_ripple_Nm = 0.0;          // amplitude of the motor's ripple, at the joint, with or without current
  int torque_ripple_per_revolution = 6;   // periods of the ripple in a turn of the motor
  double max_torque_Nm = 0.0;             // current limit, as torque at the joint
  // Errors of the `gear_torque` readings: a factor, an offset, the standard deviation of white noise, and the width of
  // the hysteresis loop over the true torque.
  double gear_torque_ratio = 1.0, gear_torque_offset_Nm = 0.0, gear_torque_noise_Nm = 0.0;
  double gear_torque_hysteresis_Nm = 0.0;
  double brake_torque_Nm = 0.0;        // with which the closed brake holds or brakes; 0: unlimited
  double brake_delay_s = 0.0;          // from loss of power to the closed brake
  double position_gain_per_s = 0.0;    // outer loop of the cascade
  double velocity_bandwidth_Hz = 0.0;  // inner loop
  double velocity_feedforward = 1.0;   // share of the interpolated setpoint's velocity
  double acceleration_feedforward = 1.0;
  double servo_rate_Hz = 4000.0;
  // "strict", "latching", "lazy", "holding", "insisting": sim/canopen/stack_behaviour.hpp
  std::string stack = "strict";
  std::optional<double> brake_release_s;  // from enabling to following the target; none: 0.03

  bool operator==(const SimulatedDrive&) const = default;
};

// How a drive with an incremental encoder finds its zero after power-on: its own homing, mode 6 of CiA 402.
struct HomingDescription {
  int method = 0;                        // 6098h
  double speed_rad_per_s = 0.0;          // 6099h:01, towards the switch or stop; at the joint
  double slow_speed_rad_per_s = 0.0;     // 6099h:02, towards the zero
  double acceleration_rad_per_s2 = 0.0;  // 609Ah
  double angle_rad = 0.0;                // of the joint at the zero; the counts there go to 607Ch
  double timeout_s = 60.0;

  bool operator==(const HomingDescription&) const = default;
};

// Objects that a CANopen drive may have elsewhere than CiA 402 says, as index << 8 | sub-index.
struct DriveObjects {
  std::uint32_t target = 0;  // 0: by mode 607Ah, 60C1h:01 or 6071h
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

// Longest delay of `gear_torque` readings: later ones don't damp the frequencies at which arms swing.
inline constexpr double longest_gear_torque_delay_s = 0.005;

// How a drive measures the torque of its joint's gear: by a torque sensor on the link's side, or by a second encoder
// there, whose angle gives the gear's windup. The object is the last one in TPDO1.
struct GearTorque {
  std::uint32_t object = 0;            // index << 8 | sub-index
  std::uint8_t bits = 16;              // 16, 32; signed
  double Nm_per_count = 0.0;           // positive in the joint's direction; may be negative; 0: a second encoder
  double counts_per_revolution = 0.0;  // of the second encoder, at the joint; may be negative; 0: a torque sensor
  double delay_s = 0.0;                // from the gear to the SYNC whose TPDO carries it

  bool operator==(const GearTorque&) const = default;
};

// An object that is written before the PDOs are mapped, and read back.
struct StartUpWrite {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 0;     // 8, 16, 32
  std::uint32_t value = 0;   // the raw bits

  bool operator==(const StartUpWrite&) const = default;
};

// What makes a drive stop by itself when the controller is gone.
enum class StopsBy : std::uint8_t {
  heartbeat,       // 1016h: the controller's heartbeat is missing
  setpoint_timer,  // 1400h:05 alone: setpoints are missing
  life_guarding,   // 100Ch, 100Dh: requests for its state are missing
};

// What a drive needs to come up beyond its profile, according to its manual or its stack.
struct BringUp {
  std::optional<double> enable_timeout_s;  // from the request for operation to following targets; none: the session's,
                                           // 5 s
  // cia402:
  double start_timeout_s = 2.0;     // until its first answer, and until it shows a change of its NMT state
  double answer_timeout_s = 0.2;    // of each SDO request, which is sent three times
  bool shows_mode_enabled = false;  // 6061h shows the mode only after operation is enabled
  StopsBy stops_by = StopsBy::heartbeat;
  std::uint16_t controlword_bits = 0;  // set with `enable operation`, in addition to the mode's bits
  std::vector<std::uint32_t> skip;     // optional objects to leave alone, as index << 8 | sub-index
  std::vector<StartUpWrite> write;     // in this order

  bool operator==(const BringUp&) const = default;
};

// Bits of the controlword that a mode or a maker may need set (CiA 402: 4 to 6 and 9 are the mode's, 11 to 15 the
// maker's).
inline constexpr std::uint16_t free_controlword_bits = 0xFA70;

struct DriveDescription {
  std::string joint;      // name in the URDF; for a linear joint, read m for rad, N for Nm and kg for kg m² throughout
  std::string bus;        // CAN bus or Modbus line
  std::uint8_t node = 0;  // 1..127; for a Modbus drive its unit, 1..247
  std::string profile = "cia402";  // or "modbus"
  std::string description;         // modbus: path of the register map, absolute (in the file relative to the file's
                                   // folder)
  std::string mode = "csp";        // "csp", "ip", "cst"
  std::string eds;                 // cia402: path of the maker's EDS or DCF file, absolute; may be empty
  DriveObjects objects;            // cia402
  bool fd = false;                 // cia402: PDOs are CAN FD frames at the data bitrate
  std::vector<DriveFeedback> feedback;       // cia402: in TPDO1 after the controller's objects, for the record
  std::optional<GearTorque> gear_torque;     // cia402, modes csp and ip; none: not measured
  std::optional<std::uint32_t> device_type;  // expected in 1000h; none: from `eds`, or a CiA 402 servo drive's
  double counts_per_motor_revolution = 1048576.0;
  double gear_ratio = 100.0;       // motor revolutions per joint revolution
  int direction = 1;               // +1 or −1: sign of the counts relative to the URDF's joint
  std::int32_t offset_counts = 0;  // counts at joint angle zero
  std::array<double, 2> range_rad{};
  double max_speed_rad_per_s = 0.0;
  double max_acceleration_rad_per_s2 = 0.0;
  double rated_torque_Nm = 0.0;  // 6076h times the gear ratio: 1000 in 6071h and 6077h means this at the joint; 0: not
                                 // stated
  double max_torque_Nm = 0.0;    // at the joint. Mode cst: the largest torque that may be requested; other modes: the
                                 // drive's torque, to which its setpoints are limited; 0: not stated
  BringUp bring_up;
  bool word_order_tried = false;            // modbus: a test has shown that the file's word_order is this drive's
  std::optional<HomingDescription> homing;  // of an incremental encoder; none: an absolute one
  double rotor_inertia_kg_m2 = 0.0;         // reflected to the joint
  double position_bandwidth_Hz = 100.0;     // of the drive's position loop, from its maker or a test: the lag that the
                                            // stability check assumes
  double gear_stiffness_Nm_per_rad = 0.0;   // 0: taken as rigid; used to compensate the deflection by gravity
  std::optional<double> gear_damping_Nms_per_rad;  // for the stability check; none: unknown
  SimulatedDrive simulation;

  [[nodiscard]] double counts_per_rad() const noexcept;                // sign as `direction`
  [[nodiscard]] double angle_rad(std::int32_t counts) const noexcept;  // of the motor, as seen at the joint
  [[nodiscard]] bool on_can() const noexcept { return profile != "modbus"; }

  bool operator==(const DriveDescription&) const = default;
};

struct ToolDescription {
  double mass_kg = 0.0;  // everything behind the sensor: handle and parts fixed to it
  std::array<double, 3> centre_of_mass_S_m{};
  std::array<double, 6> inertia_kg_m2{};  // ixx iyy izz ixy ixz iyz about the centre of mass, axes of S
  PoseDescription handle_S;               // X_ST: the rendered point and its axes
  std::string shape;                      // path of a tool file, absolute; empty: a point is rendered

  bool operator==(const ToolDescription&) const = default;
};

struct SensorPlacement {
  std::string description;  // path of the sensor's file, absolute (in the cell's file relative to its folder)
  std::string bus;
  std::uint32_t base_id = 0;  // the sensor defines its meaning; some have none
  SensorChoices choices;      // keys settings, force_range_N, torque_range_Nm
  std::string link;           // link of the URDF that carries the sensor (the flange)
  PoseDescription pose_link;  // X_LS
  double noise_N = 0.0;       // simulated sensor only: standard deviation per axis
  double noise_Nm = 0.0;
  // The stability check uses these three.
  double sample_rate_Hz = 0.0;  // of its converter; not synchronised with the cycle
  double bandwidth_Hz = 0.0;    // of its low-pass filter; 0: none
  double delay_s = 0.0;         // additional age of its readings
  // How far its zero may differ from the known one at the tare; 0: zero_drift_N() of its range.
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
  double max_elbow_speed_m_per_s = 0.5;  // of elbow and wrist; defaults to the tool's
  double max_tool_acceleration_m_per_s2 = 20.0;
  double max_turning_speed_rad_per_s = 2.0;               // of the tool, if the hand may turn it
  double max_turn_rad = 0.7;                              // of the tool, from its orientation at the start; 0 to 3
  std::optional<double> max_tilt_rad{}, max_twist_rad{};  // 0 to 3: of an axis of the tool, and about it
  std::array<double, 3> tilt_axis{0.0, 0.0, 1.0};         // in T, unit
  double max_force_N = 200.0;                             // a higher reading is a fault
  double max_power_W = 80.0;                              // between arm and hand, in either direction; 0: no limit
  double leash_m = 0.02;                                  // from the measured tool to the proxy
  double following_error_rad = 1e-3;                      // of a drive at rest: beyond it, setpoints wait for the drive
  std::array<double, 3> workspace_min_m{-std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity()};  // of the rendered point, in W
  std::array<double, 3> workspace_max_m{std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity()};
  std::vector<BoxDescription> keep_out;  // boxes that the rendered point may not enter
  double setpoint_bandwidth_Hz = 25.0;   // of the filter that keeps elastic gears from ringing; 0: none

  bool operator==(const CellLimits&) const = default;
};

// The declared use of a cell, and so what is required of it (profile.hpp).
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
  std::string passivity = "auto";  // "off", "observe", "auto", "on" (--passivity); off if drives take torques
  SupervisionDescription supervision;
  std::optional<EnablingInputDescription> enabling_input;
  double receive_window = 0.45;  // share of the timestep in which feedback and samples are accepted; then setpoints
                                 // leave
  double default_period_s = 1e-3;
  double default_mass_kg = 4.0, default_damping_Ns_per_m = 0.0;
  std::string default_scene;  // path, absolute (in the cell's file relative to its folder); may be empty
  std::string default_hand;   // as default_scene

  bool operator==(const Cell&) const = default;
};

// Reads a cell and checks everything that doesn't need its URDF. The file's keys are the names of the fields above,
// nested like the structs, except limits.workspace_m {min, max} and limits.keep_out_m [{min, max}, …]. docs/files.md
// lists optional keys. Throws SetupError, with file, line and key.
Cell load_cell(const std::filesystem::path& file);
// The same for a file that has already been read.
Cell read_cell(const YamlNode& root);
// Throws SetupError unless the cell's default_scene or default_hand (KEY) is a file. A run that doesn't use it needn't
// check.
void require_default_file(const Cell& cell, const char* key, const std::filesystem::path& path);

}  // namespace proxarm::description
