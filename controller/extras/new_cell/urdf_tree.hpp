// Reads the tree of links and joints in a URDF, and finds the chain to the sensor.
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::command_line {

// Returns the element's attribute `name`; empty if the element or the attribute is missing.
std::string text_of(const tinyxml2::XMLElement* element, const char* name);

struct UrdfTreeJoint {
  tinyxml2::XMLElement* element = nullptr;
  std::string name, type, parent, child;
  bool mimic = false;
  [[nodiscard]] bool moves() const { return !mimic && (turns() || type == "prismatic"); }
  [[nodiscard]] bool turns() const { return type == "revolute" || type == "continuous"; }
  [[nodiscard]] models::Vec3 origin() const;  // in the frame of the parent link
  [[nodiscard]] models::Vec3 axis() const;    // not normalized
};

class UrdfTree {
 public:
  using Path = std::vector<const UrdfTreeJoint*>;

  // Reads the URDF's text `xml`. `file` is named in error messages. Throws SetupError with the line in the file.
  UrdfTree(const std::filesystem::path& file, const std::string& xml);

  [[nodiscard]] tinyxml2::XMLElement* robot() const { return robot_; }
  [[nodiscard]] tinyxml2::XMLDocument& document() { return document_; }
  [[nodiscard]] std::vector<UrdfTreeJoint>& joints() { return joints_; }
  [[nodiscard]] const std::map<std::string, tinyxml2::XMLElement*>& links() const { return links_; }
  [[nodiscard]] const std::string& root() const { return root_; }

  // Returns the joints from the root to that link. Throws SetupError if there is no such link.
  [[nodiscard]] Path path_to(const std::string& link) const;
  // Returns the link for the sensor if the user named none. It is the link where the moving joints end or branch, or,
  // if one of the links fixed to that link has a usual name, such as tool0, the fixed link.
  [[nodiscard]] std::string found_tip() const;

 private:
  void require_numbers(const tinyxml2::XMLElement* element) const;
  void add_link(tinyxml2::XMLElement* element);
  void add_joint(tinyxml2::XMLElement* element);
  void find_root();
  [[nodiscard]] Path below(const std::string& link) const;
  // Returns the largest number of moving joints on a path that begins with this joint. This joint and mimic joints (a
  // gripper's second finger) count, too.
  [[nodiscard]] int motion_beyond(const UrdfTreeJoint& joint) const;
  [[nodiscard]] description::SetupError mistake(const tinyxml2::XMLElement* where, std::string message) const;

  std::filesystem::path file_;
  std::string root_;
  tinyxml2::XMLDocument document_;
  tinyxml2::XMLElement* robot_ = nullptr;
  std::map<std::string, tinyxml2::XMLElement*> links_;
  std::vector<UrdfTreeJoint> joints_;
};

}  // namespace proxarm::command_line
