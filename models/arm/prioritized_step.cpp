#include "models/arm/prioritized_step.hpp"

#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {

PrioritizedStep prioritized_step(const JointMatrix& A, const SmallVector& e, const JointMatrix& H,
                                 const JointVector& g) noexcept {
  // Computes H⁻¹ [Aᵀ g] by one factorisation. A has at most six rows, so g fits beside Aᵀ.
  const Eigen::Index rows = A.rows();
  JointMatrix right(A.cols(), rows + 1);
  right.leftCols(rows) = A.transpose();
  right.col(rows) = g;
  const JointMatrix solved = solve_positive_definite(H, right);
  const auto HA = solved.leftCols(rows);
  const JointVector y = solved.col(rows);
  JointMatrix wanted(rows, 2);
  wanted.col(0) = e;
  wanted.col(1) = A.lazyProduct(y);
  const JointMatrix S = A.lazyProduct(HA);
  const JointMatrix force = solve_positive_definite(S, wanted);
  return {.task = HA.lazyProduct(force.col(0)), .rest = y - HA.lazyProduct(force.col(1))};
}

JointMatrix turning_cost(const Jacobian& J_W, double weight) noexcept {
  const auto J_R = J_W.bottomRows<3>();
  JointMatrix H = weight * J_R.transpose().lazyProduct(J_R);
  H.diagonal().array() += 1.0;
  return H;
}

}  // namespace proxarm::models
