// What `proxarm run` and `proxarm sim` were asked to do, as the command line says it.
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

// How far ahead of the proxy the arm is sent (rendering/lookahead.hpp).
struct LookaheadChoice {
  enum class Kind : std::uint8_t { off, automatic, fixed } kind = Kind::off;
  double horizon_s = 0.0;  // fixed

  // "auto", "off" or a time with its unit. Throws SetupError that names `option`.
  static LookaheadChoice parse(std::string_view text, std::string_view option);
};

// Which interface carries each bus of the cell. Empty: all of them in-process.
class BusMapping {
 public:
  // "sim", "vcan0", or "axes_1_3=can0,axes_4_6=can1,sensor=can2". Throws SetupError.
  static BusMapping parse(const std::string& text);

  [[nodiscard]] bool simulated() const noexcept { return !all_ && by_bus_.empty(); }
  // One interface per bus, in the order of `bus_names`. Throws SetupError where a bus has none, or a name is unknown.
  [[nodiscard]] std::vector<std::string> interfaces(const std::vector<std::string>& bus_names) const;

 private:
  std::optional<std::string> all_;
  std::map<std::string, std::string> by_bus_;
};

// Where a view listens, on 127.0.0.1, and how many may look at once.
struct ViewPlace {
  std::uint16_t port = 0;
  std::size_t most_viewers = 0;
  int line = -1;  // the socket to its process
};

struct RunOptions {
  std::filesystem::path cell;                       // empty: the default cell
  std::filesystem::path scene;                      // empty: the cell's
  std::filesystem::path hand;                       // empty: the cell's
  std::filesystem::path tool;                       // empty: the scene's, else the cell's; point: a point
  std::filesystem::path arm;                        // cell file of the simulated arm; empty: it is as the cell says
  std::optional<double> mass_kg, damping_Ns_per_m;  // unset: the cell's
  std::optional<double> period_s;
  double extra_delay_s = 0.0;  // of the sensor's readings
  double duration_s = 10.0;
  std::optional<controller::Scheme> scheme;        // unset: what the drives' modes say
  std::optional<controller::Passivity> passivity;  // unset: the cell's
  std::optional<double> stiffness_N_per_m;         // impedance type
  std::optional<controller::OrientationMode>
      orientation;  // unset: free where one of the next three is given, else held
  std::optional<double> inertia_kg_m2, turning_damping_Nms_per_rad, turning_spring_Nm_per_rad;
  std::optional<LookaheadChoice> lookahead;  // unset: off
  bool damps_gears = true;                   // where their torque is measured
  controller::SessionSettings settings;      // all that isn't optional above
  BusMapping bus;
  std::optional<Pace> pace;          // unset: virtual in-process, real time on an interface
  std::filesystem::path record_dir;  // empty: no record
  controller::SignalsForm signals = controller::SignalsForm::packed;  // of the record
  std::vector<std::string> changes;                                   // NAME=VALUE@TIME
  std::vector<std::string> orders;                                    // ORDER@TIME
  bool without_proof = false;                                         // real drives of a cell that isn't proven
  std::string hardware;                                               // empty: simulations only; ask, checked
  std::filesystem::path control;                                      // socket that takes changes; empty: none
  std::filesystem::path black_box_dir;                                // empty: in the record, or proxarm-black-box
  std::filesystem::path plot_file;                                    // empty: proxarm-run.svg, none with --json
  bool plot = true;
  bool json = false;
  bool verbose = false;  // all figures in the summary, not the eight lines
  bool force_unstable = false;
  bool view = false;                         // show the session in a browser
  bool view_control = false;                 // and let it be changed there
  std::uint16_t view_port = 0;               // 0: any that is free
  std::vector<std::string> allowed_origins;  // of web pages that may look, too
  std::optional<ViewPlace> view_place;       // of the view that runs; absent: there is none
  std::vector<sim::DeviceFault> faults;      // of the simulated devices
  std::vector<sim::PressedSpan> enabling;    // of the simulated enabling switch
  bool for_proof = false;                    // `sim`: somebody pushes as a proof asks, in place of the hand
};

// Throws SetupError where `--hardware` is given and all buses are simulated: no real arm would be meant by that.
void require_interface_for_hardware(const RunOptions& options);

}  // namespace proxarm::command_line
