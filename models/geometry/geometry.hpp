// Defines the vectors and frames that all folders share.
//
//   W  world: z up, fixed to the floor             ┌─ S sensor  (measures between flange and handle)
//   B  base of the arm                       T tool ┤
//   T  tool: the point of the handle that     ╲    │
//      is held and rendered                     ╲ ╱
//   S  force sensor                        B ── arm
//                                          │
//                                     W ───┘
//
// A vector's suffix names the frame in which the vector is expressed (force_S). X_WT is the pose of T in W. Poses are
// read from left to right: X_WT = X_WB · X_BT.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace proxarm::models {

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
using Vec3 = Vec<3>;
using Mat3 = Eigen::Matrix3d;
using Pose = Eigen::Isometry3d;

// Returns a vector of N dimensions as a vector of three dimensions, whose added coordinates are zero.
template <int N>
Vec3 lift(const Vec<N>& x) noexcept {
  Vec3 x3 = Vec3::Zero();
  x3.template head<N>() = x;
  return x3;
}

// A force (N) and a torque (Nm) about the origin of the frame in which both are expressed.
struct Wrench {
  Vec3 force = Vec3::Zero();
  Vec3 torque = Vec3::Zero();
};

}  // namespace proxarm::models
