// Arms that don't have six axes, shipped ones and chains of links of 0.4 m along x.
#pragma once

#include <fstream>
#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "tests/scratch_folder.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {

struct ChainJoint {
  std::string type, axis, rpy = "0 0 0";
};

inline description::Cell shipped_cell(const std::string& name) {
  return description::load_cell(source_file("models/cells/" + name + ".yaml"));
}

inline models::Arm shipped(const std::string& name) { return models::Arm(shipped_cell(name)); }

// arm150.urdf with its fourth joint fixed: five axes, without the roll of the forearm.
inline description::Cell five_axes_cell(const ScratchFolder& folder) {
  description::Cell cell = shipped_cell("default");
  std::ifstream file(cell.urdf);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string moving = "<joint name=\"axis_4\" type=\"revolute\">";
  text.replace(text.find(moving), moving.size(), "<joint name=\"axis_4\" type=\"fixed\">");
  cell.urdf = folder.path() / "five.urdf";
  std::ofstream(cell.urdf) << text;
  cell.drives.erase(cell.drives.begin() + 3);
  cell.start_rad.erase(cell.start_rad.begin() + 3);
  return cell;
}

// Each link lies along x of the joint before; `turned` is the attitude of the whole. All joints start at 0.5.
inline description::Cell chain_cell(const ScratchFolder& folder, const std::vector<ChainJoint>& joints,
                                    const std::string& turned = "0 0 0") {
  const std::string body =
      R"(<inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial>)";
  std::string urdf = R"(<robot name="chain"><link name="link_0"/>)";
  for (std::size_t i = 1; i <= joints.size(); ++i) {
    const ChainJoint& joint = joints[i - 1];
    const std::string n = std::to_string(i);
    urdf += "<joint name=\"joint_" + n + "\" type=\"" + joint.type + "\"><parent link=\"link_" + std::to_string(i - 1) +
            "\"/><child link=\"link_" + n + "\"/><origin xyz=\"" + (i == 1 ? "0" : "0.4") + " 0 0\" rpy=\"" +
            (i == 1 ? turned : joint.rpy) + "\"/><axis xyz=\"" + joint.axis +
            "\"/><limit lower=\"-2\" upper=\"2\" velocity=\"2\" effort=\"100\"/></joint><link name=\"link_" + n +
            "\">" + body + "</link>";
  }
  description::Cell cell = shipped_cell("default");
  cell.file = folder.path() / "chain.yaml";
  cell.urdf = folder.path() / "chain.urdf";
  std::ofstream(cell.urdf) << urdf << "</robot>";
  cell.sensor.link = "link_" + std::to_string(joints.size());
  cell.sensor.pose_link = {{0.3, 0.0, 0.0}, {}};
  cell.tool.handle_S = {{0.1, 0.0, 0.0}, {}};
  cell.drives.resize(joints.size(), cell.drives.front());
  cell.start_rad.assign(joints.size(), 0.5);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    cell.drives[i].joint = "joint_" + std::to_string(i + 1);
    cell.drives[i].range_rad = {-2.0, 2.0};
  }
  return cell;
}

inline models::Arm chain(const std::vector<ChainJoint>& joints, const std::string& turned = "0 0 0") {
  const ScratchFolder folder;
  return models::Arm(chain_cell(folder, joints, turned));
}

}  // namespace proxarm::tests
