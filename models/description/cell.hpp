// Describes a cell as its file does: the arm, its tool, the buses, a drive per joint, the sensor and the limits.
//
// The structs are plain data, in SI units unless a name says otherwise. load_cell() reads them; the controller, the
// field bus and the simulated arm use them.
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

// A pose as files state it: position in metres, and roll r, pitch p and yaw y in radians (fixed axes x, y, z: R = Rz(y)
// Ry(p) Rx(r), as in URDF).
struct PoseDescription {
  std::array<double, 3> position_m{};
  std::array<double, 3> rpy_rad{};

  bool operator==(const PoseDescription&) const = default;
};

struct BusDescription {
  std::string name;
  std::int64_t bitrate = 1'000'000;  // bit/s, in the arbitration phase
  std::int64_t data_bitrate = 0;     // bit/s, in the data phase of CAN FD; 0: a classic bus

  bool operator==(const BusDescription&) const = default;
};

// A Modbus line: one TCP connection for each device, or one serial line for all devices. A device is a drive or the
// sensor. A Modbus line isn't a CAN bus, so SYNC, `--bus` and the bus budget don't include it.
struct ModbusLineDescription {
  std::string name;
  std::string host;    // TCP: the numeric IPv4 address; empty for a serial line
  int port = 502;      // TCP
  std::string device;  // serial line (RTU): for example /dev/ttyUSB0
  int baud = 115200;
  std::string parity = "even";  // none, even, odd
  int stop_bits = 1;
  // Serial line (RTU): the adapter receives what it sends, as some RS-485 adapters do.
  bool echo = false;

  [[nodiscard]] bool serial() const noexcept { return host.empty(); }

  bool operator==(const ModbusLineDescription&) const = default;
};

// Properties of a joint's drive that only a simulation uses.
struct SimulatedDrive {
  double coulomb_friction_Nm = 0.0;  // torque at the joint, from friction on the motor side of the gear
  double viscous_friction_Nms_per_rad = 0.0;
  double gear_damping_Nms_per_rad = 0.0;  // damping of the elastic gear
  // The real stiffness over gear_stiffness_Nm_per_rad. It differs from 1 because data sheets aren't exact.
  double gear_stiffness_ratio = 1.0;
  double backlash_rad = 0.0;  // total play, at the joint
  // Width of the gear's loop of torque over windup, at zero torque.
  double gear_hysteresis_rad = 0.0;
  // Amplitude of the motor's torque ripple, at the joint. The ripple doesn't depend on the current.
  double torque_ripple_Nm = 0.0;
  int torque_ripple_per_revolution = 6;  // periods of the ripple per turn of the motor
  double max_torque_Nm = 0.0;            // the drive's current limit, as a torque at the joint
  // Errors of the `gear_torque` readings: a factor, an offset, the standard deviation of white noise, and (below) the
  // width of the hysteresis loop over the true torque.
  double gear_torque_ratio = 1.0, gear_torque_offset_Nm = 0.0, gear_torque_noise_Nm = 0.0;
  double gear_torque_hysteresis_Nm = 0.0;
  double brake_torque_Nm = 0.0;        // torque with which the closed brake holds or slows the joint; 0: unlimited
  double brake_delay_s = 0.0;          // time from the loss of power until the brake is closed
  double position_gain_per_s = 0.0;    // gain of the outer loop of the cascade
  double velocity_bandwidth_Hz = 0.0;  // bandwidth of the inner loop of the cascade
  double velocity_feedforward = 1.0;   // factor of the interpolated setpoint's velocity
  double acceleration_feedforward = 1.0;
  double servo_rate_Hz = 4000.0;
  // "strict", "latching", "lazy", "holding" or "insisting"; see sim/canopen/stack_behaviour.hpp.
  std::string stack = "strict";
  // Time from enabling until the drive follows the target; none: 0.03 s.
  std::optional<double> brake_release_s;

  bool operator==(const SimulatedDrive&) const = default;
};

// How a drive with an incremental encoder finds its zero after power-on: by homing, which is mode 6 of CiA 402.
struct HomingDescription {
  int method = 0;                        // 6098h
  double speed_rad_per_s = 0.0;          // 6099h:01, speed towards the switch or stop, at the joint
  double slow_speed_rad_per_s = 0.0;     // 6099h:02, speed towards the zero, at the joint
  double acceleration_rad_per_s2 = 0.0;  // 609Ah
  double angle_rad = 0.0;                // the joint's angle at the zero; 607Ch gets the counts for this angle
  double timeout_s = 60.0;

  bool operator==(const HomingDescription&) const = default;
};

// Objects that a CANopen drive may have at other places than CiA 402 says, as index << 8 | sub-index.
struct DriveObjects {
  std::uint32_t target = 0;  // 0: chosen by the mode, 607Ah, 60C1h:01 or 6071h
  std::uint32_t controlword = 0x604000, statusword = 0x604100, position = 0x606400, torque = 0x607700;
  std::uint32_t mode = 0x606000, mode_display = 0x606100, supported_modes = 0x650200;
  std::uint32_t interpolation_value = 0x60C201, interpolation_index = 0x60C202;

  bool operator==(const DriveObjects&) const = default;
};

// An additional object in the drive's TPDO1.
struct DriveFeedback {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 0;     // 8, 16 or 32

  bool operator==(const DriveFeedback&) const = default;
};

// Longest delay of `gear_torque` readings. With a longer delay, they don't damp the frequencies at which arms swing.
inline constexpr double longest_gear_torque_delay_s = 0.005;

// How a drive measures the torque of its joint's gear: by a torque sensor on the link's side, or by a second encoder on
// the link's side, whose angle gives the gear's windup. The object with the reading is the last object in TPDO1.
struct GearTorque {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 16;    // 16 or 32; the number is signed
  // Torque sensor: factor of the reading, positive in the joint's direction; may be negative. 0: a second encoder.
  double Nm_per_count = 0.0;
  // Second encoder: counts per revolution of the joint; may be negative. 0: a torque sensor.
  double counts_per_revolution = 0.0;
  double delay_s = 0.0;  // from the gear's torque to the SYNC whose TPDO contains the reading

  bool operator==(const GearTorque&) const = default;
};

// An object that is written before the PDOs are mapped, and then read back.
struct StartUpWrite {
  std::uint32_t object = 0;  // index << 8 | sub-index
  std::uint8_t bits = 0;     // 8, 16 or 32
  std::uint32_t value = 0;   // the bits to write

  bool operator==(const StartUpWrite&) const = default;
};

// The mechanism by which a drive stops by itself when the controller is gone.
enum class StopsBy : std::uint8_t {
  heartbeat,       // 1016h: the controller's heartbeat is missing
  setpoint_timer,  // only 1400h:05: setpoints are missing
  life_guarding,   // 100Ch, 100Dh: requests for the drive's state are missing
};

// What a drive needs at start-up in addition to its profile, according to its manual or its CANopen stack.
struct BringUp {
  // Longest time from the request for operation until the drive follows targets; none: the session's value, 5 s.
  std::optional<double> enable_timeout_s;
  // cia402 (as all fields below): longest time until the drive's first answer, and until the drive shows a change of
  // its NMT state.
  double start_timeout_s = 2.0;
  double answer_timeout_s = 0.2;  // time for each SDO request; a request is sent three times
  // Whether 6061h shows the mode only after operation is enabled.
  bool shows_mode_enabled = false;
  StopsBy stops_by = StopsBy::heartbeat;
  std::uint16_t controlword_bits = 0;  // set with `enable operation`, in addition to the bits of the mode
  std::vector<std::uint32_t> skip;     // optional objects that aren't written, as index << 8 | sub-index
  std::vector<StartUpWrite> write;     // written in this order

  bool operator==(const BringUp&) const = default;
};

// The bits of the controlword that a mode or a maker may define. In CiA 402, bits 4 to 6 and 9 belong to the mode, and
// bits 11 to 15 to the maker.
inline constexpr std::uint16_t free_controlword_bits = 0xFA70;

struct DriveDescription {
  // The joint's name in the URDF. For a linear joint, read m for rad, N for Nm and kg for kg m² in all fields.
  std::string joint;
  std::string bus;                 // name of the CAN bus or the Modbus line
  std::uint8_t node = 0;           // 1..127; for a Modbus drive: its unit, 1..247
  std::string profile = "cia402";  // "cia402" or "modbus"
  // modbus: absolute path of the register map. In the cell's file, the path is relative to the file's folder.
  std::string description;
  std::string mode = "csp";  // "csp", "ip" or "cst"
  std::string eds;           // cia402: absolute path of the maker's EDS or DCF file; may be empty
  DriveObjects objects;      // cia402
  bool fd = false;           // cia402: whether PDOs are CAN FD frames at the data bitrate
  // cia402: objects in TPDO1 after the controller's objects; only the record uses them.
  std::vector<DriveFeedback> feedback;
  std::optional<GearTorque> gear_torque;  // cia402, modes csp and ip; none: not measured
  // The value that 1000h must have. none: the value from `eds`, or that of a CiA 402 servo drive.
  std::optional<std::uint32_t> device_type;
  double counts_per_motor_revolution = 1048576.0;
  double gear_ratio = 100.0;       // motor revolutions per joint revolution
  int direction = 1;               // +1 or −1: the sign of the counts relative to the joint in the URDF
  std::int32_t offset_counts = 0;  // the counts at joint angle zero
  std::array<double, 2> range_rad{};
  double max_speed_rad_per_s = 0.0;
  double max_acceleration_rad_per_s2 = 0.0;
  // The torque at the joint for 1000 in 6071h and 6077h: 6076h times the gear ratio. 0: not stated.
  double rated_torque_Nm = 0.0;
  // Torque at the joint. In mode cst, it is the largest torque that may be requested. In other modes, it is the drive's
  // largest torque, which limits the setpoints. 0: not stated.
  double max_torque_Nm = 0.0;
  BringUp bring_up;
  // modbus: whether a test has shown that the file's word_order is the order of this drive.
  bool word_order_tried = false;
  std::optional<HomingDescription> homing;  // only for an incremental encoder; none: the encoder is absolute
  double rotor_inertia_kg_m2 = 0.0;         // at the joint
  // Bandwidth of the drive's position loop, from its maker or from a test. The stability check assumes this lag.
  double position_bandwidth_Hz = 100.0;
  // The controller uses this to compensate for the gear's deflection by gravity. 0: the gear is taken as rigid.
  double gear_stiffness_Nm_per_rad = 0.0;
  std::optional<double> gear_damping_Nms_per_rad;  // only used by the stability check; none: unknown
  SimulatedDrive simulation;

  [[nodiscard]] double counts_per_rad() const noexcept;  // has the sign of `direction`
  // Returns the motor's angle divided by the gear ratio.
  [[nodiscard]] double angle_rad(std::int32_t counts) const noexcept;
  [[nodiscard]] bool on_can() const noexcept { return profile != "modbus"; }

  bool operator==(const DriveDescription&) const = default;
};

struct ToolDescription {
  double mass_kg = 0.0;  // the mass of everything behind the sensor: the handle and the parts fixed to it
  std::array<double, 3> centre_of_mass_S_m{};
  std::array<double, 6> inertia_kg_m2{};  // ixx iyy izz ixy ixz iyz about the centre of mass, in the axes of S
  PoseDescription handle_S;               // X_ST, the pose of the rendered point and its axes
  std::string shape;                      // absolute path of a tool file; empty: a point is rendered

  bool operator==(const ToolDescription&) const = default;
};

struct SensorPlacement {
  // Absolute path of the sensor's file. In the cell's file, the path is relative to the cell file's folder.
  std::string description;
  std::string bus;            // name of the CAN bus or the Modbus line; empty for a sensor on UDP
  std::string host;           // UDP: the sensor's numeric IPv4 address; empty for a sensor on a bus
  int port = 0;               // UDP: the sensor's port; 0: the port in its file
  std::uint32_t base_id = 0;  // the sensor's file defines how it is used; some sensors have no base id
  SensorChoices choices;      // from the keys settings, force_range_N and torque_range_Nm
  std::string link;           // the link in the URDF that carries the sensor (the flange)
  PoseDescription pose_link;  // X_LS, the pose of S in the frame of this link
  double noise_N = 0.0;       // only for a simulated sensor: standard deviation per axis
  double noise_Nm = 0.0;
  // Only the stability check uses the next three fields.
  double sample_rate_Hz = 0.0;  // rate of the sensor's converter, which isn't synchronised with the cycle
  double bandwidth_Hz = 0.0;    // bandwidth of the sensor's low-pass filter; 0: no filter
  double delay_s = 0.0;         // additional age of the sensor's readings
  // Largest difference between the sensor's zero at the tare and its known zero; 0: zero_drift_N(sensor).
  double zero_drift_N = 0.0;

  [[nodiscard]] bool on_udp() const noexcept { return !host.empty(); }
  // Returns the bus or the address for messages, such as "bus sensor" or "UDP 192.168.1.1".
  [[nodiscard]] std::string where() const { return on_udp() ? "UDP " + host : "bus " + bus; }

  bool operator==(const SensorPlacement&) const = default;
};

inline constexpr double longest_sensor_delay_s = 0.1;

// A box whose edges are parallel to the axes of W.
struct BoxDescription {
  std::array<double, 3> min_m{};
  std::array<double, 3> max_m{};

  bool operator==(const BoxDescription&) const = default;
};

struct CellLimits {
  double max_tool_speed_m_per_s = 0.5;
  // Limit for the speed of the elbow: of all joints from the third on, the wrist included. The default is
  // max_tool_speed_m_per_s.
  double max_elbow_speed_m_per_s = 0.5;
  double max_tool_acceleration_m_per_s2 = 20.0;
  double max_turning_speed_rad_per_s = 2.0;  // turning speed of the tool, if the hand may turn the tool
  double max_turn_rad = 0.7;                 // angle of the tool from its orientation at the start; 0 to 3
  // max_tilt_rad: angle of an axis of the tool from its direction at the start. max_twist_rad: turn about this axis.
  // Both 0 to 3.
  std::optional<double> max_tilt_rad{}, max_twist_rad{};
  std::array<double, 3> tilt_axis{0.0, 0.0, 1.0};  // in T, unit
  double max_force_N = 200.0;                      // a higher reading is a fault
  double max_power_W = 80.0;                       // power between arm and hand, in either direction; 0: no limit
  double leash_m = 0.02;                           // longest distance from the measured tool to the proxy
  // Largest following error of a drive at rest. If a drive's following error is larger, setpoints wait for the drive.
  double following_error_rad = 1e-3;
  std::array<double, 3> workspace_min_m{-std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity()};  // for the rendered point, in W
  std::array<double, 3> workspace_max_m{std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::infinity()};
  std::vector<BoxDescription> keep_out;  // boxes that the rendered point may not enter
  double setpoint_bandwidth_Hz = 25.0;   // of the filter that prevents elastic gears from ringing; 0: no filter

  bool operator==(const CellLimits&) const = default;
};

// The declared use of a cell. It determines what the cell must state (profile.hpp).
enum class Profile : std::uint8_t { none, hand_guiding };

struct Cell {
  std::filesystem::path file;  // absolute path of the file that was read
  std::string name;
  std::filesystem::path urdf;  // absolute path
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
  // "off", "observe", "auto" or "on" (--passivity). It is off if drives take torques.
  std::string passivity = "auto";
  SupervisionDescription supervision;
  std::optional<EnablingInputDescription> enabling_input;
  // The fraction of the timestep in which feedback and samples are accepted. After this time, the setpoints are sent.
  double receive_window = 0.45;
  double default_period_s = 1e-3;
  double default_mass_kg = 4.0, default_damping_Ns_per_m = 0.0;
  // Absolute path; may be empty. In the cell's file, the path is relative to the file's folder.
  std::string default_scene;
  std::string default_hand;  // as default_scene: absolute path; may be empty

  bool operator==(const Cell&) const = default;
};

// Reads a cell's file and checks everything that can be checked without the URDF. The keys of the file are the names of
// the fields above, nested like the structs, except limits.workspace_m {min, max} and limits.keep_out_m [{min, max},
// …]. docs/reference/files.md lists the optional keys. Throws SetupError, with file, line and key.
Cell load_cell(const std::filesystem::path& file);
// Does what load_cell() does, for a file that has already been read.
Cell read_cell(const YamlNode& root);
// Throws SetupError unless `path`, which is the cell's default_scene or default_hand (named by `key`), is a file. A run
// that uses another file needn't call this.
void require_default_file(const Cell& cell, const char* key, const std::filesystem::path& path);

}  // namespace proxarm::description
