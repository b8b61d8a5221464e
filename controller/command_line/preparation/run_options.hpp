// The options of `proxarm run` and `proxarm sim`.
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

namespace proxarm::command_line {

enum class Pace : std::uint8_t { virtual_time, realtime };

// How far the arm is sent ahead of the proxy (rendering/lookahead.hpp).
struct LookaheadChoice {
  enum class Kind : std::uint8_t { off, automatic, fixed } kind = Kind::off;
  double horizon_s = 0.0;  // used if fixed

  // Takes "auto", "off" or a time with its unit. Throws SetupError that names `option`.
  static LookaheadChoice parse(std::string_view text, std::string_view option);
};

// Which interface carries each bus of the cell. Empty: all buses are in-process.
class BusMapping {
 public:
  // Takes "sim", "vcan0", or "axes_1_3=can0,axes_4_6=can1,sensor=can2". Throws SetupError.
  static BusMapping parse(const std::string& text);

  [[nodiscard]] bool simulated() const noexcept { return !all_ && by_bus_.empty(); }
  // One interface per bus, in the order of `bus_names`. Throws SetupError if a bus has no interface or a name is
  // unknown.
  [[nodiscard]] std::vector<std::string> interfaces(const std::vector<std::string>& bus_names) const;

 private:
  std::optional<std::string> all_;
  std::map<std::string, std::string> by_bus_;
};

// The port on 127.0.0.1 where a view listens, and the largest number of viewers.
struct ViewPlace {
  std::uint16_t port = 0;
  std::size_t most_viewers = 0;
  int line = -1;  // the socket to the view's process
};

struct RunOptions {
  std::filesystem::path cell;                       // empty: the default cell
  std::filesystem::path scene;                      // empty: the cell's
  std::filesystem::path hand;                       // empty: the cell's
  std::filesystem::path tool;                       // empty: the scene's, else the cell's; point: a point
  std::filesystem::path arm;                        // cell file of the simulated arm; empty: as the cell
  std::optional<double> mass_kg, damping_Ns_per_m;  // unset: the cell's
  std::optional<double> period_s;
  double extra_delay_s = 0.0;  // added to the sensor's readings
  double duration_s = 10.0;
  std::optional<controller::Scheme> scheme;                // unset: by the drives' modes
  std::optional<controller::Passivity> passivity;          // unset: the cell's
  std::optional<double> stiffness_N_per_m;                 // impedance type
  std::optional<controller::OrientationMode> orientation;  // unset: free if one of the next three is given, else held
  std::optional<double> inertia_kg_m2, turning_damping_Nms_per_rad, turning_spring_Nm_per_rad;
  std::optional<LookaheadChoice> lookahead;  // unset: off
  bool damps_gears = true;                   // if the gears' torque is measured
  controller::SessionSettings settings;      // all settings that aren't optional above
  BusMapping bus;
  std::optional<Pace> pace;          // unset: virtual time in-process, real time on an interface
  std::filesystem::path record_dir;  // empty: no record
  controller::SignalsForm signals = controller::SignalsForm::packed;  // form of the record's signals
  std::vector<std::string> changes;                                   // NAME=VALUE@TIME
  std::vector<std::string> orders;                                    // ORDER@TIME
  bool without_proof = false;                                         // allows real drives with an unproven cell
  std::string hardware;                                               // empty: simulations only; ask, checked
  std::filesystem::path control;                                      // socket that takes changes; empty: none
  std::filesystem::path black_box_dir;                                // empty: in the record, or proxarm-black-box
  std::filesystem::path plot_file;                                    // empty: proxarm-run.svg; with --json none
  bool plot = true;
  bool json = false;
  bool verbose = false;  // all figures in the summary instead of eight lines
  bool force_unstable = false;
  bool view = false;                         // show the session in a browser
  bool view_control = false;                 // the browser may change the session
  std::uint16_t view_port = 0;               // 0: any free port
  std::vector<std::string> allowed_origins;  // of web pages that may also view
  std::optional<ViewPlace> view_place;       // of the running view; absent: no view
  std::vector<sim::DeviceFault> faults;      // of the simulated devices
  std::vector<sim::PressedSpan> enabling;    // of the simulated enabling switch
  bool for_proof = false;                    // `sim`: a helper pushes as a proof asks, instead of the hand
};

// Throws SetupError if `--hardware` is given while all buses are simulated.
void require_interface_for_hardware(const RunOptions& options);

}  // namespace proxarm::command_line
