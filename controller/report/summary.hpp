// The figures of a session: what was rendered, how accurately, and how fast it was computed.
//
// SummaryBuilder gets each cycle's record once, in order, and stores little. Not for the cycle. Unless stated
// otherwise, a figure is over the cycles of Phase::rendering. A figure without data is absent (null in JSON).
//
// Symbols:
//   F_h   the hand's force: the simulation's true force if recorded, else the compensated measured force plus the force
//         that accelerates the handle, which the sensor before the handle doesn't see
//   x     the tool's position: the simulation's true position if recorded, else the position by the encoders
//   a, v  acceleration and velocity of the tool, central differences of x
//   n     the contact's normal in the record
//   f     the world's force on the proxy, (25a)
//   m     mass of the handle
//   M_p   mass of the proxy
//   M     m + M_p, the mass that the hand feels
// `source` says whether F_h and x are the simulation's true values. A virtual spring's force K_v (x − x₀) is subtracted
// from F_h first.
//
//   penetration_max_m               max(0, −signed distance of the proxy)
//   tool_penetration_max_m          the same for the tool
//   tool_penetration_touch_max_m    the same for the tool, within the first touch_s of a contact
//   tool_penetration_sliding_max_m  the same for the tool, after touch_s, while the proxy slips
//   tracking_rms_m, tracking_max_m  ‖x(t_k) − q(k − delay)‖. delay is 2 cycles plus the setpoint filter's delay: a
//                                   target sent in cycle k is latched at SYNC k+1 and, interpolated, reached at k+2
//   tracking_lag_rms_m, tracking_lag_max_m
//                                   ‖x(t_k) − q(k − 1)‖, which includes the lag: q(k − 1) is the proxy at t_k
//   apparent_mass_kg                Re(F_h/a) between 0.3 and 2 Hz in free motion (apparent_mass.hpp). Motion is free
//                                   if no limit acts and the world's force on the proxy is below 1 mN
//   apparent_damping_Ns_per_m       the damping of the same fit, from Im(F_h/a)
//   felt_mass                       F_h/a by frequency, in the same free motion (FeltMassCurve)
//   felt_mass_band_Hz               the frequency up to which |F_h/a − M|/M stays within each limit (felt_limits)
//   felt_mass_band_Hz_along         the same along each axis of W
//   apparent_inertia_kg_m2          as apparent_mass_kg, for rotation: from the hand's torque about the rendered point
//                                   and the tool's rotation vector since rendering began. Only in simulations, and only
//                                   if the tool turns
//   contact_force_error_N           root mean square of n·f − push over cycles of established contact.
//                                   push = −n·(F_h − m a − M_p a_q − B v_q), with the proxy's acceleration a_q and
//                                   velocity v_q (zero along n on a flat wall). Contact is established from touch_s
//                                   after its beginning, which excludes impacts. Impedance type: push = −n·F_h, so the
//                                   error includes the device's friction and inertia
//   friction_ratio_error            Σ t·R / Σ (−μ n·R) − 1 with R = F_h − m a − M_p a_q − B v_q. t is the unit vector
//                                   against the friction in f: the direction of sliding relative to the surface, also
//                                   if the surface moves. Over cycles that slip on one object, from settle_s after the
//                                   contact began; absent for less than 0.1 s of slipping
//   pulling_force_max_N             max(0, −n·f) over all cycles in contact with one object
//   drag_force_max_N                max ‖f‖ over all cycles without contact: the resistance of media and fields
//   setpoint_sha256                 hash of all target counts of all cycles, in all phases (setpoint_hash.hpp)
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/record/page_faults.hpp"
#include "controller/report/apparent_mass.hpp"
#include "controller/report/oscillation.hpp"
#include "controller/stability/passed_poses.hpp"
#include "controller/stability/verdict.hpp"
#include "controller/supervision/fault.hpp"

namespace proxarm::controller {

struct SummaryConfig {
  double period_s = 1e-3;
  // M: felt mass, of proxy and handle. Impedance type: 0, and handle_mass_kg is 0, too.
  double wanted_mass_kg = 4.0;
  double handle_mass_kg = 0.0;             // m: mass of all that moves behind the sensor
  double damping_Ns_per_m = 0.0;           // B
  double spring_N_per_m = 0.0;             // K_v, from the proxy's start
  double wanted_inertia_kg_m2 = 0.0;       // felt inertia that is wanted; 0: the orientation is held
  double turning_spring_Nm_per_rad = 0.0;  // virtual spring from the orientation at the start
  int setpoint_delay_cycles = 2;
  double setpoint_filter_s = 0.0;   // the filter's part of setpoint_delay_cycles; needed when the period changes
  double touch_s = 0.1;             // how long a contact counts as a touch
  double settle_s = 0.5;            // how long after its beginning a contact may still ring
  bool passivity = false;           // whether energies and oscillations are observed
  double lookahead_s = 0.0;         // horizon at the start; not included in setpoint_delay_cycles
  double gear_damping_per_s = 0.0;  // κ of torque-damped gears; 0: no gear is damped
  std::vector<std::string> axis_names = {};  // joints' names, for limits of single joints
};

// The reason for the end of the session: a word for programs, a sentence for people.
struct EndSummary {
  std::string reason;
  std::string text;
};

// An order or a change ("set mass=6") of the script that wasn't carried out.
struct OrderSummary {
  std::string order;
  double time_s = 0.0;  // after the first cycle; of a change: rendered time before it
  std::string refused;  // the reason why it wasn't carried out
};

struct FaultSummary {
  Fault fault = Fault::none;
  std::uint64_t cycle = 0;
  std::string text;  // describe()
  bool was_reset = false;
  // The fault that raised the stop of `fault` to category 0; none: no escalation.
  Fault escalation = Fault::none;
};

// A fault that didn't stop the session: the arm carried on, slowed down, or held.
struct NoticeSummary {
  Fault fault = Fault::none;
  Reaction reaction = Reaction::carry_on;
  std::uint64_t times = 0, cycles = 0;
};

// The view of the session, on 127.0.0.1.
struct ViewSummary {
  std::uint16_t port = 0;
  std::size_t most_viewers = 0;
  bool may_change = false;  // whether viewers may change the session (--view-control)
};

// A limit or guard that acted.
struct LimitSummary {
  std::uint64_t cycles = 0;
  // time_s: how long it acted. first_s: when it first acted, since the first cycle.
  double time_s = 0.0, first_s = 0.0;
  std::string words;  // description of the limit
};

struct ComputeTimes {
  double median = 0.0, p99 = 0.0, max = 0.0;  // µs; median and p99 to 10 ns below 1 ms, to 1 % above
  double total = 0.0;                         // µs
};

// Latencies of a session in real time (latency.hpp), µs.
struct LatencySummary {
  double median = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;
  // Count of each bin that isn't empty, after the bin's lower edge in µs.
  std::vector<std::pair<std::int64_t, std::uint64_t>> histogram;
};

// A change of the timestep requested during the session.
struct TimestepSummary {
  double time_s = 0.0;  // time of the request
  double from_s = 0.0, to_s = 0.0;
  double paused_s = 0.0;  // from the request until rendering went on, or until a change in a hold was done
  std::string refused;    // why the change was refused; empty: it wasn't refused
};

// Returns why a timestep was refused: "drive of axis_3, 60C2h:01: SDO abort …".
std::string refusal_text(const fieldbus::PeriodRefusal& refusal, const std::vector<std::string>& axis_names);

// For sessions with passivity observed (without --passivity off). passivity.hpp has the symbols. Work and energies are
// those at the end of rendering.
struct PassivitySummary {
  PortEnergies energies_J;
  double oscillating_time_s = 0.0;
  double oscillation_max_m_per_s = 0.0;  // root mean square over 0.1 s
  double added_time_s = 0.0;             // time with at least 1 Ns/m added
  double added_damping_max_Ns_per_m = 0.0;
  double felt_damping_min_Ns_per_m = 0.0;  // smallest b̂ while oscillating
};

// Whether the felt mass and inertia were stable in the poses that the arm passed
// (controller/stability/passed_poses.hpp).
struct PosesSummary {
  std::size_t judged = 0;
  std::optional<UnstablePlaces> unstable;  // times since the first cycle; absent: all places are stable
  std::vector<PassedPoses::Place> places;  // with their smallest stable mass, if this was searched
};
// Returns "at 3.2 s the arm came …".
std::string poses_text(const UnstablePlaces& there);

struct Summary {
  // Whether a fault ended the session. Faults that were reset come first in the list.
  [[nodiscard]] bool ended_by_fault() const noexcept { return !faults.empty() && !faults.back().was_reset; }

  double simulated_time_s = 0.0;  // over all cycles, in all phases
  double rendered_time_s = 0.0;
  double wall_time_s = 0.0;  // set by the caller
  double figures_s = 0.0;    // processor time for records and figures, outside the cycles; set by the caller
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;                        // over all phases
  ComputeTimes compute_us;                           // over all phases
  std::map<std::string, LatencySummary> latency_us;  // by the latency's name; set by the caller; empty in virtual time
  std::optional<PageFaults> page_faults;   // faults of the cycle's thread; set by the caller; absent in virtual time
  std::map<std::string, double> bus_load;  // set by the caller
  bool virtual_time = false;               // true: no cycle can be late; set by the caller
  std::optional<double> first_cycle_s;     // since power on, in simulation; set by the caller
  std::optional<double> rendering_from_s;  // since the first cycle
  std::optional<double> proxy_clearance_min_m;  // distance to the nearest surface; absent: no surface
  double penetration_max_m = 0.0;
  double tool_penetration_max_m = 0.0;
  double tool_penetration_touch_max_m = 0.0;
  double tool_penetration_sliding_max_m = 0.0;
  std::optional<double> tracking_rms_m, tracking_max_m;          // the setpoints' delay taken off
  std::optional<double> tracking_lag_rms_m, tracking_lag_max_m;  // the setpoints' delay included
  double tracking_delay_s = 0.0;                                 // the delay that was taken off
  std::optional<double> apparent_mass_kg, apparent_damping_Ns_per_m;
  std::optional<double> apparent_inertia_kg_m2, apparent_turning_damping_Nms_per_rad;
  std::optional<double> contact_force_error_N, contact_force_error_max_N;
  std::optional<double> friction_ratio_error;
  double pulling_force_max_N = 0.0, drag_force_max_N = 0.0;
  std::vector<FeltMassCurve::Point> felt_mass;                       // by frequency; empty: no frequency was excited
  std::array<std::vector<FeltMassCurve::Point>, 3> felt_mass_along;  // as felt_mass, along each axis of W
  double contact_time_s = 0.0, sliding_time_s = 0.0;
  std::uint64_t contacts = 0;                         // how often a contact began
  std::uint64_t limited_cycles = 0;                   // some limit was active
  std::map<std::string, LimitSummary> active_limits;  // by the limit's parameter
  std::optional<PassivitySummary> passivity;
  std::optional<Oscillation> oscillation;  // the longest oscillation; absent: not looked for
  std::optional<Swing> expected_swing;     // swing of a tool that is led and turned; set by the caller
  std::optional<PosesSummary> poses;       // set by the caller; absent: impedance type
  double lookahead_s = 0.0;                // horizon at the start; 0: no lookahead
  double gear_damping_per_s = 0.0;         // κ; 0: no gear is damped
  double hands_off_s = 0.0;                // time without a hand at the handle
  std::uint64_t guarded_cycles = 0;        // cycles in which the last guard held a setpoint back; 0 without a fault
  // limits_work_J: energy that limits put into the proxy; negative: they took energy out. limits_push_J: the largest
  // net energy that limits put in over any stretch of time.
  double limits_work_J = 0.0, limits_push_J = 0.0;
  std::uint64_t held_samples = 0;         // cycles without a new sensor sample
  std::size_t unresolved_steps = 0;       // steps of 𝒢 for which not all laws hold
  EndSummary end;                         // set by the caller
  std::vector<OrderSummary> idle_orders;  // set by the caller
  // Objects that the drives lack, with the consequence; set by the caller.
  std::vector<std::string> drives_lack;
  std::vector<FaultSummary> faults;    // set by the caller
  std::string black_box;               // folder of the black box, after a fault; set by the caller
  std::optional<ViewSummary> view;     // set by the caller; absent: no view
  std::vector<NoticeSummary> notices;  // set by the caller
  std::vector<TimestepSummary> timesteps;
  bool from_truth = false;
  std::string setpoint_sha256;
  double wanted_mass_kg = 0.0;        // as configured, or as last set
  double wanted_inertia_kg_m2 = 0.0;  // as configured, or as last set; 0: the orientation is held
};

class SummaryBuilder {
 public:
  explicit SummaryBuilder(const SummaryConfig& config);
  ~SummaryBuilder();
  SummaryBuilder(SummaryBuilder&&) noexcept;
  SummaryBuilder& operator=(SummaryBuilder&&) noexcept;

  void add(const CycleRecord& record);
  // The spell that is going on in the last record.
  [[nodiscard]] Oscillation oscillation() const;
  // Returns the figures of all records so far. More records may be added afterwards, but segments of free motion and
  // slides are cut here.
  [[nodiscard]] Summary finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Returns "16.2 Hz, 1.3 mm to either side, for 6.97 s from 2.91 s on".
std::string oscillation_text(const Oscillation& oscillation);
// Returns everything as one JSON object on one line, without the line's end, for `--json`.
std::string summary_json(const Summary& summary);
// For files, with a line per figure. repeatable_json() has the figures that are the same in each run with the same
// input; timing_json() has the wall clock's figures.
std::string repeatable_json(const Summary& summary);
std::string timing_json(const Summary& summary);

// The session's result: one word for programs, and one sentence for people.
enum class VerdictTone { good, look, bad };
struct SummaryVerdict {
  VerdictTone tone = VerdictTone::good;
  // The most important finding: fine, look, swings or fault.
  const char* word = "fine";
  std::string text;
};
SummaryVerdict judge(const Summary& summary);

// Returns the line above the picture of a session (plot.hpp): felt mass and wanted mass, and the contact's accuracy.
std::string plot_headline(const Summary& summary);

struct SummaryLook {
  // Whether all figures are shown, some twenty lines; false: eight lines, plus a line for each problem.
  bool verbose = true;
  // Whether verdict and problems are coloured, for terminals (terminal.hpp).
  bool colour = false;
};
// Returns a table of names and values, for people.
std::string summary_text(const Summary& summary, const SummaryLook& look = {});

}  // namespace proxarm::controller
