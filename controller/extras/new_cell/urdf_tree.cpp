#include "controller/extras/new_cell/urdf_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <set>
#include <sstream>
#include <utility>

namespace proxarm::command_line {

using description::in_quotes;
using description::SetupError;
using models::Vec3;
using tinyxml2::XMLElement;

namespace {

constexpr std::size_t most_joints = 1000;  // the time of searches grows with its square, the depth of recursion with it

// Attributes that must be finite numbers if they are there. Masses and inertias aren't among them, because invalid ones
// are replaced by estimates (link_inertia.hpp).
struct Numbers {
  const char *element, *attribute;
  int count;
};
constexpr std::array<Numbers, 7> numbers{{{"origin", "xyz", 3},
                                          {"origin", "rpy", 3},
                                          {"axis", "xyz", 3},
                                          {"mesh", "scale", 3},
                                          {"box", "size", 3},
                                          {"cylinder", "radius", 1},
                                          {"cylinder", "length", 1}}};

bool are_numbers(const char* text, int count) {
  for (int k = 0; k < count; ++k) {
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    if (end == text || !std::isfinite(value)) return false;
    text = end;
  }
  return text[std::strspn(text, " \t\r\n")] == '\0';
}

}  // namespace

std::string text_of(const XMLElement* element, const char* name) {
  const char* value = element != nullptr ? element->Attribute(name) : nullptr;
  return value != nullptr ? value : "";
}

namespace {

// Returns the attribute xyz of a joint's <origin> or <axis>; the default `otherwise` if the attribute is missing.
Vec3 vector_of(const XMLElement* element, const Vec3& otherwise) {
  std::istringstream in(text_of(element, "xyz"));
  double x = 0.0, y = 0.0, z = 0.0;
  return in >> x >> y >> z ? Vec3(x, y, z) : otherwise;
}

// Replaces processing instructions by blanks, so that line numbers stay. XML permits such instructions anywhere, but
// tinyxml2 permits them only at the beginning.
std::string without_instructions(std::string xml) {
  const auto end_of = [&](std::size_t from, const char* mark) {
    const std::size_t found = xml.find(mark, from);
    return found == std::string::npos ? xml.size() : found + std::strlen(mark);
  };
  for (std::size_t at = xml.find('<'); at < xml.size(); at = xml.find('<', at)) {
    if (xml.compare(at, 4, "<!--") == 0) {
      at = end_of(at + 4, "-->");
    } else if (xml.compare(at, 9, "<![CDATA[") == 0) {
      at = end_of(at, "]]>");
    } else if (xml.compare(at, 2, "<?") == 0) {
      const std::size_t end = end_of(at, "?>");
      std::replace_if(
          xml.begin() + static_cast<std::ptrdiff_t>(at), xml.begin() + static_cast<std::ptrdiff_t>(end),
          [](char c) { return c != '\n'; }, ' ');
      at = end;
    } else {
      ++at;
    }
  }
  return xml;
}

}  // namespace

Vec3 UrdfTreeJoint::origin() const { return vector_of(element->FirstChildElement("origin"), Vec3::Zero()); }
Vec3 UrdfTreeJoint::axis() const { return vector_of(element->FirstChildElement("axis"), Vec3::UnitX()); }

UrdfTree::UrdfTree(const std::filesystem::path& file, const std::string& xml) : file_(file) {
  if (document_.Parse(without_instructions(xml).c_str()) != tinyxml2::XML_SUCCESS) {
    throw SetupError({.file = file.string(), .line = document_.ErrorLineNum(), .message = "not XML"});
  }
  robot_ = document_.RootElement();
  if (robot_ == nullptr || std::strcmp(robot_->Name(), "robot") != 0) {
    throw SetupError({.file = file.string(), .found = "no <robot>", .expected = "a URDF or a xacro of one"});
  }
  for (auto* e = robot_->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (std::strcmp(e->Name(), "link") == 0) add_link(e);
    if (std::strcmp(e->Name(), "joint") == 0) add_joint(e);
    if (joints_.size() > most_joints) throw mistake(e, "more than a thousand joints: no arm");
  }
  find_root();
}

SetupError UrdfTree::mistake(const XMLElement* where, std::string message) const {
  return SetupError({.file = file_.string(), .line = where->GetLineNum(), .message = std::move(message)});
}

// Throws SetupError for an invalid number in the element or below it. The recursion is at most 500 calls deep, as
// tinyxml2 refuses files that are nested deeper.
void UrdfTree::require_numbers(const XMLElement* element) const {
  for (const Numbers& one : numbers) {
    const char* text = std::strcmp(element->Name(), one.element) == 0 ? element->Attribute(one.attribute) : nullptr;
    if (text == nullptr || are_numbers(text, one.count)) continue;
    throw SetupError({.file = file_.string(),
                      .line = element->GetLineNum(),
                      .key = std::string(one.attribute) + " of <" + one.element + ">",
                      .found = in_quotes(text),
                      .expected = one.count == 1 ? "a finite number" : "three finite numbers"});
  }
  for (auto* e = element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) require_numbers(e);
}

void UrdfTree::add_link(XMLElement* element) {
  require_numbers(element);
  const std::string name = text_of(element, "name");
  if (name.empty()) throw mistake(element, "a link without a name");
  if (!links_.emplace(name, element).second) throw mistake(element, "a second link named " + in_quotes(name));
}

// Adds a joint. Throws SetupError if its child link already has a joint above it: so the links below the root form a
// tree, and every search in the tree ends.
void UrdfTree::add_joint(XMLElement* element) {
  require_numbers(element);
  UrdfTreeJoint joint{element,
                      text_of(element, "name"),
                      text_of(element, "type"),
                      text_of(element->FirstChildElement("parent"), "link"),
                      text_of(element->FirstChildElement("child"), "link"),
                      element->FirstChildElement("mimic") != nullptr};
  for (const UrdfTreeJoint& other : joints_) {
    if (other.name == joint.name) throw mistake(element, "a second joint named " + in_quotes(joint.name));
    if (other.child == joint.child) throw mistake(element, "link " + in_quotes(joint.child) + " has a second parent");
  }
  joints_.push_back(std::move(joint));
}

void UrdfTree::find_root() {
  std::set<std::string> children;
  for (const UrdfTreeJoint& joint : joints_) {
    for (const std::string& end : {joint.parent, joint.child}) {
      if (links_.contains(end)) continue;
      throw mistake(joint.element,
                    "joint " + in_quotes(joint.name) + " names link " + in_quotes(end) + ", which isn't in the file");
    }
    children.insert(joint.child);
  }
  for (const auto& [name, element] : links_) {
    if (children.contains(name)) continue;
    if (!root_.empty()) {
      throw mistake(element,
                    "two roots: neither " + in_quotes(root_) + " nor " + in_quotes(name) + " is the child of a joint");
    }
    root_ = name;
  }
  if (root_.empty()) throw mistake(robot_, "no root: there is no link that is no joint's child");
  std::set<std::string> reached{root_};
  for (bool more = true; more;) {
    more = false;
    for (const UrdfTreeJoint& joint : joints_) {
      if (reached.contains(joint.parent)) more |= reached.insert(joint.child).second;
    }
  }
  for (const UrdfTreeJoint& joint : joints_) {
    if (reached.contains(joint.child)) continue;
    throw mistake(joint.element, "a loop: upwards from joint " + in_quotes(joint.name) + " there is no root");
  }
}

UrdfTree::Path UrdfTree::below(const std::string& link) const {
  Path found;
  for (const UrdfTreeJoint& joint : joints_) {
    if (joint.parent == link) found.push_back(&joint);
  }
  return found;
}

int UrdfTree::motion_beyond(const UrdfTreeJoint& joint) const {
  int most = 0;
  for (const UrdfTreeJoint* further : below(joint.child)) most = std::max(most, motion_beyond(*further));
  return most + (joint.moves() || joint.mimic ? 1 : 0);
}

UrdfTree::Path UrdfTree::path_to(const std::string& link) const {
  if (!links_.contains(link)) {
    std::string all;
    for (const auto& [name, element] : links_) all += (all.empty() ? "" : ", ") + name;
    throw SetupError(
        {.key = "--tip", .found = in_quotes(link), .expected = "a link of " + file_.string() + ": " + all});
  }
  Path path;
  for (std::string at = link;;) {
    const auto up =
        std::find_if(joints_.begin(), joints_.end(), [&](const UrdfTreeJoint& joint) { return joint.child == at; });
    if (up == joints_.end()) break;
    path.push_back(&*up);
    at = up->parent;
  }
  std::reverse(path.begin(), path.end());
  return path;
}

std::string UrdfTree::found_tip() const {
  std::string at = root(), last_moved = at;
  for (;;) {
    const UrdfTreeJoint* way = nullptr;
    int most = 0, second = 0;
    for (const UrdfTreeJoint* joint : below(at)) {
      const int joints = motion_beyond(*joint);
      second = std::max(second, std::min(joints, most));
      if (joints > most) way = joint;
      most = std::max(most, joints);
    }
    // Stops where no joint moves beyond, or where fingers or a second arm begin. A side branch such as a balancer
    // doesn't stop the search, because it has at least two moving joints fewer than the arm.
    if (way == nullptr || (second > 0 && most < second + 2)) break;
    at = way->child;
    if (way->moves()) last_moved = at;
  }
  // Of the links that are fixed to the last moving link, returns the one whose name ends with the earliest possible
  // name of this list.
  std::vector<std::string> fixed{last_moved};
  for (std::size_t k = 0; k < fixed.size(); ++k) {
    for (const UrdfTreeJoint* joint : below(fixed[k])) {
      if (!joint->moves() && !joint->mimic) fixed.push_back(joint->child);
    }
  }
  for (const char* name : {"tool0", "flange", "link8", "ee_link", "tcp"}) {
    for (const std::string& link : fixed) {
      if (link.ends_with(name)) return link;
    }
  }
  return last_moved;
}

}  // namespace proxarm::command_line
