// Reads the shapes of an arm's links and computes the links' poses. Only for pictures, never for control.
//
// Reads the URDF a second time, without MuJoCo: all links with their <visual> shapes. A shape that can't be drawn (a
// shape unknown to URDF, or a mesh file of another format) is left out and named in notes(), because an incomplete
// picture is better than no picture.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct DrawnBox {
  Vec3 size_m = Vec3::Ones();
};
struct DrawnCylinder {  // along z, with its centre at the origin
  double radius_m = 0.0, length_m = 0.0;
};
struct DrawnSphere {
  double radius_m = 0.0;
};
struct DrawnMesh {
  std::filesystem::path file;  // absolute
  Vec3 scale = Vec3::Ones();
};

struct LinkShape {
  std::variant<DrawnBox, DrawnCylinder, DrawnSphere, DrawnMesh> shape;
  Pose X_link = Pose::Identity();
  std::optional<std::array<double, 3>> colour;  // red, green, blue, 0 to 1
};

struct DrawnLink {
  std::string name;
  int parent = -1;                   // index of the parent link; −1: this link is the root
  Pose X_parent = Pose::Identity();  // the pose of the joint in the parent link at joint angle zero
  Vec3 axis = Vec3::UnitX();         // the axis of the joint, in this link
  int drive = -1;                    // index in the cell's drives; −1: the joint is fixed
  bool slides = false;               // true: prismatic along the axis, in m; false: revolute
  std::vector<LinkShape> shapes;
};

class LinkTree {
 public:
  // Throws description::SetupError if the URDF can't be read.
  explicit LinkTree(const description::Cell& cell);

  // Returns all links, each parent before its children.
  [[nodiscard]] const std::vector<DrawnLink>& links() const noexcept { return links_; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }
  // Computes the pose of each link in W, for joint angles in the order of the cell's drives.
  void place(const JointVector& q, std::vector<Pose>& X_W) const;

 private:
  std::vector<DrawnLink> links_;
  std::vector<std::string> notes_;
  Pose X_WB_;
};

}  // namespace proxarm::models
