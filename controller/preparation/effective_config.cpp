#include "controller/preparation/effective_config.hpp"
#include "controller/preparation/session_loops.hpp"

#include <yaml-cpp/yaml.h>

#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

using description::number_text;

// Returns a file's name without its folder, because a record must not depend on where the files are.
std::string name_of(const std::filesystem::path& file) { return file.filename().string(); }

void number(YAML::Emitter& out, const char* key, double value) {
  out << YAML::Key << key << YAML::Value << number_text(value);
}

}  // namespace

std::string effective_config(const PreparedSession& session) {
  const SessionSettings& settings = session.settings;
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "cell" << YAML::Value << name_of(session.cell.file);
  out << YAML::Key << "scene" << YAML::Value << name_of(session.scene.file);
  out << YAML::Key << "hand" << YAML::Value << name_of(session.hand.file);
  out << YAML::Key << "tool" << YAML::Value
      << (session.scene.tool ? name_of(session.scene.tool->file) : std::string("point"));
  number(out, "period_s", settings.period_s);
  number(out, "duration_s", session.duration_s);
  if (session.impedance()) {
    out << YAML::Key << "scheme" << YAML::Value << "impedance";
    number(out, "coupling_stiffness_N_per_m", settings.coupling_stiffness_N_per_m);
    number(out, "coupling_damping_Ns_per_m", settings.coupling_damping_Ns_per_m);
  }
  number(out, "mass_kg", settings.mass_kg);
  number(out, "tool_mass_kg", session.cell.tool.mass_kg);
  number(out, "damping_Ns_per_m", settings.damping_Ns_per_m);
  number(out, "spring_N_per_m", settings.spring_N_per_m);
  out << YAML::Key << "order" << YAML::Value << settings.order;
  number(out, "lookahead_s", settings.horizon_s);
  number(out, "gear_damping_per_s", settings.gear_damping_per_s);
  out << YAML::Key << "orientation" << YAML::Value << (settings.orientation == OrientationMode::held ? "held" : "free");
  constexpr const char* passivity[] = {"off", "observe", "auto", "on"};
  out << YAML::Key << "passivity" << YAML::Value << passivity[static_cast<int>(settings.passivity)];
  number(out, "sensor_delay_s", session.cell.sensor.delay_s);
  if (settings.orientation == OrientationMode::free) {
    number(out, "inertia_kg_m2", felt_inertia_kg_m2(session));
    number(out, "turning_damping_Nms_per_rad", settings.rotational_damping_Nms_per_rad);
    number(out, "turning_spring_Nm_per_rad", settings.rotational_spring_Nm_per_rad);
  }
  number(out, "tare_s", settings.tare_s);
  number(out, "total_delay_s", total_delay_s(session));
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace proxarm::controller
