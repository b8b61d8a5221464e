// The summary for people.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "controller/report/summary.hpp"
#include "controller/stability/stability.hpp"

namespace proxarm::controller {
namespace {

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

// Returns a length with a readable unit: "12.3 µm", "0.45 mm", "0".
std::string length(const std::optional<double>& metres) {
  if (!metres) return "none";
  const double size = std::abs(*metres);
  if (size == 0.0) return "0";
  if (size < 1e-9) return format("%.2g m", *metres);
  if (size < 1e-6) return format("%.3g nm", *metres * 1e9);
  if (size < 1e-3) return format("%.3g µm", *metres * 1e6);
  if (size < 1.0) return format("%.3g mm", *metres * 1e3);
  return format("%.3f m", *metres);
}

std::string number(const std::optional<double>& value, const char* pattern) {
  return value ? format(pattern, *value) : "none";
}

}  // namespace

std::string refusal_text(const fieldbus::PeriodRefusal& refusal, const std::vector<std::string>& axis_names) {
  if (refusal.drive < 0) return "the session left the hold before all drives had confirmed it";
  const auto axis = static_cast<std::size_t>(refusal.drive);
  const std::string drive = axis < axis_names.size() ? axis_names[axis] : std::to_string(axis + 1);
  const std::string object = fieldbus::to_string(fieldbus::ObjectAddress{refusal.index, refusal.sub});
  return "drive of " + drive + ", " + object + ": " +
         (refusal.code != 0 ? fieldbus::describe_sdo_abort(refusal.code) : "it kept another value");
}

namespace {

constexpr std::array axis_letters{"x", "y", "z"};

constexpr const char* sgr_of(VerdictTone tone) {  // ECMA-48, select graphic rendition
  return tone == VerdictTone::good ? "\x1b[32m" : tone == VerdictTone::look ? "\x1b[33m" : "\x1b[1;31m";
}

// The lines of the summary, with the names in a column on the left.
class Lines {
 public:
  explicit Lines(bool colour) : colour_(colour) {}

  void operator()(const char* name, const std::string& value) {
    text_ += "  ";
    text_ += name;
    text_.append(name[0] == '\0' ? 0 : 1, ':');
    const std::size_t width = std::char_traits<char>::length(name) + 1;
    text_.append(width < 26 ? 26 - width : 1, ' ');
    text_ += value + "\n";
  }
  void operator()(const char* name, const std::string& value, VerdictTone tone) {
    (*this)(name, colour_ ? sgr_of(tone) + value + "\x1b[0m" : value);
  }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
  bool colour_;
};

void tell_time(const Summary& s, Lines& line) {
  line("time", format("%.3f s in ", s.simulated_time_s) + std::to_string(s.cycles) + " cycles, " +
                   format("%.3f s of it rendered; ", s.rendered_time_s) + format("wall clock %.2f s: ", s.wall_time_s) +
                   format("%.2f s for cycles, ", 1e-6 * s.compute_us.total) +
                   format("%.2f s for records and figures", s.figures_s));
  line("compute per cycle", format("median %.1f, ", s.compute_us.median) + format("p99 %.1f, ", s.compute_us.p99) +
                                format("max %.1f µs; ", s.compute_us.max) +
                                (s.virtual_time ? "no deadline: simulated time stands still meanwhile"
                                                : "overruns " + std::to_string(s.overruns)));
  for (const auto& [name, latency] : s.latency_us) {
    std::string words = name;
    std::replace(words.begin(), words.end(), '_', ' ');
    line(words.c_str(), format("median %.0f, ", latency.median) + format("p99 %.0f, ", latency.p99) +
                            format("p99.9 %.0f, ", latency.p999) + format("max %.1f µs", latency.max));
  }
  if (s.page_faults) {
    line("page faults", std::to_string(s.page_faults->minor) + " minor, " + std::to_string(s.page_faults->major) +
                            " major after the first cycle");
  }
  std::string loads;
  for (const auto& [bus, load] : s.bus_load)
    loads += (loads.empty() ? "" : ", ") + bus + format(" %.1f %%", 100 * load);
  if (!loads.empty()) line("bus load", loads);
}

// Returns, for each axis along which the tool moved, the frequency up to which the felt mass is right. The worst axis
// comes first.
std::string felt_along(const Summary& s) {
  const auto& [name, limit] = felt_limits[1];  // 10 %
  std::vector<std::pair<double, const char*>> along;
  for (std::size_t axis = 0; axis < axis_letters.size(); ++axis) {
    const std::vector<FeltMassCurve::Point>& felt_mass = s.felt_mass_along[axis];
    if (felt_mass.empty()) continue;
    along.emplace_back(band_within_Hz(felt_mass, s.wanted_mass_kg, limit), axis_letters[axis]);
  }
  std::sort(along.begin(), along.end());
  std::string text;
  for (const auto& [band_Hz, axis] : along) {
    text += (text.empty() ? "within " + std::string(name) + " along " : ", ") + std::string(axis);
    text += band_Hz > 0.0 ? format(" up to %.2g Hz", band_Hz) : " nowhere";
  }
  return text;
}

std::string felt_band(const Summary& s) {
  const auto& [name, limit] = felt_limits[1];
  const double band_Hz = band_within_Hz(s.felt_mass, s.wanted_mass_kg, limit);
  return "within " + std::string(name) + (band_Hz > 0.0 ? format(" up to %.2g Hz", band_Hz) : " nowhere");
}

// Writes the frequency up to which the felt mass is right, and the felt mass at the highest frequency.
void tell_felt_mass(const Summary& s, Lines& line) {
  if (s.felt_mass.empty() || !(s.wanted_mass_kg > 0.0)) return;
  std::string bands;
  for (const auto& [name, limit] : felt_limits) {
    const double band_Hz = band_within_Hz(s.felt_mass, s.wanted_mass_kg, limit);
    bands += (bands.empty() ? "within " : ", ") + std::string(name);
    bands += band_Hz > 0.0 ? format(" up to %.2g Hz", band_Hz) : " nowhere";
  }
  line("mass by frequency", bands);
  if (const std::string along = felt_along(s); !along.empty()) line("", along);
  const FeltMassCurve::Point& last = s.felt_mass.back();
  line("", format("at %.3g Hz ", last.frequency_Hz) + format("%.3g kg in phase, ", last.mass_kg.real()) +
               format("phase %.0f degrees", 180.0 / std::numbers::pi * std::arg(last.mass_kg)));
}

// A world's force below this is rounding.
constexpr double noticeable_N = 1e-3;

std::string apparent_mass(const Summary& s) {
  return number(s.apparent_mass_kg, "%.3f kg") +
         (s.wanted_mass_kg > 0.0 ? format(", wanted %.3f kg", s.wanted_mass_kg) : ", the device's own");
}

// Returns the text on the damping. A negative value isn't damping: the delay between push and motion adds a little
// energy in each swing.
std::string drag(const std::optional<double>& damping, const char* unit, const char* pattern) {
  if (!damping) return "";
  if (*damping >= 0.0) return "; damping " + format(pattern, *damping) + unit;
  return "; the loop's delay pushes on by " + format(pattern, -*damping) + unit;
}

void tell_inertia(const Summary& s, Lines& line) {
  if (!(s.wanted_inertia_kg_m2 > 0.0)) return;
  line("apparent inertia", number(s.apparent_inertia_kg_m2, "%.5f kg m²") +
                               format(", wanted %.5f kg m²", s.wanted_inertia_kg_m2) +
                               drag(s.apparent_turning_damping_Nms_per_rad, "Nms/rad", "%.3f "));
}

std::string touched(const Summary& s) {
  if (s.contacts > 0) {
    return std::to_string(s.contacts) + (s.contacts == 1 ? " touch, " : " touches, ") +
           format("%.2f s, ", s.contact_time_s) + format("%.2f s of it sliding", s.sliding_time_s);
  }
  return s.proxy_clearance_min_m ? "none; the nearest surface was at least " + length(s.proxy_clearance_min_m) + " away"
                                 : "none";
}

void tell_unresolved(const Summary& s, Lines& line) {
  if (s.unresolved_steps == 0) return;
  line("unresolved",
       std::to_string(s.unresolved_steps) + (s.unresolved_steps == 1 ? " step that keeps" : " steps that keep") +
           " not all laws of contact",
       VerdictTone::look);
}

void tell_motion(const Summary& s, Lines& line) {
  line("apparent mass", apparent_mass(s) + drag(s.apparent_damping_Ns_per_m, "Ns/m", "%.2f ") +
                            (s.limited_cycles > 0 ? "; where no limit acts" : ""));
  tell_inertia(s, line);
  if (s.gear_damping_per_s > 0.0)
    line("gear damping", format("%.3g/s, by the gears' measured torque", s.gear_damping_per_s));
  if (s.lookahead_s > 0.0)
    line("lookahead", format("%.3g ms: the arm is sent to where the proxy will be", 1e3 * s.lookahead_s));
  tell_felt_mass(s, line);
  line("tracking error", "rms " + length(s.tracking_rms_m) + ", max " + length(s.tracking_max_m) +
                             format("; with the lag of %.3g ms: rms ", 1e3 * s.tracking_delay_s) +
                             length(s.tracking_lag_rms_m) + ", max " + length(s.tracking_lag_max_m));
  line("contact", touched(s));
  tell_unresolved(s, line);
  line("penetration, proxy", length(s.penetration_max_m));
  line("penetration, tool", length(s.tool_penetration_max_m) + "; at the touch " +
                                length(s.tool_penetration_touch_max_m) + ", sliding " +
                                length(s.tool_penetration_sliding_max_m));
  line("contact force error",
       "rms " + number(s.contact_force_error_N, "%.3f N") + ", max " + number(s.contact_force_error_max_N, "%.3f N"));
  line("friction ratio error", s.friction_ratio_error ? format("%+.2f %%", 100 * *s.friction_ratio_error) : "none");
  line("pulling force",
       format("%.3g N", s.pulling_force_max_N) +
           (s.drag_force_max_N > noticeable_N ? format("; drag without contact %.3g N", s.drag_force_max_N) : ""));
}

}  // namespace

std::string oscillation_text(const Oscillation& o) {
  const std::string angle =
      o.amplitude_rad ? format(" and %.2g°", *o.amplitude_rad * 180.0 / std::numbers::pi) : std::string();
  return format("%.3g Hz, ", o.frequency_Hz) + length(o.amplitude_m) + angle +
         format(" to either side, for %.2f s ", o.duration_s) + format("from %.2f s on", o.from_s);
}

std::string poses_text(const UnstablePlaces& there) {
  std::string felt = format("%.3g kg", there.felt_mass_kg);
  if (there.felt_inertia_kg_m2 > 0.0) felt += format(" with %.3g kg m²", there.felt_inertia_kg_m2);
  const std::string came = format("at %.2f s the arm came where ", there.first_s) + felt +
                           " isn't stable with this hand" + (there.lacks_mass ? "" : ", led and turned at once");
  if (!there.smallest_stable) return came + ", nor is any other " + (there.lacks_mass ? "mass" : "inertia");
  const std::string takes = format("%.3g kg", round_up(*there.smallest_stable)) + (there.lacks_mass ? "" : " m²");
  if (!(there.worst_s > there.first_s)) return came + "; it takes " + takes + " there";
  return came + "; it takes up to " + takes + format(" (at %.2f s)", there.worst_s);
}

namespace {

// Weber fraction of a mass moved by hand: hands notice smaller differences only rarely (docs/how_to/view.md cites the
// sources).
constexpr double noticeable_mass_share = 0.1;

std::string hands_off(const Summary& s) {
  return format("%.3g s: nobody at the handle, the arm stands", s.hands_off_s);
}

void tell_oscillation(const Summary& s, Lines& line) {
  if (!s.oscillation) return;
  if (s.oscillation->duration_s == 0.0) return line("oscillation", "none");
  if (!s.oscillation->lasts) return line("oscillation", oscillation_text(*s.oscillation), VerdictTone::look);
  line("OSCILLATION", oscillation_text(*s.oscillation), VerdictTone::bad);
  const char* larger = s.oscillation->amplitude_rad ? "mass, inertia or damping" : "mass or damping";
  line("", std::string("the loop isn't stable with this hand and arm: a larger ") + larger + ", a shorter timestep,");
  line("", "a longer setpoint filter; `proxarm tune` says which mass, and `damping added` what --passivity did");
}

// Returns the limits that acted, each with its time, the longest time first.
std::string limits_in_brief(const Summary& s) {
  if (s.active_limits.empty()) return "none";
  std::vector<std::pair<double, const std::string*>> longest;
  for (const auto& [parameter, limit] : s.active_limits) longest.emplace_back(limit.time_s, &parameter);
  std::sort(longest.begin(), longest.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  constexpr std::size_t most = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(most, longest.size()); ++i) {
    text += (i == 0 ? "" : ", ") + *longest[i].second + format(" for %.3g s", longest[i].first);
  }
  return longest.size() <= most ? text : text + " and " + std::to_string(longest.size() - most) + " more";
}

// Writes the limits that acted, and the energies.
void tell_limits(const Summary& s, Lines& line) {
  if (s.limited_cycles > 0) line("limits active", std::to_string(s.limited_cycles) + " cycles");
  for (const auto& [parameter, limit] : s.active_limits) {
    line("", parameter + ": " + std::to_string(limit.cycles) + " cycles");
    line("", format("  %.3g s, ", limit.time_s) + format("first at %.3f s: ", limit.first_s) + limit.words);
  }
  if (s.passivity) {
    const PortEnergies& e = s.passivity->energies_J;
    line("energy", format("hand to tool %.3g J, ", e.hand) + format("hand to proxy %.3g J, ", e.proxy) +
                       format("world to proxy %.3g J, ", e.world) + format("damped %.3g J", e.damping));
    if (s.passivity->added_time_s > 0.0) {
      line("damping added", format("%.2f s, ", s.passivity->added_time_s) +
                                format("at most %.3g Ns/m", s.passivity->added_damping_max_Ns_per_m));
    }
  }
}

std::string view_text(const std::optional<ViewSummary>& view) {
  if (!view) return "none; no network port";
  return "127.0.0.1:" + std::to_string(view->port) + ", " + std::to_string(view->most_viewers) +
         " viewers at most, who may " + (view->may_change ? "change the session, too" : "only look");
}

void tell_events(const Summary& s, Lines& line) {
  for (const NoticeSummary& notice : s.notices) {
    const std::string times = notice.times == 1 ? "once" : std::to_string(notice.times) + " times";
    line("noticed",
         fault_name(notice.fault) + (" " + times) + ", " + std::to_string(notice.cycles) +
             " cycles; reaction: " + reaction_name(notice.reaction),
         VerdictTone::look);
  }
  for (const TimestepSummary& t : s.timesteps) {
    line("timestep", format("%.4g to ", 1e3 * t.from_s) + format("%.4g ms ", 1e3 * t.to_s) +
                         format("at %.3f s, ", t.time_s) + format("%.0f ms without rendering", 1e3 * t.paused_s) +
                         (t.refused.empty() ? "" : "; not taken: " + t.refused));
  }
  for (const std::string& lack : s.drives_lack) line("lacking", lack, VerdictTone::look);
  for (const OrderSummary& order : s.idle_orders) {
    line("order without effect", order.order + format(" at %.4g s: ", order.time_s) + order.refused, VerdictTone::look);
  }
}

void tell_faults(const Summary& s, Lines& line) {
  if (s.faults.empty()) line("faults", "none");
  for (const FaultSummary& fault : s.faults) {
    line(fault.was_reset ? "fault, then reset" : "FAULT", fault.text,
         fault.was_reset ? VerdictTone::look : VerdictTone::bad);
  }
}

// Returns remarks on a session without a fault, the most important remark first.
std::string remarks(const Summary& s) {
  std::string text;
  const auto add = [&text](bool is_so, const std::string& words) {
    if (is_so) text += (text.empty() ? "" : "; ") + words;
  };
  add(s.poses && s.poses->unstable, "not stable everywhere");
  add(s.oscillation && s.oscillation->duration_s > 0.0, "it swung and came to rest");
  add(!s.virtual_time && s.overruns > 0,
      std::to_string(s.overruns) + (s.overruns == 1 ? " cycle" : " cycles") + " late");
  const double off = s.apparent_mass_kg && s.wanted_mass_kg > 0.0 ? *s.apparent_mass_kg / s.wanted_mass_kg - 1.0 : 0.0;
  add(std::abs(off) > noticeable_mass_share,
      format("the mass felt is %.0f %% ", 100.0 * std::abs(off)) + (off > 0.0 ? "above" : "below") + " the one wanted");
  add(!s.faults.empty(), s.faults.size() == 1 ? "a fault was reset" : "faults were reset");
  add(!s.notices.empty(), "something was noticed");
  add(!s.idle_orders.empty(), "an order had no effect");
  add(s.unresolved_steps > 0, "steps stayed unresolved");
  return text;
}

// Writes the brief summary. Rotation and problems have lines of their own.
void tell_in_brief(const Summary& s, Lines& line) {
  line("ended", s.end.text.empty() ? format("%.3f s were rendered", s.rendered_time_s) : s.end.text);
  line("apparent mass",
       apparent_mass(s) + (s.felt_mass.empty() || !(s.wanted_mass_kg > 0.0) ? "" : "; " + felt_band(s)));
  tell_inertia(s, line);
  line("contact", touched(s));
  if (s.contacts > 0) {
    line("accuracy",
         "tool at most " + length(s.tool_penetration_max_m) + " inside" +
             (s.contact_force_error_N ? format("; force within %.3f N rms", *s.contact_force_error_N) : "") +
             (s.friction_ratio_error ? format("; friction %+.2f %%", 100 * *s.friction_ratio_error) : ""));
  } else {
    line("accuracy", "tool follows the proxy within " + length(s.tracking_rms_m) + " rms, " + length(s.tracking_max_m) +
                         " at most");
  }
  line("limits active", limits_in_brief(s));
  tell_unresolved(s, line);
  if (s.oscillation && s.oscillation->duration_s > 0.0) tell_oscillation(s, line);
  if (s.poses && s.poses->unstable) line("not stable everywhere", poses_text(*s.poses->unstable), VerdictTone::look);
  if (s.hands_off_s > 0.0) line("hands off", hands_off(s));
  if (s.view) line("view", view_text(s.view));
  tell_events(s, line);
  tell_faults(s, line);
}

// Writes the place where the felt mass was nearest to the smallest stable mass, if the smallest stable mass was
// searched.
void tell_margin(const Summary& s, Lines& line) {
  const auto share = [](const PassedPoses::Place& place) {
    return place.smallest_stable_mass_kg ? place.felt_mass_kg / *place.smallest_stable_mass_kg : 0.0;
  };
  if (!s.poses || s.poses->places.empty()) return;
  const auto nearest = std::ranges::min_element(s.poses->places, {}, share);
  line("over smallest stable", format("%.2f times at least, ", share(*nearest)) + format("at %.2f s", nearest->time_s));
}

void tell_everything(const Summary& s, Lines& line) {
  tell_time(s, line);
  tell_motion(s, line);
  tell_oscillation(s, line);
  tell_margin(s, line);
  if (s.poses && s.poses->unstable) line("not stable everywhere", poses_text(*s.poses->unstable), VerdictTone::look);
  tell_limits(s, line);
  if (s.hands_off_s > 0.0) line("hands off", hands_off(s));
  if (s.held_samples > 0) line("sensor samples held", std::to_string(s.held_samples) + " cycles");
  line("figures from", s.from_truth ? "the simulation's truth" : "sensor and encoders");
  line("setpoints (SHA-256)", s.setpoint_sha256);
  line("view", view_text(s.view));
  tell_events(s, line);
  if (!s.end.text.empty()) line("ended", s.end.text);
  tell_faults(s, line);
}

}  // namespace

SummaryVerdict judge(const Summary& s) {
  if (s.ended_by_fault()) {
    return {VerdictTone::bad, "fault", std::string("a fault ended it: ") + fault_name(s.faults.back().fault)};
  }
  if (s.oscillation && s.oscillation->lasts) {
    return {VerdictTone::bad, "swings", "it swings by itself: not stable with this hand and arm"};
  }
  if (const std::string text = remarks(s); !text.empty()) return {VerdictTone::look, "look", "no fault, but " + text};
  return {VerdictTone::good, "fine", "fine: no fault, nothing swung"};
}

std::string plot_headline(const Summary& s) {
  const SummaryVerdict verdict = judge(s);
  if (verdict.tone == VerdictTone::bad) return verdict.text;
  std::string text;
  if (s.apparent_mass_kg && s.wanted_mass_kg > 0.0) {
    text = format("%.3g kg felt ", *s.apparent_mass_kg) + format("of %.3g kg wanted", s.wanted_mass_kg);
  }
  if (s.contacts == 0) return text + (text.empty() ? "nothing was touched" : "; nothing was touched");
  text += (text.empty() ? "tool within " : "; tool within ") + length(s.tool_penetration_max_m) + " of what it touches";
  if (s.contact_force_error_N) text += format(", its force within %.2g N", *s.contact_force_error_N);
  return text;
}

std::string summary_text(const Summary& s, const SummaryLook& look) {
  Lines line(look.colour);
  if (look.verbose) {
    tell_everything(s, line);
  } else {
    tell_in_brief(s, line);
  }
  const SummaryVerdict verdict = judge(s);
  line("verdict", verdict.text, verdict.tone);
  return line.text();
}

}  // namespace proxarm::controller
