// Declares the options of `proxarm run` and `proxarm sim`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/rendering/session_settings.hpp"
#include "controller/signals/signals_form.hpp"
#include "sim/devices/device_fault.hpp"
#include "sim/devices/enabling_switch.hpp"

namespace proxarm::controller {

enum class Pace : std::uint8_t { virtual_time, realtime };

// The requested lookahead: how far ahead in time the arm is sent where the proxy will be (rendering/lookahead.hpp).
struct LookaheadChoice {
  enum class Kind : std::uint8_t { off, automatic, fixed } kind = Kind::off;
  double horizon_s = 0.0;  // used if `kind` is `fixed`

  // Parses "auto", "off" or a time with its unit. Throws a SetupError that names `option`.
  static LookaheadChoice parse(std::string_view text, std::string_view option);
};

// Which interface carries each bus of the cell. Empty: all buses are in-process.
class BusMapping {
 public:
  // Parses "sim", the name of one interface for all buses, such as "vcan0", or an interface for each bus, such as
  // "axes_1_3=can0,axes_4_6=can1,sensor=can2". Throws SetupError.
  static BusMapping parse(const std::string& text);

  [[nodiscard]] bool simulated() const noexcept { return !all_ && by_bus_.empty(); }
  // Returns one interface per bus, in the order of `bus_names`. Throws SetupError if a bus has no interface, or if the
  // mapping names a bus that isn't in `bus_names`.
  [[nodiscard]] std::vector<std::string> interfaces(const std::vector<std::string>& bus_names) const;

 private:
  std::optional<std::string> all_;
  std::map<std::string, std::string> by_bus_;
};

// Where a running view is reached: its port on 127.0.0.1, the largest number of its viewers, and the socket to its
// process.
struct ViewPlace {
  std::uint16_t port = 0;
  std::size_t most_viewers = 0;
  int line = -1;  // the socket to the view's process
};

struct RunOptions {
  std::filesystem::path cell;                       // empty: the default cell
  std::filesystem::path scene;                      // empty: the cell's
  std::filesystem::path hand;                       // empty: the cell's
  std::filesystem::path tool;                       // empty: the scene's, else the cell's; "point": a point
  std::filesystem::path arm;                        // cell file of the simulated arm; empty: `cell`
  std::optional<double> mass_kg, damping_Ns_per_m;  // unset: the cell's
  std::optional<double> period_s;
  double extra_delay_s = 0.0;  // delay added to the sensor's readings
  double duration_s = 10.0;
  std::optional<Scheme> scheme;             // unset: found from the drives' modes
  std::optional<Passivity> passivity;       // unset: the cell's
  std::optional<double> stiffness_N_per_m;  // of the virtual coupling, for the impedance type
  // Unset: free if one of the next three options is given, else held.
  std::optional<OrientationMode> orientation;
  std::optional<double> inertia_kg_m2, turning_damping_Nms_per_rad, turning_spring_Nm_per_rad;
  std::optional<LookaheadChoice> lookahead;  // unset: off
  bool damps_gears = true;                   // damp gears whose torque is measured
  SessionSettings settings;                  // all settings that aren't optional above
  BusMapping bus;
  std::optional<Pace> pace;                   // unset: virtual time in-process, real time on an interface
  std::filesystem::path record_dir;           // empty: no record
  SignalsForm signals = SignalsForm::packed;  // form of the record's table of signals
  std::vector<std::string> changes;           // NAME=VALUE@TIME
  std::vector<std::string> orders;            // ORDER@TIME
  bool without_proof = false;                 // enable real drives even if the cell isn't proven
  std::string hardware;                       // "ask" or "checked"; empty: enable simulated drives only
  std::filesystem::path control;              // path of the control socket; empty: none
  std::filesystem::path black_box_dir;        // empty: in the record's folder, else proxarm-black-box
  std::filesystem::path plot_file;            // empty: proxarm-run.svg, or no plot with --json
  bool plot = true;
  bool json = false;
  bool verbose = false;  // print the whole summary instead of eight lines
  bool force_unstable = false;
  bool view = false;                         // show the session in a browser
  bool view_control = false;                 // the browser may change the session
  std::uint16_t view_port = 0;               // 0: any free port
  std::vector<std::string> allowed_origins;  // origins of other web pages that may show the view
  std::optional<ViewPlace> view_place;       // the running view; absent: no view
  std::vector<sim::DeviceFault> faults;      // faults of the simulated devices
  std::vector<sim::PressedSpan> enabling;    // times at which the simulated enabling switch is pressed
  bool for_proof = false;                    // for `sim`: instead of the hand, a helper pushes as a proof asks
};

// Throws SetupError if `--hardware` is given and all buses are simulated.
void require_interface_for_hardware(const RunOptions& options);

}  // namespace proxarm::controller
