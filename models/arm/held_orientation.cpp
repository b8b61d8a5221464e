#include "models/arm/held_orientation.hpp"

#include <cmath>

#include "models/arm/prioritized_step.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

constexpr double damping_m_per_rad = 1e-3;

// Returns G = H⁻¹J_pᵀ(J_p H⁻¹J_pᵀ + λ²E)⁻¹, with the H of prioritized_step.hpp.
SmallColumns3 joints_of_few_axes(const Jacobian& J_W) noexcept {
  const SmallColumns3 Jt = J_W.topRows<3>().transpose();
  const SmallColumns3 HJt = solve_positive_definite(turning_cost(J_W), Jt);
  SmallMatrix S = Jt.transpose().lazyProduct(HJt);
  S.diagonal().array() += damping_m_per_rad * damping_m_per_rad;
  const SmallColumns3 inverse = solve_positive_definite(S, SmallColumns3(SmallColumns3::Identity(3, 3)));
  return HJt.lazyProduct(inverse);
}

Jacobian weighted(const Jacobian& J_W) noexcept {
  Jacobian J = J_W;
  J.bottomRows<3>() *= turning_length_m;
  return J;
}

// Returns three columns of Jᵀ(J Jᵀ + λ²E)⁻¹, from `first` on. The rotations in J are weighted by turning_length_m.
SmallColumns3 columns_of_inverse(const Jacobian& J_W, Eigen::Index first) noexcept {
  const Jacobian J = weighted(J_W);
  Mat6 A = J.lazyProduct(J.transpose());
  A.diagonal().array() += damping_m_per_rad * damping_m_per_rad;
  Eigen::Matrix<double, 6, 3> right = Eigen::Matrix<double, 6, 3>::Zero();
  right.middleRows<3>(first).setIdentity();
  const Eigen::Matrix<double, 6, 3> solved = solve_positive_definite(A, right);
  SmallColumns3 G(J.cols(), 3);
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    const Vec3 row = solved.transpose() * J.col(i);
    G.row(i) = row.transpose();
  }
  return G;
}

}  // namespace

SmallColumns3 joints_per_m(const Jacobian& J_W) noexcept {
  return J_W.cols() < 6 ? joints_of_few_axes(J_W) : columns_of_inverse(J_W, 0);
}

SmallColumns3 joints_per_rad(const Jacobian& J_W) noexcept { return turning_length_m * columns_of_inverse(J_W, 3); }

}  // namespace proxarm::models
