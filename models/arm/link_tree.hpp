// The shapes and poses of an arm's links, for pictures; never for control.
//
// Reads the URDF a second time, without MuJoCo: all links, with their <visual> shapes. A shape that can't be drawn
// (unknown to URDF, or a mesh file of another format) is left out and named in notes(): an incomplete picture is better
// than none.
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
struct DrawnCylinder {  // along z, centred at the origin
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
  int parent = -1;                   // index of the parent link; −1: the root
  Pose X_parent = Pose::Identity();  // the joint's pose in the parent at angle zero
  Vec3 axis = Vec3::UnitX();         // the joint's, in the link
  int drive = -1;                    // index in the cell's drives; −1: fixed
  bool slides = false;               // prismatic along the axis, in m; otherwise revolute
  std::vector<LinkShape> shapes;
};

class LinkTree {
 public:
  // Throws description::SetupError if the URDF can't be read.
  explicit LinkTree(const description::Cell& cell);

  // All links, parents before their children.
  [[nodiscard]] const std::vector<DrawnLink>& links() const noexcept { return links_; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }
  // The pose of each link in W for joint angles in the order of the cell's drives.
  void place(const JointVector& q, std::vector<Pose>& X_W) const;

 private:
  std::vector<DrawnLink> links_;
  std::vector<std::string> notes_;
  Pose X_WB_;
};

}  // namespace proxarm::models
