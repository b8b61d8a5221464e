#include "models/arm/tool_space.hpp"

#include <array>
#include <cmath>

#include "models/geometry/eigenvalues.hpp"

namespace proxarm::models {
namespace {

constexpr int poses = 100;
constexpr double leaves = 1e-3;   // see tool_space() in the header
constexpr double rounded = 1e-4;  // an axis of the space that is this near to an axis of W becomes that axis

Vec3 snapped(const Vec3& axis) noexcept {
  Eigen::Index most = 0;
  axis.cwiseAbs().maxCoeff(&most);
  const Vec3 towards = axis[most] < 0.0 ? Vec3(-axis) : axis;
  return (towards - Vec3::Unit(most)).norm() < rounded ? Vec3(Vec3::Unit(most)) : towards;
}

// Returns the axes of a plane, as near to the axes of W as possible, and the normal.
Mat3 plane_axes(const Vec3& normal) noexcept {
  Eigen::Index least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vec3 along = Vec3(Vec3::Unit(least) - normal[least] * normal).normalized();
  Mat3 axes;
  axes << snapped(along), snapped(normal.cross(along)), normal;
  return axes;
}

}  // namespace

JointVector spread_pose(const Arm& arm, int index) {
  constexpr std::array<int, max_axes> primes{2, 3, 5, 7, 11, 13, 17, 19};
  const auto halton = [](int of, int base) {
    double value = 0.0, digit = 1.0;
    for (; of > 0; of /= base) value += (digit /= base) * (of % base);
    return value;
  };
  JointVector q = arm.start_rad();
  for (int i = 0; i < arm.axes(); ++i) {
    const double share = halton(index, primes[static_cast<std::size_t>(i)]);
    q[i] = arm.lower_rad()[i] + share * (arm.upper_rad()[i] - arm.lower_rad()[i]);
  }
  return q;
}

ToolSpace tool_space(const Arm& arm) {
  // Sum of the squares of the velocities. symmetric_eigen() takes six rows; the three added rows sort last.
  Mat6 squares = Mat6::Zero();
  ToolKinematics tool;
  for (int i = 0; i < poses; ++i) {
    arm.kinematics(i == 0 ? arm.start_rad() : spread_pose(arm, i), tool);
    const auto J = tool.J_W.topRows<3>();
    squares.topLeftCorner<3, 3>() += J.lazyProduct(J.transpose());
  }
  squares.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 + 2.0 * squares.trace());
  const SymmetricEigen eigen = symmetric_eigen(squares);
  const double most = eigen.values[2];
  if (!(most > 0.0)) return {.dimensions = 0};
  ToolSpace space;
  for (Eigen::Index i = 0; i < 3; ++i) space.dimensions -= eigen.values[i] < leaves * leaves * most ? 1 : 0;
  if (space.dimensions == 2) {
    space.axes = plane_axes(snapped(eigen.vectors.col(0).head<3>()));
  } else if (space.dimensions == 1) {
    const Vec3 along = snapped(eigen.vectors.col(2).head<3>());
    space.axes = plane_axes(along);
    space.axes.col(2).swap(space.axes.col(0));
  }
  return space;
}

}  // namespace proxarm::models
