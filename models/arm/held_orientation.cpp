#include "models/arm/held_orientation.hpp"

#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

constexpr double length_m = 0.5;
constexpr double damping_m_per_rad = 1e-3;

}  // namespace

SmallColumns3 joints_per_m(const Jacobian& J_W) noexcept {
  Jacobian J = J_W;
  J.bottomRows<3>() *= length_m;
  Mat6 A = J.lazyProduct(J.transpose());
  A.diagonal().array() += damping_m_per_rad * damping_m_per_rad;
  Eigen::Matrix<double, 6, 3> right = Eigen::Matrix<double, 6, 3>::Zero();
  right.topRows<3>().setIdentity();
  const Eigen::Matrix<double, 6, 3> solved = solve_positive_definite(A, right);
  SmallColumns3 G(J.cols(), 3);
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    const Vec3 row = solved.transpose() * J.col(i);
    G.row(i) = row.transpose();
  }
  return G;
}

}  // namespace proxarm::models
