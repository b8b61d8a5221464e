// Converts poses from files to transforms.
#pragma once

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

// The orientation is R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF.
inline models::Pose to_pose(const description::PoseDescription& pose) {
  models::Pose X = models::Pose::Identity();
  X.linear() = (Eigen::AngleAxisd(pose.rpy_rad[2], models::Vec3::UnitZ()) *
                Eigen::AngleAxisd(pose.rpy_rad[1], models::Vec3::UnitY()) *
                Eigen::AngleAxisd(pose.rpy_rad[0], models::Vec3::UnitX()))
                   .toRotationMatrix();
  X.translation() = models::Vec3(pose.position_m.data());
  return X;
}

}  // namespace proxarm::sim
