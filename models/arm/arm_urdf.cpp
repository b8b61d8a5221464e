#include "models/arm/arm_urdf.hpp"

#include <mujoco/mujoco.h>
#include <tinyxml2.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>
#include <utility>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::models {
namespace {

using description::in_quotes;
using description::SetupError;

constexpr std::uintmax_t max_bytes = 16U << 20U;
constexpr std::size_t max_links = 500;

SetupError mistake(const std::filesystem::path& file, int line, std::string message, std::string advice = {}) {
  return SetupError({.file = file.string(), .line = line, .message = std::move(message), .advice = std::move(advice)});
}

std::string attribute(const Urdf& urdf, const tinyxml2::XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  if (value == nullptr || *value == '\0') {
    throw mistake(urdf.file, element.GetLineNum(), std::string("<") + element.Name() + "> has no " + name + "=\"…\"");
  }
  return value;
}

std::string linked(const Urdf& urdf, const tinyxml2::XMLElement& joint, const char* role) {
  const tinyxml2::XMLElement* element = joint.FirstChildElement(role);
  if (element == nullptr) {
    throw mistake(urdf.file, joint.GetLineNum(), std::string("<joint> has no <") + role + ">");
  }
  return attribute(urdf, *element, "link");
}

// Reports a wrong mass with its line. MuJoCo would accept a wrong mass of a link that doesn't move, or report it
// without a line.
void check_mass(const Urdf& urdf, const tinyxml2::XMLElement& link) {
  const tinyxml2::XMLElement* inertial = link.FirstChildElement("inertial");
  const tinyxml2::XMLElement* mass = inertial != nullptr ? inertial->FirstChildElement("mass") : nullptr;
  if (mass == nullptr) return;
  const std::string text = attribute(urdf, *mass, "value");
  double value_kg = 0.0;
  if (mass->QueryDoubleAttribute("value", &value_kg) == tinyxml2::XML_SUCCESS && value_kg >= 0.0 &&
      std::isfinite(value_kg)) {
    return;
  }
  throw SetupError({.file = urdf.file.string(),
                    .line = mass->GetLineNum(),
                    .key = "mass",
                    .found = in_quotes(text),
                    .expected = "a number of kg, zero or more"});
}

void check_axis(const Urdf& urdf, const tinyxml2::XMLElement& joint) {
  const tinyxml2::XMLElement* axis = joint.FirstChildElement("axis");
  if (axis == nullptr) return;  // URDF's default, the x axis
  const std::string text = attribute(urdf, *axis, "xyz");
  double x = 0.0, y = 0.0, z = 0.0;
  char rest = 0;
  const int numbers = std::sscanf(text.c_str(), "%lf %lf %lf %c", &x, &y, &z, &rest);
  const double length = std::hypot(x, y, z);
  if (numbers == 3 && std::isfinite(length) && length > 0.0) return;
  throw SetupError({.file = urdf.file.string(),
                    .line = axis->GetLineNum(),
                    .key = "axis",
                    .found = in_quotes(text),
                    .expected = "three numbers, not all zero"});
}

void read_joint(Urdf& urdf, const tinyxml2::XMLElement& element) {
  UrdfJoint joint{.name = attribute(urdf, element, "name"),
                  .type = attribute(urdf, element, "type"),
                  .parent = linked(urdf, element, "parent"),
                  .child = linked(urdf, element, "child"),
                  .line = element.GetLineNum()};
  if (const auto* mimic = element.FirstChildElement("mimic")) {
    throw mistake(urdf.file, mimic->GetLineNum(),
                  "joint " + in_quotes(joint.name) + " has <mimic>, which isn't supported",
                  "replace the joint by a fixed one, or drive it");
  }
  check_axis(urdf, element);
  for (const UrdfJoint& other : urdf.joints) {
    if (other.name == joint.name) {
      throw mistake(urdf.file, joint.line, "a second joint named " + in_quotes(joint.name),
                    "the first is in line " + std::to_string(other.line));
    }
    if (other.child == joint.child) {
      throw mistake(urdf.file, joint.line, "link " + in_quotes(joint.child) + " has a second parent",
                    "the first is joint " + in_quotes(other.name) + " in line " + std::to_string(other.line));
    }
  }
  urdf.joints.push_back(std::move(joint));
}

void read_link(Urdf& urdf, tinyxml2::XMLElement& element) {
  UrdfLink link{.name = attribute(urdf, element, "name"),
                .has_inertial = element.FirstChildElement("inertial") != nullptr,
                .line = element.GetLineNum()};
  for (const UrdfLink& other : urdf.links) {
    if (other.name == link.name) {
      throw mistake(urdf.file, link.line, "a second link named " + in_quotes(link.name),
                    "the first is in line " + std::to_string(other.line));
    }
  }
  check_mass(urdf, element);
  for (const char* shape : {"visual", "collision"}) {
    while (auto* child = element.FirstChildElement(shape)) element.DeleteChild(child);
  }
  urdf.links.push_back(std::move(link));
}

// Checks that joints connect existing links, and that exactly one link is the root.
void check_tree(Urdf& urdf) {
  std::set<std::string> names, children;
  for (const UrdfLink& link : urdf.links) names.insert(link.name);
  for (const UrdfJoint& joint : urdf.joints) {
    for (const std::string& end : {joint.parent, joint.child}) {
      if (!names.contains(end)) {
        throw mistake(urdf.file, joint.line,
                      "joint " + in_quotes(joint.name) + " names link " + in_quotes(end) + ", which isn't in the file");
      }
    }
    children.insert(joint.child);
  }
  for (const UrdfLink& link : urdf.links) {
    if (children.contains(link.name)) continue;
    if (!urdf.root_link.empty()) {
      throw mistake(urdf.file, link.line,
                    "two roots: neither " + in_quotes(urdf.root_link) + " nor " + in_quotes(link.name) +
                        " is the child of a joint");
    }
    urdf.root_link = link.name;
  }
  if (urdf.root_link.empty()) throw mistake(urdf.file, 0, "no root: every link is the child of a joint, in a circle");
}

void load_document(tinyxml2::XMLDocument& document, const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) throw mistake(file, 0, "no such file");
  if (std::filesystem::is_directory(status)) throw mistake(file, 0, "is a folder", "name the URDF in it");
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > max_bytes) throw mistake(file, 0, "is larger than 16 MiB", "is it the right file?");
  const tinyxml2::XMLError result = document.LoadFile(file.c_str());
  if (result == tinyxml2::XML_SUCCESS) return;
  if (result == tinyxml2::XML_ERROR_EMPTY_DOCUMENT) {
    throw mistake(file, 0,
                  size == 0 ? "the file is empty" : "no XML in the file: it is blank, or begins with a byte 0");
  }
  if (result == tinyxml2::XML_ERROR_FILE_COULD_NOT_BE_OPENED || result == tinyxml2::XML_ERROR_FILE_NOT_FOUND ||
      result == tinyxml2::XML_ERROR_FILE_READ_ERROR) {
    throw mistake(file, 0, "can't be read", "look at its permissions");
  }
  throw mistake(file, document.ErrorLineNum(), std::string("not XML: ") + document.ErrorName());
}

}  // namespace

void MujocoModelDeleter::operator()(mjModel_* model) const noexcept { mj_deleteModel(model); }

Urdf load_urdf(const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  load_document(document, file);
  Urdf urdf;
  urdf.file = file;
  tinyxml2::XMLElement* robot = document.RootElement();
  if (robot == nullptr || std::strcmp(robot->Name(), "robot") != 0) {
    throw mistake(file, robot == nullptr ? 0 : robot->GetLineNum(),
                  robot == nullptr ? "found no XML element, expected <robot> (a URDF)"
                                   : "found <" + std::string(robot->Name()) + ">, expected <robot> (a URDF)");
  }
  while (auto* theirs = robot->FirstChildElement("mujoco")) robot->DeleteChild(theirs);
  for (auto* element = robot->FirstChildElement(); element != nullptr; element = element->NextSiblingElement()) {
    if (std::strcmp(element->Name(), "joint") == 0) read_joint(urdf, *element);
    if (std::strcmp(element->Name(), "link") == 0) read_link(urdf, *element);
    if (urdf.links.size() > max_links) throw mistake(file, element->GetLineNum(), "more than 500 links");
  }
  if (urdf.links.empty()) throw mistake(file, robot->GetLineNum(), "no <link> in it");
  check_tree(urdf);
  auto* compiler = robot->InsertNewChildElement("mujoco")->InsertNewChildElement("compiler");
  compiler->SetAttribute("fusestatic", "false");
  compiler->SetAttribute("discardvisual", "true");
  compiler->SetAttribute("strippath", "false");
  // URDFs often contain rounded inertias for which the triangle inequality fails in the last digit. Without this
  // setting, MuJoCo refuses them.
  compiler->SetAttribute("balanceinertia", "false");
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  urdf.mujoco_xml = printer.CStr();
  return urdf;
}

MujocoModel compile(const Urdf& urdf) {
  // The object is on the heap, because MuJoCo's file system in memory has 2 MB of arrays.
  struct Vfs {
    std::unique_ptr<mjVFS> files = std::make_unique<mjVFS>();
    Vfs() { mj_defaultVFS(files.get()); }
    ~Vfs() { mj_deleteVFS(files.get()); }
    Vfs(const Vfs&) = delete;
    Vfs& operator=(const Vfs&) = delete;
  } vfs;
  constexpr const char* name = "arm.urdf";
  if (mj_makeEmptyFileVFS(vfs.files.get(), name, static_cast<int>(urdf.mujoco_xml.size())) != 0) {
    throw mistake(urdf.file, 0, "no memory for the URDF");
  }
  std::memcpy(vfs.files->filedata[mj_findFileVFS(vfs.files.get(), name)], urdf.mujoco_xml.data(),
              urdf.mujoco_xml.size());
  std::array<char, 1000> text{};
  MujocoModel model(mj_loadXML(name, vfs.files.get(), text.data(), static_cast<int>(text.size())));
  if (model == nullptr) {
    std::string message(text.data());
    for (char& c : message) c = c == '\n' ? ' ' : c;
    throw mistake(urdf.file, 0, "not a usable URDF: " + message,
                  "does each moving link have an <inertial> with mass and inertia?");
  }
  return model;
}

}  // namespace proxarm::models
