#include "models/arm/link_tree.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "models/arm/arm_urdf.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::models {
namespace {

using tinyxml2::XMLElement;

// Returns the three numbers of an attribute, or `missing`.
Vec3 triple_of(const XMLElement* element, const char* name, const Vec3& missing) {
  const char* const text = element != nullptr ? element->Attribute(name) : nullptr;
  double x = 0.0, y = 0.0, z = 0.0;
  if (text == nullptr || std::sscanf(text, "%lf %lf %lf", &x, &y, &z) != 3) return missing;
  const Vec3 v(x, y, z);
  return v.allFinite() ? v : missing;
}

Pose origin_of(const XMLElement& element) {
  const XMLElement* const origin = element.FirstChildElement("origin");
  const Vec3 xyz = triple_of(origin, "xyz", Vec3::Zero()), rpy = triple_of(origin, "rpy", Vec3::Zero());
  return to_pose({{xyz.x(), xyz.y(), xyz.z()}, {rpy.x(), rpy.y(), rpy.z()}});
}

double size_of(const XMLElement& element, const char* name) {
  double value = 0.0;
  element.QueryDoubleAttribute(name, &value);
  return std::isfinite(value) ? value : 0.0;
}

// The named colours of the robot, for <material name="…">.
using Colours = std::map<std::string, std::array<double, 3>>;

std::optional<std::array<double, 3>> colour_of(const XMLElement* material, const Colours& named) {
  if (material == nullptr) return std::nullopt;
  if (const XMLElement* colour = material->FirstChildElement("color")) {
    const Vec3 rgb = triple_of(colour, "rgba", Vec3(0.5, 0.5, 0.5)).cwiseMax(0.0).cwiseMin(1.0);
    return std::array{rgb.x(), rgb.y(), rgb.z()};
  }
  const char* const name = material->Attribute("name");
  const auto found = named.find(name != nullptr ? name : "");
  return found != named.end() ? std::optional(found->second) : std::nullopt;
}

Colours colours_of(const XMLElement& robot) {
  Colours colours;
  for (auto* m = robot.FirstChildElement("material"); m != nullptr; m = m->NextSiblingElement("material")) {
    const auto colour = colour_of(m, {});
    if (colour && m->Attribute("name") != nullptr) colours[m->Attribute("name")] = *colour;
  }
  return colours;
}

// Searches for "package://name/path" in the URDF's folder and in the folders above it, because only ROS knows where the
// package is.
std::filesystem::path mesh_path(const std::filesystem::path& urdf, const std::string& name) {
  constexpr std::string_view package = "package://", file = "file://";
  if (name.compare(0, file.size(), file) == 0) return name.substr(file.size());
  if (name.compare(0, package.size(), package) != 0) return urdf.parent_path() / name;
  const std::string within = name.substr(std::min(name.find('/', package.size()), name.size() - 1) + 1);
  std::filesystem::path folder = urdf.parent_path();
  std::error_code ignored;
  while (folder.has_relative_path() && !std::filesystem::exists(folder / within, ignored))
    folder = folder.parent_path();
  return folder / within;
}

// Returns the shape of a <visual>, or nullopt if it can't be drawn.
std::optional<LinkShape> shape_of(const XMLElement& visual, const std::filesystem::path& urdf, const Colours& named) {
  const XMLElement* const geometry = visual.FirstChildElement("geometry");
  const XMLElement* const given = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
  if (given == nullptr) return std::nullopt;
  LinkShape shape;
  shape.X_link = origin_of(visual);
  shape.colour = colour_of(visual.FirstChildElement("material"), named);
  const std::string kind = given->Name();
  if (kind == "box") {
    shape.shape = DrawnBox{triple_of(given, "size", Vec3::Zero()).cwiseAbs()};
  } else if (kind == "cylinder") {
    shape.shape = DrawnCylinder{std::abs(size_of(*given, "radius")), std::abs(size_of(*given, "length"))};
  } else if (kind == "sphere") {
    shape.shape = DrawnSphere{std::abs(size_of(*given, "radius"))};
  } else if (kind == "mesh" && given->Attribute("filename") != nullptr) {
    shape.shape = DrawnMesh{mesh_path(urdf, given->Attribute("filename")), triple_of(given, "scale", Vec3::Ones())};
  } else {
    return std::nullopt;
  }
  return shape;
}

struct UrdfLinks {
  std::map<std::string, std::vector<LinkShape>> shapes;
  std::vector<std::string> notes;
};

UrdfLinks read_shapes(const XMLElement& robot, const std::filesystem::path& urdf) {
  UrdfLinks found;
  const Colours named = colours_of(robot);
  for (auto* link = robot.FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
    const std::string name = link->Attribute("name") != nullptr ? link->Attribute("name") : "";
    for (auto* v = link->FirstChildElement("visual"); v != nullptr; v = v->NextSiblingElement("visual")) {
      if (auto shape = shape_of(*v, urdf, named)) {
        found.shapes[name].push_back(std::move(*shape));
      } else {
        found.notes.push_back("link " + name + ": a visual in line " + std::to_string(v->GetLineNum()) +
                              " of the URDF can't be drawn");
      }
    }
  }
  return found;
}

}  // namespace

LinkTree::LinkTree(const description::Cell& cell) : X_WB_(to_pose(cell.base_W)) {
  const Urdf urdf = load_urdf(cell.urdf);  // throws unless the links are a tree
  tinyxml2::XMLDocument document;
  if (document.LoadFile(cell.urdf.c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
    throw description::SetupError({.file = cell.urdf.string(), .message = "can't be read a second time"});
  }
  const XMLElement& robot = *document.RootElement();
  UrdfLinks found = read_shapes(robot, cell.urdf);
  notes_ = std::move(found.notes);
  links_.emplace_back();
  links_[0].name = urdf.root_link;
  links_[0].shapes = std::move(found.shapes[urdf.root_link]);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    for (auto* joint = robot.FirstChildElement("joint"); joint != nullptr; joint = joint->NextSiblingElement("joint")) {
      const XMLElement* const parent = joint->FirstChildElement("parent");
      const XMLElement* const child = joint->FirstChildElement("child");
      if (parent == nullptr || child == nullptr || links_[i].name != parent->Attribute("link")) continue;
      DrawnLink link;
      link.name = child->Attribute("link");
      link.parent = static_cast<int>(i);
      link.X_parent = origin_of(*joint);
      link.axis = triple_of(joint->FirstChildElement("axis"), "xyz", Vec3::UnitX()).normalized();
      link.slides = std::string(joint->Attribute("type")) == "prismatic";
      const auto drive = std::find_if(cell.drives.begin(), cell.drives.end(),
                                      [&](const auto& d) { return d.joint == joint->Attribute("name"); });
      if (drive != cell.drives.end()) link.drive = static_cast<int>(drive - cell.drives.begin());
      link.shapes = std::move(found.shapes[link.name]);
      links_.push_back(std::move(link));
    }
  }
}

void LinkTree::place(const JointVector& q, std::vector<Pose>& X_W) const {
  X_W.resize(links_.size());
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const DrawnLink& link = links_[i];
    if (link.parent < 0) {
      X_W[i] = X_WB_;
      continue;
    }
    Pose X = X_W[static_cast<std::size_t>(link.parent)] * link.X_parent;
    if (link.drive >= 0) {
      const double angle = q[link.drive];
      if (link.slides) {
        X.translate(angle * link.axis);
      } else {
        X.rotate(Eigen::AngleAxisd(angle, link.axis));
      }
    }
    X_W[i] = X;
  }
}

}  // namespace proxarm::models
