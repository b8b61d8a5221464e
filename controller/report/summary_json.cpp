// The summary for programs.
#include <array>
#include <cmath>
#include <numbers>

#include "controller/report/summary.hpp"
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
  Json json{{"judged", summary->judged}, {"unstable", nullptr}, {"places", Json::array()}};
  for (const PassedPoses::Place& place : summary->places) {
    json["places"].push_back({{"time_s", place.time_s},
                              {"felt_mass_kg", place.felt_mass_kg},
                              {"smallest_stable_mass_kg", place.smallest_stable_mass_kg}});
  }
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

// Returns by frequency: real part and phase of F/a, and |F/a − M|/M.
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
  json["gear_damping_per_s"] = s.gear_damping_per_s;
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

}  // namespace

std::string summary_json(const Summary& s) {
  Json json;
  json["simulated_time_s"] = s.simulated_time_s;
  json["cycles"] = s.cycles;
  add_timing(json, s);
  add_repeatable(json, s);
  if (!s.black_box.empty()) json["black_box"] = s.black_box;
  json["view"] = view(s.view);
  const SummaryVerdict verdict = judge(s);
  json["verdict"] = {{"word", verdict.word}, {"text", verdict.text}};
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

}  // namespace proxarm::controller
