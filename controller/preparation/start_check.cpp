#include "controller/preparation/start_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <set>

#include "controller/limits/step_limits.hpp"
#include "controller/plausibility/doubts.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/setpoints/held_weight.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/inverse_kinematics.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/modbus_drive.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/mesh/mesh_topology.hpp"
#include "models/rigid_shapes/solid.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/mesh_files/mesh_report.hpp"

namespace proxarm::controller {
namespace {

using description::SetupError;
using models::Vec3;

// How deep inside an object a start counts as on the object's surface, which is allowed. start_rad has four decimals in
// most files. Half a unit of the fourth decimal is 0.07 mm on an arm of 1.4 m, and the proxy's first step corrects such
// a depth.
constexpr double start_tolerance_m = 1e-4;

// The largest share of a drive's torque that the arm's weight may take without a warning. The rest is for accelerating
// and braking, friction (3 % in the default cell), the hand's pull (200 N at 1.5 m: 12 %), and the gears' overshoot.
constexpr double heavy_share = 0.4;

std::string point_text(const Vec3& point_W) {
  char text[96];
  std::snprintf(text, sizeof text, "x %.4f, y %.4f, z %.4f m", point_W.x(), point_W.y(), point_W.z());
  return text;
}

// Returns the smallest singular value of the tool's Jacobian in the start pose, in m/rad. The impedance type renders
// only forces at the tool's point, so with six or more axes only the Jacobian's rows of translation count for it.
double smallest_singular_value(const PreparedSession& session, const models::Arm& arm) {
  if (session.impedance() && arm.axes() >= 6) {
    models::ToolKinematics tool;
    arm.kinematics(arm.start_rad(), tool);
    return models::smallest_singular_value(tool.J_W.topRows<3>());
  }
  const models::InverseKinematics inverse(arm);
  models::InverseKinematicsResult result;
  inverse.solve(arm.start_rad(), arm.tool_pose(arm.start_rad()), result);
  inverse.measure_singularity(result);
  return result.smallest_singular_value_m_per_rad;
}

void require_regular(const PreparedSession& session, const models::Arm& arm) {
  const double limit = models::InverseKinematicsConfig{}.singular_m_per_rad;
  const double smallest = smallest_singular_value(session, arm);
  if (smallest >= limit) return;
  char found[160];
  std::snprintf(found, sizeof found, "a singular pose (smallest singular value %.2g m/rad)", smallest);
  throw SetupError(
      {.file = session.cell.file.string(),
       .key = "start_rad",
       .found = found,
       .expected = "a pose from which the tool can move in all directions, at least " +
                   description::number_text(limit) + " m/rad",
       .advice = arm.axes() < 6 ? "bend the elbow" : "bend the elbow and the wrist, such as axes 3 and 5"});
}

std::string vector_text(const Vec3& v) {
  char text[80];
  const auto rounded = [](double value) { return std::round(1e6 * value) / 1e6 + 0.0; };  // + 0.0 turns -0 into 0
  std::snprintf(text, sizeof text, "[%.6g, %.6g, %.6g]", rounded(v.x()), rounded(v.y()), rounded(v.z()));
  return text;
}

// Throws SetupError if the scene's space has directions in which the tool can't move.
void require_reachable_space(const PreparedSession& session, const models::Arm& arm, const Vec3& start_W) {
  // tool_space() tolerates 1e-3 for the cell's rounded numbers; the scene's rounded numbers may add as much again.
  constexpr double leaves = 2e-3;
  const models::ToolSpace reach = models::tool_space(arm);
  const scenes::Space& space = session.scene.space;
  const models::Mat3 off = models::Mat3::Identity() - reach.projection();
  const double beside = (off * space.axes.leftCols(space.dimensions)).colwise().norm().maxCoeff();
  if (beside < leaves) return;
  std::string axes = vector_text(reach.axes.col(0));
  if (reach.dimensions == 2) axes += ", " + vector_text(reach.axes.col(1));
  const char* kinds[] = {"nowhere", "a line along ", "a plane along "};
  throw SetupError({.file = session.scene.file.string(),
                    .key = "dimensions",
                    .found = std::to_string(space.dimensions) + ", in directions in which the tool of " +
                             session.cell.file.filename().string() + " (" + std::to_string(arm.axes()) +
                             (arm.axes() == 1 ? " axis" : " axes") + ") can't move",
                    .expected = kinds[reach.dimensions] + axes,
                    .advice = "write `dimensions: " + std::to_string(reach.dimensions) + "` and `space: {origin_m: " +
                              vector_text(start_W) + ", axes: [" + axes + "]}` into the scene"});
}

// Throws SetupError if the orientation is free and the arm has fewer than six axes, which can't turn the tool about all
// three axes.
void require_turning(const PreparedSession& session, const models::Arm& arm) {
  if (session.settings.orientation == OrientationMode::held || arm.axes() >= 6) return;
  throw SetupError({.key = "--orientation",
                    .found = "free, with " + std::to_string(arm.axes()) + (arm.axes() == 1 ? " axis" : " axes"),
                    .expected = "held: fewer than six axes can't turn the tool as a hand likes"});
}

// Returns the object in which the point lies deepest. Each object is judged without the others.
const scenes::Object* deepest(const scenes::Scene& scene, const Vec3& point_W) {
  const scenes::Object* found = nullptr;
  double least_m = std::numeric_limits<double>::infinity();
  for (const scenes::Object& object : scene.objects) {
    scenes::Scene alone;
    alone.objects.push_back(object);
    const double clearance_m = scenes::Clearances(alone).of_point(point_W);
    if (clearance_m >= least_m) continue;
    least_m = clearance_m;
    found = &object;
  }
  return found;
}

void require_outside(const PreparedSession& session, const Vec3& start_W) {
  const double clearance_m = session.clearances->of_point(start_W);
  if (clearance_m >= -start_tolerance_m) return;
  const scenes::Object* object = deepest(session.scene, start_W);
  char depth[32];
  std::snprintf(depth, sizeof depth, "%.3g m", -clearance_m);
  throw SetupError({.file = session.scene.file.string(),
                    .line = object != nullptr ? object->line : 0,
                    .key = object != nullptr ? object->name : "objects",
                    .found = "the start of the tool (" + point_text(start_W) + ") " + depth + " inside",
                    .expected = "a start in free space",
                    .advice = "move or turn the object, or change start_rad in the cell file"});
}

// Throws SetupError if a rigid tool starts inside an object, because 𝒢 can't lead a tool out of a solid. A tool may
// start in contact.
void require_room(const PreparedSession& session, const models::Pose& start) {
  const double clearance_m = session.rigid->clearance_m(models::tool_pose(start));
  if (clearance_m >= 0.0) return;
  char depth[64];
  std::snprintf(depth, sizeof depth, "%.3g mm inside of the scene's objects", -1e3 * clearance_m);
  throw SetupError({.file = session.scene.tool->file.string(),
                    .line = session.scene.tool->line,
                    .key = "tool",
                    .found = std::string("a tool that starts ") + depth,
                    .expected = "one that has room where it starts, at " + point_text(start.translation()),
                    .advice =
                        "a smaller tool (or a larger hole), another position_m of its parts, or another start_rad "
                        "in the cell file"});
}

template <int N>
double first_step_m(const scenes::CompiledScene& world, const Vec3& start_W) {
  const models::Vec<N> start = world.from_W<N>(start_W);
  return (world.algorithm<N>()(1.0, start, start) - start).norm();
}

// Throws SetupError if the tool doesn't start on the scene's guide. The guide would pull the proxy from there onto
// itself in one step.
void require_on_guide(const PreparedSession& session, const Vec3& start_W) {
  if (!session.scene.guide) return;
  const scenes::CompiledScene world = scenes::compile(session.scene);
  const double away_m = world.dimensions() == 2 ? first_step_m<2>(world, start_W) : first_step_m<3>(world, start_W);
  if (away_m <= start_tolerance_m) return;
  char found[64];
  std::snprintf(found, sizeof found, ") %.3g m away from it", away_m);
  throw SetupError({.file = session.scene.file.string(),
                    .line = session.scene.guide->line_number,
                    .key = "guide",
                    .found = "the start of the tool (" + point_text(start_W) + found,
                    .expected = "a guide that begins where the tool is",
                    .advice = "move the guide, or change start_rad in the cell file"});
}

// Throws SetupError if the tool doesn't start in the scene's space of one or two dimensions. The tool would keep its
// first distance from the space and thus from the proxy, so objects would be felt beside the place that the file gives
// them.
void require_in_space(const PreparedSession& session, const Vec3& start_W) {
  const scenes::Space& space = session.scene.space;
  const auto axes = space.axes.leftCols(space.dimensions);
  const Vec3 from_origin = start_W - space.origin_m;
  const double away_m = (from_origin - axes * (axes.transpose() * from_origin)).norm();
  if (away_m <= start_tolerance_m) return;
  char found[64];
  std::snprintf(found, sizeof found, ") %.3g m beside it", away_m);
  throw SetupError({.file = session.scene.file.string(),
                    .key = "space",
                    .found = "the start of the tool (" + point_text(start_W) + found,
                    .expected = "a space that the tool starts in",
                    .advice = "move space.origin_m, or change start_rad in the cell file"});
}

// Throws SetupError unless the tool starts inside the workspace and outside all keep-out boxes, at a distance of at
// least longest_setback_m from the boxes' borders.
void require_allowed(const PreparedSession& session, const models::Vec3& start_W) {
  const description::CellLimits& limits = session.cell.limits;
  // Returns whether the start is inside the box, made smaller on each side by less_m(the box's thickness along that
  // axis).
  const auto inside = [&](const std::array<double, 3>& min_m, const std::array<double, 3>& max_m, auto less_m) {
    const models::Vec3 min(min_m.data()), max(max_m.data());
    const models::Vec3 less = (max - min).unaryExpr(less_m);
    return (start_W.array() >= (min + less).array()).all() && (start_W.array() <= (max - less).array()).all();
  };
  char setback[32];
  std::snprintf(setback, sizeof setback, "%.3g mm", 1e3 * longest_setback_m);
  const auto refuse = [&](const char* key, const char* expected) {
    throw SetupError({.file = session.cell.file.string(),
                      .key = key,
                      .found = "the start of the tool at " + point_text(start_W),
                      .expected = std::string(expected) + ", " + setback + " from its borders at least",
                      .advice = "change the box, or start_rad"});
  };
  if (!inside(limits.workspace_min_m, limits.workspace_max_m, border_setback_m)) {
    refuse("limits.workspace_m", "a start inside of it");
  }
  for (const description::BoxDescription& zone : limits.keep_out) {
    const auto more = [](double /*thickness_m*/) { return -longest_setback_m; };
    if (inside(zone.min_m, zone.max_m, more)) refuse("limits.keep_out_m", "a start outside of all of them");
  }
}

// Returns the weight's torque and a share of the drive's torque as text, for example "148 of the 132 Nm".
std::string weight_text(const models::Arm& arm, const HeldWeight& held, double share) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3g of the %.3g %s", held.weight_Nm, share * held.rated_Nm,
                arm.slides(held.axis) ? "N" : "Nm");
  return text;
}

const std::string& joint_of(const PreparedSession& session, const HeldWeight& held) {
  return session.cell.drives[static_cast<std::size_t>(held.axis)].joint;
}

// Throws SetupError if a drive can't hold the arm's weight in the start pose.
void require_weight_held(const PreparedSession& session, const models::Arm& arm) {
  const HeldWeight held = held_weight(arm, session.cell, arm.start_rad());
  if (held.share() < 1.0) return;
  throw SetupError({.file = session.cell.file.string(),
                    .key = "start_rad",
                    .found = "a pose in which the arm's weight takes " + weight_text(arm, held, 1.0) +
                             " that the drive of " + joint_of(session, held) + " has (max_torque_Nm)",
                    .expected = "a start that the drives can hold",
                    .advice = "start nearer to the base, or correct max_torque_Nm or the masses of the URDF"});
}

// Warns if the weight leaves a drive too little torque to accelerate and brake.
std::vector<std::string> weight_surprises(const PreparedSession& session, const models::Arm& arm) {
  if (session.impedance()) return {};  // its drives get torques, the weight's included, and no positions
  const HeldWeight most = heaviest_weight(arm, session.cell);
  if (most.share() < heavy_share) return {};
  return {session.cell.file.string() + ": " + joint_of(session, most) + ": at the worst the arm's weight takes " +
          weight_text(arm, most, heavy_share) + " that it should take at most (two fifths of max_torque_Nm): near " +
          (most.share() < 1.0 ? "full stretch the drive may lag behind quick motions"
                              : "such poses the drive can't hold it")};
}

// Warns of a simulated hand that pulls at the start: the tare would take the hand's force for the sensor's zero, or
// raise Fault::force_at_start.
std::vector<std::string> hand_surprises(const PreparedSession& session) {
  const description::HandDescription& hand = session.hand;
  std::array<double, 3> at_m{};
  if (!hand.waypoints.empty()) at_m = hand.waypoints.front().offset_m;
  if (!hand.trajectory.empty()) at_m = hand.trajectory.front().value;
  const double way_m = std::hypot(at_m[0], at_m[1], at_m[2]);
  if (!(way_m > 0.0) || !(hand.stiffness_N_per_m > 0.0)) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                ": begins %.3g m beside the handle, so it pulls by %.3g N while the sensor is tared; "
                "begin with offset_m: [0, 0, 0]",
                way_m, std::min(hand.max_force_N, way_m * hand.stiffness_N_per_m));
  return {hand.file.string() + text};
}

std::vector<std::string> tool_surprises(const scenes::RigidTool& tool, double reach_m) {
  const double tool_m = models::reach_of(tool.shape);
  if (tool_m <= reach_m) return {};
  return {tool.file.string() + ":" + std::to_string(tool.line) + ": the tool comes " + models::size_text(tool_m) +
          " from its reference point, and the arm reaches " + models::size_text(reach_m) +
          ": are its sizes in metres? (of a mesh: scale_m)"};
}

}  // namespace

void require_usable_start(const PreparedSession& session) {
  const models::Arm arm(session.cell);
  require_regular(session, arm);
  require_turning(session, arm);
  const models::Vec3 start_W = arm.tool_pose(arm.start_rad()).translation();
  require_reachable_space(session, arm, start_W);
  require_in_space(session, start_W);
  if (session.scene.tool) {
    require_room(session, arm.tool_pose(arm.start_rad()));
  } else {
    require_outside(session, start_W);
  }
  require_on_guide(session, start_W);
  require_allowed(session, start_W);
  require_weight_held(session, arm);
}

void require_runnable(const PreparedSession& session, const RunOptions& options) {
  require_usable_start(session);
  require_enabling_switch(session, options);
  require_stable(session, options);
  if (options.bus.simulated()) require_carried(session, options);
}

std::vector<std::string> surprises(const PreparedSession& session) {
  const models::Arm arm(session.cell);
  const ToolReach reach = tool_reach(arm);
  std::vector<std::string> lines = cell_doubts(session.cell, arm);
  const auto add = [&](const std::vector<std::string>& more) { lines.insert(lines.end(), more.begin(), more.end()); };
  std::set<std::filesystem::path> maps;  // of registers; several drives may have one
  for (const description::DriveDescription& drive : session.cell.drives) {
    if (drive.on_can() || !maps.insert(drive.description).second) continue;
    add(register_doubts(description::load_modbus_drive(drive.description)));
  }
  add(scene_doubts(session.scene, reach));
  add(hand_doubts(session.hand, reach));
  add(weight_surprises(session, arm));
  add(hand_surprises(session));
  if (session.scene.tool) add(tool_surprises(*session.scene.tool, reach.most_m));
  for (const scenes::Object& object : session.scene.objects) {
    const auto* const mesh = std::get_if<scenes::MeshShape>(&object.shape);
    if (mesh == nullptr || !mesh->mesh) continue;
    for (const std::string& line : scenes::mesh_surprises(*mesh->mesh, reach.most_m, mesh->scale_m)) {
      lines.push_back(session.scene.file.string() + ":" + std::to_string(object.line) + ": " + object.name + " (" +
                      mesh->file.filename().string() + "): " + line);
    }
  }
  return lines;
}

void warn_of_surprises(const PreparedSession& session) {
  for (const std::string& line : surprises(session)) std::fprintf(stderr, "proxarm: warning: %s\n", line.c_str());
}

void require_enabling_switch(const PreparedSession& session, const RunOptions& options) {
  if (options.enabling.empty()) return;
  const auto refuse = [](const char* found, const char* expected, const char* advice) {
    throw SetupError({.key = "--enabling", .found = found, .expected = expected, .advice = advice});
  };
  if (!session.cell.enabling_input) {
    refuse("a cell without an enabling input", "one whose file has enabling_input",
           "in a copy of models/cells/default.yaml: enabling_input: {drive: axis_6, bit: 16} "
           "(docs/reference/supervision.md)");
  }
  if (session.settings.without_enabling_input) refuse("--without-enabling-input", "one of the two", "");
  const bool squeezed = std::any_of(options.enabling.begin(), options.enabling.end(),
                                    [](const sim::PressedSpan& span) { return span.squeezed; });
  if (squeezed && !session.cell.enabling_input->three_position) {
    refuse("squeezed, with a switch of two positions", "one whose file has enabling_input: three_position", "");
  }
}

void require_nodes_apart(const PreparedSession& session, const std::vector<std::string>& interfaces) {
  const auto interface_of = [&](const description::DriveDescription& drive) {
    std::size_t i = 0;
    while (i + 1 < interfaces.size() && session.cell.buses[i].name != drive.bus) ++i;
    return interfaces[i];
  };
  const auto& drives = session.cell.drives;
  for (std::size_t second = 0; second < drives.size(); ++second) {
    for (std::size_t first = 0; first < second; ++first) {
      if (!drives[first].on_can() || !drives[second].on_can()) continue;
      if (drives[first].node != drives[second].node) continue;
      if (interface_of(drives[first]) != interface_of(drives[second])) continue;
      throw SetupError({.bus = interface_of(drives[second]),
                        .node = drives[second].node,
                        .key = "--bus",
                        .found = "the drives of " + drives[first].joint + " and " + drives[second].joint +
                                 " with one node on one interface",
                        .expected = "each node once on an interface",
                        .advice = "set one of them to another node, or give their buses an interface each"});
    }
  }
}

void refuse_simulated_options(const RunOptions& options, const std::filesystem::path& arm) {
  const char* key = !arm.empty()                ? "--arm"
                    : !options.faults.empty()   ? "--fault"
                    : !options.enabling.empty() ? "--enabling"
                    : !options.hand.empty()     ? "--hand"
                                                : nullptr;
  if (key == nullptr) return;
  throw SetupError({.key = key,
                    .found = "a bus that isn't simulated",
                    .expected = "--bus sim, where the arm is simulated",
                    .advice = "on an interface, give it to `proxarm sim`"});
}

void require_view(const RunOptions& options) {
  if (options.view || (options.view_port == 0 && options.allowed_origins.empty())) return;
  throw description::SetupError({.key = options.view_port != 0 ? "--view-port" : "--allow-origin",
                                 .found = "no view",
                                 .expected = "--view with it"});
}

}  // namespace proxarm::controller
