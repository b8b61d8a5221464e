#include "controller/extras/new_cell/arm_source.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "controller/extras/new_cell/link_inertia.hpp"
#include "controller/extras/new_cell/urdf_tree.hpp"
#include "controller/extras/new_cell/xacro.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::in_quotes;
using description::SetupError;
using tinyxml2::XMLElement;

// Distance of the cell's limits from the URDF's limits, because setpoints overshoot a little.
constexpr double range_margin_rad = 0.02, range_margin_m = 0.005;
// The ends of the range of a joint without limits (a "continuous" one, or one with both limits 0), less than a turn to
// each side.
constexpr double unlimited_rad = 3.1, unlimited_m = 1.0;

// Returns an attribute of the joint's <limit>; 0 if the attribute is missing.
double limit_of(const UrdfTreeJoint& joint, const XMLElement* limit, const char* name, const fs::path& file) {
  double value = 0.0;
  const auto read = limit->QueryDoubleAttribute(name, &value);
  if (read == tinyxml2::XML_NO_ATTRIBUTE || (read == tinyxml2::XML_SUCCESS && std::isfinite(value))) return value;
  throw SetupError({.file = file.string(),
                    .line = limit->GetLineNum(),
                    .key = std::string(name) + " of joint " + in_quotes(joint.name),
                    .found = in_quotes(text_of(limit, name)),
                    .expected = "a finite number"});
}

ChainJoint described(const UrdfTreeJoint& joint, const fs::path& file, std::vector<std::string>& remarks) {
  ChainJoint out{.name = joint.name, .slides = joint.type == "prismatic"};
  XMLElement* limit = joint.element->FirstChildElement("limit");
  double low = 0.0, high = 0.0;
  if (limit != nullptr) {
    low = limit_of(joint, limit, "lower", file);
    high = limit_of(joint, limit, "upper", file);
    out.max_speed = std::max(0.0, limit_of(joint, limit, "velocity", file));
    out.max_effort = std::max(0.0, limit_of(joint, limit, "effort", file));
  } else {
    limit = joint.element->InsertNewChildElement("limit");
  }
  if (joint.type != "continuous" && low > high) {
    throw SetupError(
        {.file = file.string(),
         .line = limit->GetLineNum(),
         .key = "limit of joint " + in_quotes(joint.name),
         .found = "lower " + description::number_text(low) + " above upper " + description::number_text(high),
         .expected = "lower below upper, or both 0 for a joint without limits"});
  }
  if (joint.type == "continuous" || low == high) {
    high = out.slides ? unlimited_m : unlimited_rad;
    low = -high;
    joint.element->SetAttribute("type", out.slides ? "prismatic" : "revolute");
    limit->SetAttribute("lower", low);
    limit->SetAttribute("upper", high);
    remarks.push_back("joint " + joint.name + " has no limits: ±" + description::number_text(high) +
                      (out.slides ? " m" : " rad") + " are taken");
  }
  const double margin = std::min(out.slides ? range_margin_m : range_margin_rad, 0.05 * (high - low));
  // A range of more than a turn to each side doesn't help a hand, and slows the search for a start pose.
  const double most = out.slides ? 10.0 : 6.2;
  const auto rounded = [](double x) { return std::round(1e3 * x) / 1e3; };
  out.range = {rounded(std::max(low + margin, -most)), rounded(std::min(high - margin, most))};
  return out;
}

void fix_others(UrdfTree& tree, const UrdfTree::Path& chain, std::vector<std::string>& remarks) {
  for (UrdfTreeJoint& joint : tree.joints()) {
    const bool on_chain = std::find(chain.begin(), chain.end(), &joint) != chain.end();
    if (on_chain) continue;
    // The axis of a fixed joint has no meaning, and is often an invalid "0 0 0".
    while (auto* axis = joint.element->FirstChildElement("axis")) joint.element->DeleteChild(axis);
    if (joint.type == "fixed") continue;
    while (auto* mimic = joint.element->FirstChildElement("mimic")) joint.element->DeleteChild(mimic);
    joint.element->SetAttribute("type", "fixed");
    remarks.push_back("joint " + joint.name + (joint.mimic ? ", a mimic one," : "") + " is fixed: it isn't between " +
                      "the base and the sensor");
  }
}

// Converts a mesh's name, such as "package://NAME/rest" or "file://…", to a path; empty if there is no such file, or if
// the mesh can't be drawn.
std::string mesh_place(const std::string& name, const fs::path& urdf, const Packages& packages) {
  fs::path place = name.starts_with("file://") ? fs::path(name.substr(7)) : fs::path(name);
  if (name.starts_with("package://")) {
    const std::string rest = name.substr(10);
    const std::size_t slash = rest.find('/');
    const fs::path folder = packages.folder(rest.substr(0, slash));
    if (folder.empty() || slash == std::string::npos) return "";
    place = folder / rest.substr(slash + 1);
  }
  if (place.is_relative()) place = urdf.parent_path() / place;
  std::string extension = place.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  std::error_code ignored;
  const bool drawn = extension == ".stl" || extension == ".obj" || extension == ".ply";
  return drawn && fs::is_regular_file(place, ignored) ? fs::absolute(place).lexically_normal().string() : "";
}

// Gives the meshes of each link's visuals their paths. If these meshes can't be read (Collada), the link's collision
// shapes are drawn instead.
void place_shapes(UrdfTree& tree, const fs::path& file, const Packages& packages, std::vector<std::string>& remarks) {
  std::size_t lost = 0;
  for (const auto& named : tree.links()) {
    XMLElement* const link = named.second;
    const auto place_all = [&](const char* kind) {
      bool any = false;
      for (auto* shape = link->FirstChildElement(kind); shape != nullptr;) {
        auto* next = shape->NextSiblingElement(kind);
        auto* geometry = shape->FirstChildElement("geometry");
        auto* mesh = geometry != nullptr ? geometry->FirstChildElement("mesh") : nullptr;
        const std::string place = mesh != nullptr ? mesh_place(text_of(mesh, "filename"), file, packages) : "";
        if (mesh != nullptr && !place.empty()) mesh->SetAttribute("filename", place.c_str());
        if (mesh != nullptr && place.empty()) {
          link->DeleteChild(shape);
        } else {
          any = true;
        }
        shape = next;
      }
      return any;
    };
    const bool had = link->FirstChildElement("visual") != nullptr;
    const bool seen = place_all("visual"), felt = place_all("collision");
    for (auto* shape = link->FirstChildElement("collision"); shape != nullptr;) {
      auto* next = shape->NextSiblingElement("collision");
      if (seen || !felt) {
        link->DeleteChild(shape);
      } else {
        shape->SetName("visual");
      }
      shape = next;
    }
    if (had && !seen && !felt) ++lost;
  }
  if (lost == 0) return;
  remarks.push_back("the meshes of " + std::to_string(lost) +
                    " links aren't there or are none that is drawn (STL, OBJ, PLY): --package NAME=DIR says where");
}

void require_drivable(const UrdfTreeJoint& joint, const fs::path& file) {
  if (joint.moves() && !(joint.axis().norm() > 0.0)) {
    throw SetupError({.file = file.string(),
                      .line = joint.element->FirstChildElement("axis")->GetLineNum(),
                      .key = "axis of joint " + in_quotes(joint.name),
                      .found = in_quotes(text_of(joint.element->FirstChildElement("axis"), "xyz")),
                      .expected = "a direction"});
  }
  if (!joint.mimic && (joint.moves() || joint.type == "fixed")) return;
  throw SetupError({.file = file.string(),
                    .line = joint.element->GetLineNum(),
                    .found = joint.mimic ? "the mimic joint " + in_quotes(joint.name) + " between base and sensor"
                                         : "joint " + in_quotes(joint.name) + " of type " + in_quotes(joint.type) +
                                               " between base and sensor",
                    .expected = "joints that each have a drive (revolute, continuous, prismatic), and fixed ones",
                    .advice = "--tip takes a link before it"});
}

}  // namespace

ArmSource read_arm(const NewCellOptions& options) {
  const Packages packages(options.packages, options.arm);
  UrdfTree tree(options.arm, urdf_text(options.arm, options.xacro_arguments, packages));
  ArmSource out;
  out.name = text_of(tree.robot(), "name");
  out.tip = options.tip.empty() ? tree.found_tip() : options.tip;
  const UrdfTree::Path path = tree.path_to(out.tip);
  UrdfTree::Path chain;
  for (const UrdfTreeJoint* joint : path) {
    require_drivable(*joint, options.arm);
    if (joint->moves()) chain.push_back(joint);
  }
  constexpr std::size_t most = 7;
  if (chain.empty() || chain.size() > most) {
    const bool branches = options.tip.empty() && chain.empty() &&
                          std::any_of(tree.joints().begin(), tree.joints().end(), [](auto& j) { return j.moves(); });
    throw SetupError(
        {.file = options.arm.string(),
         .found = branches ? "chains of moving joints that branch at link " + in_quotes(out.tip)
                           : std::to_string(chain.size()) + " moving joints from " + tree.root() + " to " + out.tip,
         .expected = branches ? "one chain, or the link that carries the sensor" : "one to seven",
         .advice = "--tip LINK takes another link for the sensor"});
  }
  for (const UrdfTreeJoint* joint : chain) out.joints.push_back(described(*joint, options.arm, out.remarks));
  fix_others(tree, chain, out.remarks);
  estimate_inertia(tree, path, options.arm_mass_kg, out.remarks);
  place_shapes(tree, options.arm, packages, out.remarks);
  for (const char* theirs : {"transmission", "gazebo", "ros2_control", "mujoco"}) {
    while (auto* element = tree.robot()->FirstChildElement(theirs)) tree.robot()->DeleteChild(element);
  }
  tinyxml2::XMLPrinter printer;
  tree.document().Print(&printer);
  out.urdf = printer.CStr();
  return out;
}

}  // namespace proxarm::command_line
