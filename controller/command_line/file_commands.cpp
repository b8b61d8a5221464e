#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/library/cycle_work.hpp"
#include "controller/plausibility/doubts.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/file_kind.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/session/bring_up.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/arm_urdf.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/dbc_file.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "models/description/sensor_sources.hpp"
#include "models/files/eds_file.hpp"
#include "models/files/yaml_file.hpp"
#include "scenes/compiler/check.hpp"
#include "scenes/compiler/explain.hpp"
#include "scenes/format/scene_file.hpp"
#include "scenes/format/tool_file.hpp"
#include "scenes/mesh_files/mesh_report.hpp"
#include "scenes/rigid/compile_rigid.hpp"
#include "scenes/rigid/explain_rigid.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;

void tell(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
}

const char* const kUntouched = "nothing was touched";

// Checks Assumption 1 and the laws of contact for each object and for the whole scene, and prints the worst errors.
// Returns a text for people: what the scene is, or kUntouched if no object was touched. Returns null if the scene is
// wrong.
const char* check_laws(const scenes::Scene& scene, const scenes::CheckOptions& options) {
  if (const double deepest_m = scenes::deepest_push_m(scene, options); deepest_m < options.deepest_m) {
    std::printf("states push at most %.3g mm deep, a tenth of the least radius\n", 1e3 * deepest_m);
  }
  auto worst = scenes::CheckVerdict::fine;
  for (const scenes::CheckReport& report : scenes::check_scene(scene, options)) {
    std::fputs(report.text().c_str(), stdout);
    worst = std::max(worst, report.verdict());
  }
  switch (worst) {
    case scenes::CheckVerdict::fine:
      return "scene";
    case scenes::CheckVerdict::several_solutions:
      return "scene, with several solutions";
    case scenes::CheckVerdict::untouched:
      return kUntouched;
    case scenes::CheckVerdict::wrong:
      break;
  }
  return nullptr;
}

void tell_joined(const scenes::Scene& scene) {
  const scenes::Plan plan = scenes::compile(scene).plan;
  if (!plan.joined.empty()) std::printf("stand flush, and hold as one: %s\n", joined_text(scene, plan).c_str());
}

// Prints for each mesh what the loader did with the faces, and where the mesh lies.
void tell_meshes(const scenes::Scene& scene) {
  for (const scenes::Object& object : scene.objects) {
    const auto* const shape = std::get_if<scenes::MeshShape>(&object.shape);
    if (shape == nullptr || !shape->mesh) continue;
    std::printf("%s: %s; %s\n", object.name.c_str(), shape->account.text().c_str(),
                scenes::box_text(*shape->mesh).c_str());
    for (const std::string& line : scenes::unit_hints(*shape->mesh, shape->scale_m)) {
      std::printf("%s: %s\n", object.name.c_str(), line.c_str());
    }
  }
}

// Checks a scene file with a point as the tool. Throws SetupError if the scene's rigid tool can't be rendered with the
// scene's objects.
const char* check_scene_file(const scenes::Scene& scene, const scenes::CheckOptions& options) {
  if (scene.tool) {
    scenes::compile_rigid(scene, scene.tool->shape);
    std::fputs(
        "the laws of its objects, tried with a point; whether its tool fits is told by `proxarm check CELL --scene`\n",
        stdout);
  }
  tell(controller::scene_doubts(scene, std::nullopt));  // places are judged together with a cell
  if (!scene.tool) tell_joined(scene);
  tell_meshes(scene);
  return check_laws(scene, options);
}

void check_tool(const fs::path& file) {
  scenes::Scene nothing;
  nothing.tool = std::make_shared<const scenes::RigidTool>(scenes::load_tool(file));
  scenes::compile_rigid(nothing, nothing.tool->shape);
}

// Throws SetupError if the arm can't be simulated, for example because its gears are too stiff for the simulation's
// step.
void require_simulable(const controller::PreparedSession& session) {
  fieldbus::SimulatedCanNetwork network(sim::simulated_buses(session.cell));
  const sim::SimulatedCell far_end(session.cell, session.sensor, session.hand, network.events());
}

// Checks a cell together with the files that the cell names: builds each device as the controller would, and throws
// SetupError for what `run` would refuse. Returns a text for people: what the file is.
std::string check_cell(const fs::path& file, const fs::path& scene) {
  const description::Cell cell = description::load_cell(file);
  if (!cell.default_scene.empty()) description::require_default_file(cell, "default_scene", cell.default_scene);
  if (!cell.default_hand.empty()) description::require_default_file(cell, "default_hand", cell.default_hand);
  const models::Arm arm(cell);
  const std::int64_t period_ns = std::llround(1e9 * cell.default_period_s);
  std::vector<fieldbus::ServoDrive> servos;
  for (const description::DriveDescription& drive : cell.drives) {
    if (drive.on_can()) {
      servos.emplace_back(drive, fieldbus::DriveSettings{.period_ns = period_ns});
    } else {
      const fieldbus::ModbusDrive modbus(drive, description::load_modbus_drive(drive.description), period_ns);
    }
  }
  controller::RunOptions run;
  run.cell = file;
  run.scene = scene;
  const controller::PreparedSession session = controller::prepare(run);
  tell(controller::surprises(session));
  controller::require_runnable(session, run);
  require_simulable(session);
  std::vector<fieldbus::DriveSlot> slots;
  for (fieldbus::ServoDrive& servo : servos) slots.push_back({&servo, 0});
  tell(fieldbus::losses_of(slots));
  // To a millimetre, without a negative zero.
  const models::Vec3 start_W = (1e3 * arm.tool_pose(arm.start_rad()).translation()).array().round() / 1e3 + 0.0;
  std::ostringstream text;
  text << "cell; its tool starts at [" << start_W.x() << ", " << start_W.y() << ", " << start_W.z() << "] m";
  return text.str();
}

void tell_sources(const fs::path& file) {
  const description::SensorSources said = description::read_sensor_sources(description::YamlNode::load(file));
  for (const std::string& source : said.sources) std::printf("from: %s\n", source.c_str());
  if (!said.one_source_only.empty()) {
    std::printf("not held against a second source: %s\n", said.one_source_only.c_str());
  } else if (said.sources.empty()) {
    std::printf("the file doesn't say where its figures are from\n");
  }
}

// Prints a mesh's defects, which matter in some scenes only. Returns what the mesh can be used for.
const char* tell_mesh(const fs::path& file) {
  const scenes::LoadedMesh loaded = scenes::load_mesh(file, {});
  tell(scenes::mesh_report(loaded));
  return scenes::is_a_body(loaded)
             ? "mesh"
             : "mesh for a point tool; with a rigid tool it is refused, as an object and as the tool";
}

std::optional<std::string> check(const fs::path& file, const CheckFilesOptions& options) {
  switch (controller::kind_of(file)) {
    case controller::FileKind::cell:
      return check_cell(file, options.scene);
    case controller::FileKind::registers:
      tell(controller::register_doubts(description::load_modbus_drive(file)));
      return "register map of a Modbus drive";
    case controller::FileKind::eds:
      tell(description::load_eds(file).remarks);
      return "description of a CANopen device";
    case controller::FileKind::dbc:
      tell(description::load_dbc(file).remarks);
      return "list of messages and signals";
    case controller::FileKind::sensor:
      description::load_sensor(file);
      tell_sources(file);
      return "sensor";
    case controller::FileKind::tool:
      check_tool(file);
      return "tool";
    case controller::FileKind::hand:
      tell(controller::hand_doubts(description::load_hand(file), std::nullopt));
      return "hand";
    case controller::FileKind::urdf:
      models::compile(models::load_urdf(file));
      return "arm";
    case controller::FileKind::mesh:
      return tell_mesh(file);
    case controller::FileKind::scene:
    case controller::FileKind::unknown:
      if (const char* what = check_scene_file(scenes::load_scene(file), options.states)) return what;
      return std::nullopt;
  }
  return "";
}

}  // namespace

int check_command(const CheckFilesOptions& options) {
  int status = 0;
  for (const fs::path& given : options.files) {
    try {
      const std::optional<std::string> kind = check(controller::user_file(given), options);
      if (kind == kUntouched) {
        std::fprintf(stderr, "proxarm: %s: no verdict: no state touched anything; push deeper with --depth\n",
                     given.c_str());
        status = set_up_mistake;
      } else if (kind) {
        std::printf("%s: fine, %s %s\n", given.c_str(), kind->starts_with('a') ? "an" : "a", kind->c_str());
      } else {
        std::fprintf(stderr,
                     "proxarm: %s: it breaks a law; the state is given above, behind \"worst at\" or \"first at\"\n",
                     given.c_str());
        status = set_up_mistake;
      }
    } catch (const description::SetupError& error) {
      std::fprintf(stderr, "proxarm: %s\n", error.what());
      status = set_up_mistake;
    }
  }
  return status;
}

namespace {

// Describes what a cycle computes besides 𝒢, counted in a session of the default cell with this scene. If the cell
// can't render the scene, returns the reason.
std::string explain_cycle(const fs::path& scene) {
  controller::RunOptions options;
  options.scene = scene;
  try {
    const controller::PreparedSession session = controller::prepare(options);
    controller::require_runnable(session, options);
    return controller::work_text(session, controller::count_work(session));
  } catch (const description::SetupError& error) {
    return std::string("a cycle around that wasn't counted, since the default cell doesn't render it: ") +
           error.what() + "\n";
  }
}

}  // namespace

int explain_command(const FileOptions& options) {
  for (const fs::path& given : options.files) {
    const fs::path file = controller::user_file(given);
    controller::require_kind(file, controller::FileKind::scene);
    const scenes::Scene scene = scenes::load_scene(file);
    const std::string of_step = scene.tool ? scenes::explain_rigid(scene) : scenes::explain(scene);
    std::printf("%s: %s%s", given.c_str(), of_step.c_str(), explain_cycle(file).c_str());
  }
  return 0;
}

}  // namespace proxarm::command_line
