#include "sim/physics/arm_model.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "sim/physics/pose.hpp"

namespace proxarm::sim {
namespace {

using description::Cell;
using description::SetupError;

constexpr const char* handle_link = "proxarm_handle";
constexpr const char* hand_link = "proxarm_hand";

std::string numbers(const double* values, std::size_t count) {
  std::string text;
  std::array<char, 40> one{};
  for (std::size_t i = 0; i < count; ++i) {
    std::snprintf(one.data(), one.size(), "%s%.17g", i == 0 ? "" : " ", values[i]);
    text += one.data();
  }
  return text;
}

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) text.replace(at, 1, ", ");
  return text;
}

void read_urdf(const Cell& cell, tinyxml2::XMLDocument& document) {
  const std::string path = cell.urdf.string();
  if (document.LoadFile(path.c_str()) == tinyxml2::XML_SUCCESS) return;
  const tinyxml2::XMLError error = document.ErrorID();
  const bool unreadable = error == tinyxml2::XML_ERROR_FILE_NOT_FOUND || error == tinyxml2::XML_ERROR_FILE_READ_ERROR ||
                          error == tinyxml2::XML_ERROR_FILE_COULD_NOT_BE_OPENED;
  throw SetupError({.file = path,
                    .line = unreadable ? 0 : document.ErrorLineNum(),
                    .message = unreadable ? "the arm's URDF can't be read" : "the arm's URDF isn't well-formed XML"});
}

void remove_children(tinyxml2::XMLElement& parent, const char* name) {
  while (auto* child = parent.FirstChildElement(name)) parent.DeleteChild(child);
}

// Throws SetupError for <mimic>, which MuJoCo would silently ignore. Removes shapes from the URDF: they aren't needed,
// and their meshes would only be more files that can be missing.
void refuse_and_strip(const Cell& cell, tinyxml2::XMLElement& robot) {
  for (auto* joint = robot.FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint")) {
    if (const auto* mimic = joint->FirstChildElement("mimic")) {
      throw SetupError({.file = cell.urdf.string(),
                        .line = mimic->GetLineNum(),
                        .key = "mimic",
                        .message = "coupled joints can't be simulated",
                        .advice = "make the joint independent or fixed"});
    }
  }
  for (auto* link = robot.FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    remove_children(*link, "visual");
    remove_children(*link, "collision");
  }
  remove_children(robot, "mujoco");
}

struct Payload {
  const char* name;
  std::string parent;
  description::PoseDescription pose;  // in the parent's frame
  double mass_kg;
  std::array<double, 3> centre_of_mass_m;
  std::array<double, 6> inertia_kg_m2;  // ixx iyy izz ixy ixz iyz
};

void add_payload(tinyxml2::XMLElement& robot, const Payload& payload) {
  auto* link = robot.InsertNewChildElement("link");
  link->SetAttribute("name", payload.name);
  auto* inertial = link->InsertNewChildElement("inertial");
  inertial->InsertNewChildElement("origin")->SetAttribute("xyz", numbers(payload.centre_of_mass_m.data(), 3).c_str());
  inertial->InsertNewChildElement("mass")->SetAttribute("value", numbers(&payload.mass_kg, 1).c_str());
  auto* inertia = inertial->InsertNewChildElement("inertia");
  constexpr std::array<const char*, 6> names{"ixx", "iyy", "izz", "ixy", "ixz", "iyz"};
  for (std::size_t i = 0; i < names.size(); ++i)
    inertia->SetAttribute(names[i], numbers(&payload.inertia_kg_m2[i], 1).c_str());

  auto* joint = robot.InsertNewChildElement("joint");
  joint->SetAttribute("name", (std::string(payload.name) + "_joint").c_str());
  joint->SetAttribute("type", "fixed");
  joint->InsertNewChildElement("parent")->SetAttribute("link", payload.parent.c_str());
  joint->InsertNewChildElement("child")->SetAttribute("link", payload.name);
  auto* origin = joint->InsertNewChildElement("origin");
  origin->SetAttribute("xyz", numbers(payload.pose.position_m.data(), 3).c_str());
  origin->SetAttribute("rpy", numbers(payload.pose.rpy_rad.data(), 3).c_str());
}

// Returns the inertia of a point mass: at least 0.4 m r² of a ball with a radius of 1 mm, because MuJoCo needs an
// inertia above zero. That is 1e-5 of the smallest inertia of a wrist.
std::array<double, 6> point_inertia(double mass_kg, double inertia_kg_m2 = 0.0) {
  const double i = std::max(inertia_kg_m2, 0.4e-6 * mass_kg);
  return {i, i, i, 0.0, 0.0, 0.0};
}

void add_payloads(const Cell& cell, double hand_mass_kg, double hand_inertia_kg_m2, tinyxml2::XMLElement& robot) {
  const auto& tool = cell.tool;
  if (tool.mass_kg > 0.0) {
    const bool point = tool.inertia_kg_m2 == std::array<double, 6>{};
    add_payload(robot, {handle_link, cell.sensor.link, cell.sensor.pose_link, tool.mass_kg, tool.centre_of_mass_S_m,
                        point ? point_inertia(tool.mass_kg) : tool.inertia_kg_m2});
  }
  if (hand_mass_kg > 0.0) {
    const models::Vec3 p = (to_pose(cell.sensor.pose_link) * to_pose(tool.handle_S)).translation();
    add_payload(robot, {hand_link,
                        cell.sensor.link,
                        {{p.x(), p.y(), p.z()}, {}},
                        hand_mass_kg,
                        {},
                        point_inertia(hand_mass_kg, hand_inertia_kg_m2)});
  }
}

void require_link(const Cell& cell, tinyxml2::XMLElement& robot) {
  for (auto* link = robot.FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    if (const char* name = link->Attribute("name"); name && cell.sensor.link == name) return;
  }
  throw SetupError({.file = cell.file.string(),
                    .key = "sensor.link",
                    .found = cell.sensor.link,
                    .expected = "a link of " + cell.urdf.string()});
}

ModelPointer compile(const Cell& cell, const std::string& urdf) {
  const auto vfs = std::make_unique<mjVFS>();
  mj_defaultVFS(vfs.get());
  constexpr const char* name = "arm.urdf";
  if (mj_makeEmptyFileVFS(vfs.get(), name, static_cast<int>(urdf.size())) != 0)
    throw SetupError({.file = cell.urdf.string(), .message = "out of memory for the arm's model"});
  std::memcpy(vfs->filedata[0], urdf.data(), urdf.size());
  std::array<char, 1000> error{};
  ModelPointer model(mj_loadXML(name, vfs.get(), error.data(), static_cast<int>(error.size())));
  mj_deleteVFS(vfs.get());
  if (!model) throw SetupError({.file = cell.urdf.string(), .message = "MuJoCo: " + one_line(error.data())});
  return model;
}

}  // namespace

ModelPointer load_links(const Cell& cell, double hand_mass_kg, double hand_inertia_kg_m2) {
  tinyxml2::XMLDocument document;
  read_urdf(cell, document);
  auto* robot = document.FirstChildElement("robot");
  if (!robot) throw SetupError({.file = cell.urdf.string(), .expected = "a <robot> element"});
  refuse_and_strip(cell, *robot);
  require_link(cell, *robot);
  add_payloads(cell, hand_mass_kg, hand_inertia_kg_m2, *robot);
  // Without fusestatic="false", MuJoCo would merge the links behind fixed joints with their parents, and the flange
  // among them.
  auto* compiler = document.NewElement("mujoco");
  compiler->InsertNewChildElement("compiler")->SetAttribute("fusestatic", "false");
  robot->InsertFirstChild(compiler);

  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  ModelPointer model = compile(cell, std::string(printer.CStr(), static_cast<std::size_t>(printer.CStrSize() - 1)));

  const models::Vec3 gravity_W(cell.gravity_W_m_per_s2.data());
  const models::Vec3 gravity_B = to_pose(cell.base_W).linear().transpose() * gravity_W;
  for (int i = 0; i < 3; ++i) model->opt.gravity[i] = gravity_B[i];
  return model;
}

}  // namespace proxarm::sim
