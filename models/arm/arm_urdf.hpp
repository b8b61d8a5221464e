// Reads a URDF into a MuJoCo model, and avoids some of MuJoCo's defaults.
//
// By default MuJoCo 2.2.2 fuses links that are fixed to each other (so the flange disappears), silently ignores
// <mimic>, and opens mesh files. Therefore this reader parses the file first. It refuses <mimic>, removes shapes, and
// adds settings that keep every link; all this changes only the copy in memory. Each moving link must state its
// <inertial>. Errors are reported with file and line. For set-up, not for the cycle.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

struct mjModel_;

namespace proxarm::models {

struct UrdfJoint {
  std::string name, type, parent, child;
  int line = 0;
};

struct UrdfLink {
  std::string name;
  bool has_inertial = false;
  int line = 0;
};

struct Urdf {
  std::filesystem::path file;
  std::vector<UrdfJoint> joints;  // in the order of the file
  std::vector<UrdfLink> links;
  std::string root_link;
  std::string mujoco_xml;  // the text that is passed to MuJoCo
};

struct MujocoModelDeleter {
  void operator()(mjModel_* model) const noexcept;
};
using MujocoModel = std::unique_ptr<mjModel_, MujocoModelDeleter>;

// Both functions throw description::SetupError.
Urdf load_urdf(const std::filesystem::path& file);
MujocoModel compile(const Urdf& urdf);

}  // namespace proxarm::models
