// The summary for programs and for people.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "controller/report/summary.hpp"
#include "controller/stability/stability.hpp"
#include "models/files/json.hpp"

namespace proxarm::controller {
namespace {

using description::Json;

Json faults(const Summary& summary) {
  Json list = Json::array();
  for (const FaultSummary& fault : summary.faults) {
    list.push_back({{"fault", fault_name(fault.fault)},
                    {"cycle", fault.cycle},
                    {"text", fault.text},
                    {"was_reset", fault.was_reset}});
    if (fault.escalation != Fault::none) list.back()["escalation"] = fault_name(fault.escalation);
  }
  return list;
}

Json timesteps(const Summary& summary) {
  Json list = Json::array();
  for (const TimestepSummary& t : summary.timesteps) {
    list.push_back({{"time_s", t.time_s},
                    {"from_s", t.from_s},
                    {"to_s", t.to_s},
                    {"paused_s", t.paused_s},
                    {"refused", t.refused}});
  }
  return list;
}

Json idle_orders(const Summary& summary) {
  Json list = Json::array();
  for (const OrderSummary& order : summary.idle_orders) {
    list.push_back({{"order", order.order}, {"time_s", order.time_s}, {"refused", order.refused}});
  }
  return list;
}

void add_timing(Json& json, const Summary& s) {
  json["wall_time_s"] = s.wall_time_s;
  json["overruns"] = s.overruns;
  json["figures_s"] = s.figures_s;
  json["compute_us"] = {{"median", s.compute_us.median},
                        {"p99", s.compute_us.p99},
                        {"max", s.compute_us.max},
                        {"total", s.compute_us.total}};
  for (const auto& [name, latency] : s.latency_us) {
    json["latency_us"][name] = {{"median", latency.median},
                                {"p99", latency.p99},
                                {"p999", latency.p999},
                                {"max", latency.max},
                                {"histogram", latency.histogram}};
  }
  if (s.page_faults) json["page_faults"] = {{"minor", s.page_faults->minor}, {"major", s.page_faults->major}};
}

Json oscillation(const std::optional<Oscillation>& summary) {
  if (!summary) return nullptr;
  return {{"from_s", summary->from_s},
          {"duration_s", summary->duration_s},
          {"frequency_Hz", summary->frequency_Hz},
          {"amplitude_m", summary->amplitude_m},
          {"amplitude_rad", summary->amplitude_rad ? Json(*summary->amplitude_rad) : Json(nullptr)},
          {"lasts", summary->lasts}};
}

Json passivity(const std::optional<PassivitySummary>& summary) {
  if (!summary) return nullptr;
  const PortEnergies& e = summary->energies_J;
  return {{"hand_J", e.hand},
          {"proxy_J", e.proxy},
          {"world_J", e.world},
          {"kinetic_J", e.kinetic},
          {"damping_J", e.damping},
          {"added_damping_J", e.added},
          {"oscillating_time_s", summary->oscillating_time_s},
          {"oscillation_max_m_per_s", summary->oscillation_max_m_per_s},
          {"added_time_s", summary->added_time_s},
          {"added_damping_max_Ns_per_m", summary->added_damping_max_Ns_per_m},
          {"felt_damping_min_Ns_per_m", summary->felt_damping_min_Ns_per_m}};
}

Json poses(const std::optional<PosesSummary>& summary) {
  if (!summary) return nullptr;
  Json json{{"judged", summary->judged}, {"unstable", nullptr}};
  if (!summary->unstable) return json;
  const UnstablePlaces& there = *summary->unstable;
  const auto smallest = [&](bool is_lacking) { return is_lacking ? there.smallest_stable : std::nullopt; };
  json["unstable"] = {{"first_s", there.first_s},
                      {"worst_s", there.worst_s},
                      {"felt_mass_kg", there.felt_mass_kg},
                      {"felt_inertia_kg_m2", nullptr},
                      {"lacks", there.lacks_mass ? "mass" : "inertia"},
                      {"smallest_stable_mass_kg", smallest(there.lacks_mass)},
                      {"smallest_stable_inertia_kg_m2", smallest(!there.lacks_mass)}};
  if (there.felt_inertia_kg_m2 > 0.0) json["unstable"]["felt_inertia_kg_m2"] = there.felt_inertia_kg_m2;
  return json;
}

Json view(const std::optional<ViewSummary>& summary) {
  if (!summary) return nullptr;
  return {{"address", "127.0.0.1"},
          {"port", summary->port},
          {"most_viewers", summary->most_viewers},
          {"may_change", summary->may_change}};
}

// By frequency: Re and phase of F/a, and |F/a − M|/M.
Json felt_mass(const Summary& s) {
  Json list = Json::array();
  if (!(s.wanted_mass_kg > 0.0)) return list;
  for (const FeltMassCurve::Point& point : s.felt_mass) {
    list.push_back({{"frequency_Hz", point.frequency_Hz},
                    {"mass_kg", point.mass_kg.real()},
                    {"phase_deg", 180.0 / std::numbers::pi * std::arg(point.mass_kg)},
                    {"error", std::abs(point.mass_kg - s.wanted_mass_kg) / s.wanted_mass_kg}});
  }
  return list;
}

constexpr std::array<std::pair<const char*, double>, 3> felt_limits{{{"5 %", 0.05}, {"10 %", 0.1}, {"25 %", 0.25}}};

constexpr std::array space_axes{"x", "y", "z"};

Json felt_bands(const std::vector<FeltMassCurve::Point>& felt_mass, double wanted_kg) {
  if (felt_mass.empty() || !(wanted_kg > 0.0)) return nullptr;
  Json bands;
  for (const auto& [name, limit] : felt_limits) bands[name] = band_within_Hz(felt_mass, wanted_kg, limit);
  return bands;
}

Json felt_bands_along(const Summary& s) {
  Json along;
  for (std::size_t axis = 0; axis < space_axes.size(); ++axis) {
    along[space_axes[axis]] = felt_bands(s.felt_mass_along[axis], s.wanted_mass_kg);
  }
  return along;
}

void add_repeatable(Json& json, const Summary& s) {
  json["bus_load"] = Json::object();
  for (const auto& [bus, load] : s.bus_load) json["bus_load"][bus] = load;
  json["first_cycle_s"] = s.first_cycle_s;
  json["rendering_from_s"] = s.rendering_from_s;
  json["proxy_clearance_min_m"] = s.proxy_clearance_min_m;
  json["penetration_max_m"] = s.penetration_max_m;
  json["tool_penetration_max_m"] = s.tool_penetration_max_m;
  json["tool_penetration_touch_max_m"] = s.tool_penetration_touch_max_m;
  json["tool_penetration_sliding_max_m"] = s.tool_penetration_sliding_max_m;
  json["tracking_rms_m"] = s.tracking_rms_m;
  json["tracking_max_m"] = s.tracking_max_m;
  json["tracking_lag_rms_m"] = s.tracking_lag_rms_m;
  json["tracking_lag_max_m"] = s.tracking_lag_max_m;
  json["wanted_mass_kg"] = s.wanted_mass_kg > 0.0 ? Json(s.wanted_mass_kg) : Json(nullptr);
  json["apparent_mass_kg"] = s.apparent_mass_kg;
  json["apparent_damping_Ns_per_m"] = s.apparent_damping_Ns_per_m;
  json["felt_mass"] = felt_mass(s);
  json["felt_mass_band_Hz"] = felt_bands(s.felt_mass, s.wanted_mass_kg);
  json["felt_mass_band_Hz_along"] = felt_bands_along(s);
  json["unresolved_steps"] = s.unresolved_steps;
  json["wanted_inertia_kg_m2"] = s.wanted_inertia_kg_m2 > 0.0 ? Json(s.wanted_inertia_kg_m2) : Json(nullptr);
  json["apparent_inertia_kg_m2"] = s.apparent_inertia_kg_m2;
  json["apparent_turning_damping_Nms_per_rad"] = s.apparent_turning_damping_Nms_per_rad;
  json["contact_force_error_N"] = s.contact_force_error_N;
  json["contact_force_error_max_N"] = s.contact_force_error_max_N;
  json["friction_ratio_error"] = s.friction_ratio_error;
  json["pulling_force_max_N"] = s.pulling_force_max_N;
  json["drag_force_max_N"] = s.drag_force_max_N;
  json["rendered_time_s"] = s.rendered_time_s;
  json["contact_time_s"] = s.contact_time_s;
  json["sliding_time_s"] = s.sliding_time_s;
  json["contacts"] = s.contacts;
  json["limited_cycles"] = s.limited_cycles;
  json["active_limits"] = Json::object();
  json["limits"] = Json::array();
  for (const auto& [parameter, limit] : s.active_limits) {
    json["active_limits"][parameter] = limit.cycles;
    json["limits"].push_back({{"limit", parameter},
                              {"what", limit.words},
                              {"first_s", limit.first_s},
                              {"time_s", limit.time_s},
                              {"cycles", limit.cycles}});
  }
  json["lookahead_s"] = s.lookahead_s;
  json["oscillation"] = oscillation(s.oscillation);
  json["expected_swing"] = nullptr;
  if (s.expected_swing) {
    json["expected_swing"] = {{"frequency_Hz", s.expected_swing->frequency_Hz}, {"tenth_s", s.expected_swing->tenth_s}};
  }
  json["poses"] = poses(s.poses);
  json["passivity"] = passivity(s.passivity);
  json["hands_off_s"] = s.hands_off_s;
  json["guarded_cycles"] = s.guarded_cycles;
  json["limits_work_J"] = s.limits_work_J;
  json["limits_push_J"] = s.limits_push_J;
  json["held_samples"] = s.held_samples;
  json["source"] = s.from_truth ? "simulation" : "sensor and encoders";
  json["end"] = {{"reason", s.end.reason}, {"text", s.end.text}};
  json["idle_orders"] = idle_orders(s);
  json["drives_lack"] = s.drives_lack;
  json["faults"] = faults(s);
  json["notices"] = Json::array();
  for (const NoticeSummary& notice : s.notices) {
    json["notices"].push_back({{"fault", fault_name(notice.fault)},
                               {"reaction", reaction_name(notice.reaction)},
                               {"times", notice.times},
                               {"cycles", notice.cycles}});
  }
  json["timesteps"] = timesteps(s);
  json["setpoint_sha256"] = s.setpoint_sha256;
}

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

// A length with the unit that makes it readable: "12.3 µm", "0.45 mm", "0 m".
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

std::string summary_json(const Summary& s) {
  Json json;
  json["simulated_time_s"] = s.simulated_time_s;
  json["cycles"] = s.cycles;
  add_timing(json, s);
  add_repeatable(json, s);
  if (!s.black_box.empty()) json["black_box"] = s.black_box;
  json["view"] = view(s.view);
  return json.dump();
}

std::string repeatable_json(const Summary& s) {
  Json json;
  json["simulated_time_s"] = s.simulated_time_s;
  json["cycles"] = s.cycles;
  add_repeatable(json, s);
  return json.dump(2) + "\n";
}

std::string timing_json(const Summary& s) {
  Json json;
  add_timing(json, s);
  return json.dump(2) + "\n";
}

namespace {

// The summary's lines: names on the left, in a column of their own.
class Lines {
 public:
  void operator()(const char* name, const std::string& value) {
    text_ += "  ";
    text_ += name;
    text_.append(name[0] == '\0' ? 0 : 1, ':');
    const std::size_t width = std::char_traits<char>::length(name) + 1;
    text_.append(width < 26 ? 26 - width : 1, ' ');
    text_ += value + "\n";
  }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
};

// What it took: time, processor, buses.
void tell_time(const Summary& s, Lines& line) {
  line("time", format("%.3f s in ", s.simulated_time_s) + std::to_string(s.cycles) + " cycles, " +
                   format("%.3f s of it rendered; ", s.rendered_time_s) + format("wall clock %.2f s: ", s.wall_time_s) +
                   format("%.2f s for cycles, ", 1e-6 * s.compute_us.total) +
                   format("%.2f s for records and figures", s.figures_s));
  line("compute per cycle",
       format("median %.1f, ", s.compute_us.median) + format("p99 %.1f, ", s.compute_us.p99) +
           format("max %.1f µs; ", s.compute_us.max) +
           (s.virtual_time ? "virtual time waits for them" : "overruns " + std::to_string(s.overruns)));
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

// Up to which frequency the mass is what it should be, and what it is where that is worst.
// Up to which frequency the mass is right along each axis that the tool was moved along, the worst axis first.
std::string felt_along(const Summary& s) {
  const auto& [name, limit] = felt_limits[1];
  std::vector<std::pair<double, const char*>> along;
  for (std::size_t axis = 0; axis < space_axes.size(); ++axis) {
    const std::vector<FeltMassCurve::Point>& felt_mass = s.felt_mass_along[axis];
    if (felt_mass.empty()) continue;
    along.emplace_back(band_within_Hz(felt_mass, s.wanted_mass_kg, limit), space_axes[axis]);
  }
  std::sort(along.begin(), along.end());
  std::string text;
  for (const auto& [band_Hz, axis] : along) {
    text += (text.empty() ? "within " + std::string(name) + " along " : ", ") + std::string(axis);
    text += band_Hz > 0.0 ? format(" up to %.2g Hz", band_Hz) : " nowhere";
  }
  return text;
}

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

// Below, a world's force is rounding.
constexpr double noticeable_N = 1e-3;

// What was felt, and how true it was.
void tell_motion(const Summary& s, Lines& line) {
  line("apparent mass",
       number(s.apparent_mass_kg, "%.3f kg") +
           (s.wanted_mass_kg > 0.0 ? format(", wanted %.3f kg", s.wanted_mass_kg) : ", the device's own") +
           (s.apparent_damping_Ns_per_m ? format("; damping %.2f Ns/m", *s.apparent_damping_Ns_per_m) : "") +
           (s.limited_cycles > 0 ? "; where no limit acts" : ""));
  if (s.wanted_inertia_kg_m2 > 0.0) {
    line("apparent inertia", number(s.apparent_inertia_kg_m2, "%.5f kg m²") +
                                 format(", wanted %.5f kg m²", s.wanted_inertia_kg_m2) +
                                 (s.apparent_turning_damping_Nms_per_rad
                                      ? format("; damping %.3f Nms/rad", *s.apparent_turning_damping_Nms_per_rad)
                                      : ""));
  }
  if (s.lookahead_s > 0.0)
    line("lookahead", format("%.3g ms: the arm is sent to where the proxy will be", 1e3 * s.lookahead_s));
  tell_felt_mass(s, line);
  line("tracking error", "rms " + length(s.tracking_rms_m) + ", max " + length(s.tracking_max_m) +
                             format("; with the lag of %.3g ms: rms ", 1e3 * s.tracking_delay_s) +
                             length(s.tracking_lag_rms_m) + ", max " + length(s.tracking_lag_max_m));
  if (s.contacts == 0) {
    line("contact", s.proxy_clearance_min_m
                        ? "none; the nearest surface was " + length(s.proxy_clearance_min_m) + " away"
                        : "none");
  } else {
    line("contact", std::to_string(s.contacts) + (s.contacts == 1 ? " touch, " : " touches, ") +
                        format("%.2f s, ", s.contact_time_s) + format("%.2f s of it sliding", s.sliding_time_s));
  }
  if (s.unresolved_steps > 0) {
    line("unresolved", std::to_string(s.unresolved_steps) +
                           (s.unresolved_steps == 1 ? " step that keeps" : " steps that keep") +
                           " not all laws of contact");
  }
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

// Whether the loop was stable with this hand.
void tell_oscillation(const Summary& s, Lines& line) {
  if (!s.oscillation) return;
  if (s.oscillation->duration_s == 0.0) return line("oscillation", "none");
  line(s.oscillation->lasts ? "OSCILLATION" : "oscillation", oscillation_text(*s.oscillation));
  if (!s.oscillation->lasts) return;
  const char* larger = s.oscillation->amplitude_rad ? "mass, inertia or damping" : "mass or damping";
  line("", std::string("the loop isn't stable with this hand and arm: a larger ") + larger + ", a shorter timestep,");
  line("", "a longer setpoint filter; `proxarm tune` says which mass, and `damping added` what --passivity did");
}

// What kept the motion back, and the energy that went through it.
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

// What happened.
void tell_events(const Summary& s, Lines& line) {
  for (const NoticeSummary& notice : s.notices) {
    const std::string times = notice.times == 1 ? "once" : std::to_string(notice.times) + " times";
    line("noticed", fault_name(notice.fault) + (" " + times) + ", " + std::to_string(notice.cycles) +
                        " cycles; reaction: " + reaction_name(notice.reaction));
  }
  for (const TimestepSummary& t : s.timesteps) {
    line("timestep", format("%.4g to ", 1e3 * t.from_s) + format("%.4g ms ", 1e3 * t.to_s) +
                         format("at %.3f s, ", t.time_s) + format("%.0f ms without rendering", 1e3 * t.paused_s) +
                         (t.refused.empty() ? "" : "; not taken: " + t.refused));
  }
  for (const std::string& lack : s.drives_lack) line("lacking", lack);
  for (const OrderSummary& order : s.idle_orders) {
    line("order without effect", order.order + format(" at %.4g s: ", order.time_s) + order.refused);
  }
  if (!s.end.text.empty()) line("ended", s.end.text);
  if (s.faults.empty()) line("faults", "none");
  for (const FaultSummary& fault : s.faults) line(fault.was_reset ? "fault, then reset" : "FAULT", fault.text);
}

}  // namespace

std::string summary_text(const Summary& s) {
  Lines line;
  tell_time(s, line);
  tell_motion(s, line);
  tell_oscillation(s, line);
  if (s.poses && s.poses->unstable) line("not stable everywhere", poses_text(*s.poses->unstable));
  tell_limits(s, line);
  if (s.hands_off_s > 0.0) line("hands off", format("%.3g s: nobody at the handle, the arm stands", s.hands_off_s));
  if (s.held_samples > 0) line("sensor samples held", std::to_string(s.held_samples) + " cycles");
  line("figures from", s.from_truth ? "the simulation's truth" : "sensor and encoders");
  line("setpoints (SHA-256)", s.setpoint_sha256);
  line("view", view_text(s.view));
  tell_events(s, line);
  return line.text();
}

}  // namespace proxarm::controller
