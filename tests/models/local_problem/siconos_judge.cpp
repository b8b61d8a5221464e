#include "tests/models/local_problem/siconos_judge.hpp"

#include <Eigen/Cholesky>
#include <cstdlib>

#ifdef PROXARM_SICONOS
extern "C" {
#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <SolverOptions.h>
}
#endif

namespace proxarm::models {

#ifdef PROXARM_SICONOS

bool siconos_is_there() { return true; }

// u = W f + q with W = J K⁻¹ Jᵀ and q = c − J e; normal first, as here.
bool solve_by_siconos(const Mat6& K, const Twist& e, std::vector<LinearContact>& contacts, Twist& delta) {
  const Eigen::LLT<Mat6> factors(K);
  const auto rows = static_cast<Eigen::Index>(3 * contacts.size());
  Eigen::MatrixXd J(rows, 6);
  Eigen::VectorXd q(rows), mu(rows / 3), f = Eigen::VectorXd::Zero(rows), u = f;
  for (Eigen::Index i = 0; i < rows / 3; ++i) {
    const LinearContact& contact = contacts[static_cast<std::size_t>(i)];
    J.middleRows<3>(3 * i) = contact.J;
    q.segment<3>(3 * i) = contact.c - contact.J * e;
    mu[i] = contact.mu;
  }
  Eigen::MatrixXd W = J * factors.solve(J.transpose());
  NumericsMatrix* matrix = NM_create_from_data(NM_DENSE, static_cast<int>(rows), static_cast<int>(rows), W.data());
  FrictionContactProblem problem{};
  problem.dimension = 3;
  problem.numberOfContacts = static_cast<int>(contacts.size());
  problem.M = matrix;
  problem.q = q.data();
  problem.mu = mu.data();
  SolverOptions* options = solver_options_create(SICONOS_FRICTION_3D_NSGS);
  options->dparam[SICONOS_DPARAM_TOL] = 1e-13;
  options->iparam[SICONOS_IPARAM_MAX_ITER] = 20000;
  const bool fine = fc3d_driver(&problem, f.data(), u.data(), options) == 0;
  // What it leaves to its callers: the structures themselves, also that of the solver inside.
  SolverOptions* inner = options->numberOfInternalSolvers > 0 ? options->internalSolvers[0] : nullptr;
  solver_options_delete(options);
  std::free(inner);
  std::free(options);
  matrix->matrix0 = nullptr;  // W's own
  NM_free(matrix);
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].f = f.segment<3>(static_cast<Eigen::Index>(3 * i));
  delta = factors.solve(J.transpose() * f) - e;
  return fine;
}

#else

bool siconos_is_there() { return false; }

bool solve_by_siconos(const Mat6& /*K*/, const Twist& /*e*/, std::vector<LinearContact>& /*contacts*/,
                      Twist& /*delta*/) {
  return false;
}

#endif

}  // namespace proxarm::models
