// The figures of a session: what was rendered, how accurately, and how fast it was computed.
//
// SummaryBuilder gets every cycle's record once, in order, and stores little. Not for the cycle. Unless stated
// otherwise, a figure is over cycles of Phase::rendering. A figure without data is absent (null in JSON).
//
// "Hand's force" F_h and "tool" x are the simulation's true values if the records hold them. Otherwise F_h is the
// compensated measured force plus the handle's inertia (the sensor sits before the handle and doesn't see it), and x
// comes from the encoders; `source` says which. a, v: central differences of x. n: contact normal of the record; f:
// (25a). m, M_p, M: masses of the handle, of the proxy, and their sum, which the hand feels. A virtual spring's force
// K_v (x − x₀) is subtracted from F_h first.
//
//   penetration_max_m       max(0, −signed distance of the proxy)
//   tool_penetration_max_m  the same for the tool; …_touch_… within the first touch_s of a contact, …_sliding_… later,
//                           while the proxy slips
//   tracking_rms_m, _max_m  ‖x(t_k) − q(k − delay)‖, delay = 2 cycles: a target sent in cycle k is latched at SYNC k+1
//                           and, interpolated, reached at k+2; the setpoint filter's delay is added.
//                           tracking_lag_rms_m, …_max_m: ‖x(t_k) − q(k − 1)‖, lag included: q(k − 1) is the proxy
//                           at t_k
//   apparent_mass_kg        Re(F_h/a) between 0.3 and 2 Hz in free motion: no limit acts, and the world's force on the
//                           proxy is below 1 mN (apparent_mass.hpp); apparent_damping_Ns_per_m from its Im
//   felt_mass, _band_Hz     F_h/a by frequency, and the frequency up to which |F_h/a − M|/M stays within each limit,
//                           in the same free motion (FeltMassCurve); _band_Hz_along: along each axis of W
//   apparent_inertia_kg_m2  the same for rotation, from the hand's torque about the rendered point and the tool's
//                           rotation vector since rendering began; only in simulations whose tool turns
//   contact_force_error_N   root mean square of n·f − push over cycles of established contact, with
//                           push = −n·(F_h − m a − M_p a_q − B v_q), a_q and v_q the proxy's own (zero along n on a
//                           flat wall). "Established" excludes impacts: from touch_s after the contact began.
//                           Impedance type: push = −n·F_h, so it includes the device's friction and inertia
//   friction_ratio_error    Σ t·R / Σ (−μ n·R) − 1 with R = F_h − m a − M_p a_q − B v_q. t is against the friction in
//                           f: the direction of sliding relative to the surface, also if that moves. Over cycles that
//                           slip on one object, from settle_s after the contact began; at least 0.1 s
//   pulling_force_max_N     max(0, −n·f) over all cycles in contact with one object
//   drag_force_max_N        max ‖f‖ over all cycles without contact: the resistance of media and fields
//   setpoint_sha256         all target counts of all cycles (setpoint_hash.hpp), in all phases
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
  double wanted_mass_kg = 4.0;             // M: proxy and handle; impedance type: 0, and so is m
  double handle_mass_kg = 0.0;             // m: what moves behind the sensor
  double damping_Ns_per_m = 0.0;           // B
  double spring_N_per_m = 0.0;             // K_v, to the proxy's start
  double wanted_inertia_kg_m2 = 0.0;       // to be felt; 0: the orientation is held
  double turning_spring_Nm_per_rad = 0.0;  // to the orientation at the start
  int setpoint_delay_cycles = 2;
  double setpoint_filter_s = 0.0;            // the filter's part of that delay; needed when the period changes
  double touch_s = 0.1;                      // how long a contact counts as a touch
  double settle_s = 0.5;                     // how long the arm may ring after it
  bool passivity = false;                    // observed
  double lookahead_s = 0.0;                  // horizon at the start; not included in the delays above
  double gear_damping_per_s = 0.0;           // κ of torque-damped gears; 0: no gear is damped
  std::vector<std::string> axis_names = {};  // for limits of single joints
};

// Why the session ended: a word for programs, a sentence for people.
struct EndSummary {
  std::string reason;
  std::string text;
};

// An order or a change ("set mass=6") of the script that had no effect.
struct OrderSummary {
  std::string order;
  double time_s = 0.0;  // after the first cycle; for a change: of rendering
  std::string refused;  // reason
};

struct FaultSummary {
  Fault fault = Fault::none;
  std::uint64_t cycle = 0;
  std::string text;  // describe()
  bool was_reset = false;
  Fault escalation = Fault::none;  // the fault that raised its stop to category 0; none: no escalation
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
  bool may_change = false;  // with --view-control
};

// A limit or guard that acted.
struct LimitSummary {
  std::uint64_t cycles = 0;
  double time_s = 0.0, first_s = 0.0;  // after the first cycle
  std::string words;                   // description of the limit
};

struct ComputeTimes {
  double median = 0.0, p99 = 0.0, max = 0.0;  // µs; median and p99 to 10 ns below 1 ms, to 1 % above
  double total = 0.0;                         // µs
};

// Latencies of a session in real time (latency.hpp), µs.
struct LatencySummary {
  double median = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;
  std::vector<std::pair<std::int64_t, std::uint64_t>> histogram;  // of bins that aren't empty: µs and count
};

// A change of the timestep requested during the session.
struct TimestepSummary {
  double time_s = 0.0;  // of the request
  double from_s = 0.0, to_s = 0.0;
  double paused_s = 0.0;  // until rendering went on, or the change was done in a hold
  std::string refused;    // why the change was refused; empty: it wasn't
};

// Why a timestep was refused: "drive of axis_3, 60C2h:01: SDO abort …".
std::string refusal_text(const fieldbus::PeriodRefusal& refusal, const std::vector<std::string>& axis_names);

// For sessions without --passivity off; passivity.hpp has the symbols. Work and energies are at the end of rendering.
struct PassivitySummary {
  PortEnergies energies_J;
  double oscillating_time_s = 0.0;
  double oscillation_max_m_per_s = 0.0;  // root mean square over 0.1 s
  double added_time_s = 0.0;             // with at least 1 Ns/m
  double added_damping_max_Ns_per_m = 0.0;
  double felt_damping_min_Ns_per_m = 0.0;  // b̂ while oscillating
};

// Whether felt mass and inertia were stable where the arm went (controller/stability/passed_poses.hpp).
struct PosesSummary {
  std::size_t judged = 0;
  std::optional<UnstablePlaces> unstable;  // times after the first cycle; absent: all stable
  std::vector<PassedPoses::Place> places;  // with the smallest stable mass, if that was searched
};
// "at 3.2 s the arm came …".
std::string poses_text(const UnstablePlaces& there);

struct Summary {
  double simulated_time_s = 0.0;  // all cycles, whatever the phase
  double rendered_time_s = 0.0;
  double wall_time_s = 0.0;  // set by the caller
  double figures_s = 0.0;    // processor time for records and figures, outside the cycles; set by the caller
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;                        // all phases
  ComputeTimes compute_us;                           // all phases
  std::map<std::string, LatencySummary> latency_us;  // by name; set by the caller; empty in virtual time
  std::optional<PageFaults> page_faults;             // of the cycle's thread; set by the caller; absent in virtual time
  std::map<std::string, double> bus_load;            // set by the caller
  bool virtual_time = false;                         // no cycle can be late; set by the caller
  std::optional<double> first_cycle_s;               // after power on, in simulation; set by the caller
  std::optional<double> rendering_from_s;            // after the first cycle
  std::optional<double> proxy_clearance_min_m;       // to the nearest surface; absent: no surface
  double penetration_max_m = 0.0;
  double tool_penetration_max_m = 0.0;
  double tool_penetration_touch_max_m = 0.0;
  double tool_penetration_sliding_max_m = 0.0;
  std::optional<double> tracking_rms_m, tracking_max_m;          // without the setpoints' delay
  std::optional<double> tracking_lag_rms_m, tracking_lag_max_m;  // with it
  double tracking_delay_s = 0.0;                                 // the delay taken off
  std::optional<double> apparent_mass_kg, apparent_damping_Ns_per_m;
  std::optional<double> apparent_inertia_kg_m2, apparent_turning_damping_Nms_per_rad;
  std::optional<double> contact_force_error_N, contact_force_error_max_N;
  std::optional<double> friction_ratio_error;
  double pulling_force_max_N = 0.0, drag_force_max_N = 0.0;
  std::vector<FeltMassCurve::Point> felt_mass;                       // by frequency; empty: not excited
  std::array<std::vector<FeltMassCurve::Point>, 3> felt_mass_along;  // the same along each axis of W
  double contact_time_s = 0.0, sliding_time_s = 0.0;
  std::uint64_t contacts = 0;                         // how often a contact began
  std::uint64_t limited_cycles = 0;                   // some limit was active
  std::map<std::string, LimitSummary> active_limits;  // by the parameter of the limit
  std::optional<PassivitySummary> passivity;
  std::optional<Oscillation> oscillation;  // the longest; absent: not looked for
  std::optional<Swing> expected_swing;     // for a tool that is led and turned; set by the caller
  std::optional<PosesSummary> poses;       // set by the caller; absent: impedance type
  double lookahead_s = 0.0;                // horizon at the start; 0: none
  double gear_damping_per_s = 0.0;         // 0: none
  double hands_off_s = 0.0;                // time without a hand at the handle
  std::uint64_t guarded_cycles = 0;        // in which the last guard held a setpoint back; 0 without a fault
  // Energy that limits put into the proxy: the sum (negative: taken out), and the largest net gain over a stretch.
  double limits_work_J = 0.0, limits_push_J = 0.0;
  std::uint64_t held_samples = 0;         // cycles without a new sensor sample
  std::size_t unresolved_steps = 0;       // steps of 𝒢 for which not all laws hold
  EndSummary end;                         // set by the caller
  std::vector<OrderSummary> idle_orders;  // set by the caller
  std::vector<std::string> drives_lack;   // objects that drives lack, and the consequence; set by the caller
  std::vector<FaultSummary> faults;       // set by the caller
  std::string black_box;                  // its folder, after a fault; set by the caller
  std::optional<ViewSummary> view;        // set by the caller; absent: no view
  std::vector<NoticeSummary> notices;     // set by the caller
  std::vector<TimestepSummary> timesteps;
  bool from_truth = false;
  std::string setpoint_sha256;
  double wanted_mass_kg = 0.0;        // as configured or set
  double wanted_inertia_kg_m2 = 0.0;  // as configured or set; 0: the orientation is held
};

class SummaryBuilder {
 public:
  explicit SummaryBuilder(const SummaryConfig& config);
  ~SummaryBuilder();
  SummaryBuilder(SummaryBuilder&&) noexcept;
  SummaryBuilder& operator=(SummaryBuilder&&) noexcept;

  void add(const CycleRecord& record);
  // The spell that goes on in the last record.
  [[nodiscard]] Oscillation oscillation() const;
  // Figures of all records so far. More may be added afterwards, but segments and slides are cut here.
  [[nodiscard]] Summary finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// "16.2 Hz, 1.3 mm to either side, for 6.97 s from 2.91 s on".
std::string oscillation_text(const Oscillation& oscillation);
// Everything as one JSON object on one line without line end, for `--json`.
std::string summary_json(const Summary& summary);
// For files: the figures that are repeatable with the same input, and the wall clock's figures, on separate lines.
std::string repeatable_json(const Summary& summary);
std::string timing_json(const Summary& summary);

// The session's result, in one word for programs and one sentence for people.
enum class VerdictTone { good, look, bad };
struct SummaryVerdict {
  VerdictTone tone = VerdictTone::good;
  const char* word = "fine";  // fine, look, swings, fault: the most important finding
  std::string text;
};
SummaryVerdict judge(const Summary& summary);

// One line above the picture of a session (plot.hpp): felt mass against wanted mass, and the contact's accuracy.
std::string plot_headline(const Summary& summary);

struct SummaryLook {
  bool verbose = true;  // all figures, some twenty lines; else eight, plus one for each problem
  bool colour = false;  // colours verdict and problems, for terminals (terminal.hpp)
};
// For people: a table of names and values.
std::string summary_text(const Summary& summary, const SummaryLook& look = {});

}  // namespace proxarm::controller
