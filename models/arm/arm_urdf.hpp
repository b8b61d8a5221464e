// Reads a URDF into a MuJoCo model without MuJoCo's surprises.
//
// MuJoCo 2.2.2 by itself fuses links that are fixed to each other (the flange disappears), ignores <mimic> in silence
// and opens mesh files. Here the file is read first: <mimic> is refused, shapes are dropped (kinematics and dynamics
// need none: each moving link must state its <inertial>), compiler settings that keep every link are added in memory,
// and mistakes are reported with file and line. For set-up only.
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
  std::vector<UrdfJoint> joints;  // in the file's order
  std::vector<UrdfLink> links;
  std::string root_link;
  std::string mujoco_xml;  // the file as MuJoCo is to see it
};

struct MujocoModelDeleter {
  void operator()(mjModel_* model) const noexcept;
};
using MujocoModel = std::unique_ptr<mjModel_, MujocoModelDeleter>;

// Both throw description::SetupError.
Urdf load_urdf(const std::filesystem::path& file);
MujocoModel compile(const Urdf& urdf);

}  // namespace proxarm::models
