#include "controller/live/session_status.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <vector>

#include "controller/preparation/session_loops.hpp"
#include "controller/supervision/fault.hpp"
#include "models/base/text.hpp"
#include "models/files/json.hpp"

namespace proxarm::controller {
namespace {

using description::Json;

// Number of cycles over which the tool's speed is averaged, so that the encoders' steps don't show.
constexpr std::uint64_t speed_cycles = 20;

struct Status {
  CycleRecord record;
  std::uint64_t cycles = 0;
  double rendered_s = 0.0, delay_s = 0.0, felt_mass_kg = 0.0, damping_Ns_per_m = 0.0, tool_speed_m_per_s = 0.0;
  std::string touches;  // the object's name; empty: no contact
  std::vector<std::string> limits;
};

// Returns the present status; nullopt before the first cycle.
std::optional<Status> present(const BoxReader& box, const PreparedSession& session) {
  // A BoxCycle has some kilobytes, too much for this thread's stack.
  const auto now = std::make_unique<BoxCycle>(), before = std::make_unique<BoxCycle>();
  Status status;
  status.cycles = box.cycles();
  if (status.cycles == 0 || !box.read(status.cycles - 1, *now)) return std::nullopt;
  const CycleRecord& record = status.record = now->record;
  status.rendered_s = 1e-9 * static_cast<double>(now->rendered_ns);
  status.delay_s = total_delay_s(session);
  // Where nothing is rendered, as in a hold, the record has no proxy's mass.
  const bool renders = record.proxy_mass_kg > 0.0;
  status.felt_mass_kg = renders ? record.proxy_mass_kg + record.tool_mass_kg : 0.0;
  status.damping_Ns_per_m = record.proxy_damping_Ns_per_m + record.added_damping_Ns_per_m;
  const std::uint64_t back = std::min(speed_cycles, status.cycles - 1);
  if (back > 0 && box.read(status.cycles - 1 - back, *before)) {
    const double elapsed_s = 1e-9 * static_cast<double>(record.time_ns - before->record.time_ns);
    const double way_m = (vec3(record.tool_W_m) - vec3(before->record.tool_W_m)).norm();
    status.tool_speed_m_per_s = elapsed_s > 0.0 ? way_m / elapsed_s : 0.0;
  }
  const auto object = static_cast<std::size_t>(record.contacts[0].object);
  if (record.contacts[0].object >= 0 && object < session.scene.objects.size()) {
    status.touches = session.scene.objects[object].name;
  }
  for (const auto& [flag, limit] : limit_flags) {
    if (record.has(flag)) status.limits.emplace_back(limit_parameter(limit));
  }
  return status;
}

Json fault_or_null(Fault fault) { return fault == Fault::none ? Json() : Json(fault_name(fault)); }
Json list_of(const Triple& v) { return Json(std::vector<double>(v.begin(), v.end())); }

std::string as_json(const std::optional<Status>& status, const PreparedSession& session) {
  Json json{{"version", 1}, {"cell", session.cell.name}, {"scene", session.scene.name}};
  json["phase"] = status ? phase_name(status->record.phase) : "starting";
  if (!status) return json.dump();
  const CycleRecord& record = status->record;
  json["fault"] = fault_or_null(record.fault);
  json["held_for"] = fault_or_null(record.held_for);
  json["cycles"] = status->cycles;
  json["rendered_s"] = status->rendered_s;
  json["timestep_s"] = 1e-9 * static_cast<double>(record.period_ns);
  json["delay_s"] = status->delay_s;
  json["felt_mass_kg"] = status->felt_mass_kg > 0.0 ? Json(status->felt_mass_kg) : Json();
  json["damping_Ns_per_m"] = status->damping_Ns_per_m;
  json["force_W_N"] = list_of(record.force_W_N);
  json["force_N"] = vec3(record.force_W_N).norm();
  json["tool_W_m"] = list_of(record.tool_W_m);
  json["tool_speed_m_per_s"] = status->tool_speed_m_per_s;
  json["leash_m"] = (vec3(record.tool_W_m) - vec3(record.proxy_W_m)).norm();
  json["touches"] = status->touches.empty() ? Json() : Json(status->touches);
  json["limits"] = status->limits;
  json["oscillates"] = record.has(RecordFlag::oscillation);
  json["sample_held"] = record.has(RecordFlag::sample_held);
  return json.dump();
}

std::string as_text(const std::optional<Status>& status) {
  if (!status) return "starting";
  const CycleRecord& record = status->record;
  std::string text = phase_name(record.phase);
  if (record.fault != Fault::none) text += std::string(" (") + fault_name(record.fault) + ")";
  if (record.held_for != Fault::none) text += std::string(", held for ") + fault_name(record.held_for);
  std::array<char, 200> figures{};
  std::snprintf(figures.data(), figures.size(), ": %.1f s rendered, %.3g N, %.3f m/s, ", status->rendered_s,
                vec3(record.force_W_N).norm(), status->tool_speed_m_per_s);
  text += figures.data();
  if (status->felt_mass_kg > 0.0) text += description::rounded_text(status->felt_mass_kg) + " kg, ";
  std::snprintf(figures.data(), figures.size(), "T %.4g ms, delay %.3g ms",
                1e-6 * static_cast<double>(record.period_ns), 1e3 * status->delay_s);
  text += figures.data();
  if (!status->touches.empty()) text += ", touches " + status->touches;
  for (const std::string& limit : status->limits) text += ", at " + limit;
  if (record.has(RecordFlag::oscillation)) text += ", OSCILLATES";
  return text;
}

}  // namespace

std::optional<std::string> session_status(const std::string& line, const BoxReader& box,
                                          const PreparedSession& session) {
  if (line == "status") return as_json(present(box, session), session);
  if (line == "status text") return as_text(present(box, session));
  return std::nullopt;
}

}  // namespace proxarm::controller
