// Local problems at random, and the law that a solution must keep, from its words alone.
#pragma once

#include <algorithm>
#include <vector>

#include "models/base/random.hpp"
#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {

// Symmetric and positive definite, with eigenvalues from 1 to `condition` and any axes.
inline Mat6 random_stiffness(Random& random, double condition) {
  Mat6 Q;
  for (auto& x : Q.reshaped()) x = random.uniform(-1.0, 1.0);
  // Gram and Schmidt.
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) Q.col(i) -= Q.col(j) * Q.col(j).dot(Q.col(i));
    Q.col(i).normalize();
  }
  Vec<6> d;
  for (auto& x : d) x = random.log_uniform(1.0, condition);
  const Mat6 K = Q * d.asDiagonal() * Q.transpose();
  return 0.5 * (K + K.transpose());
}

// At `before` nothing has slipped and no gap is negative. Half of the contacts touch there.
inline std::vector<LinearContact> random_contacts(Random& random, int count, const Twist& before, double most_mu) {
  std::vector<LinearContact> contacts(static_cast<std::size_t>(count));
  for (LinearContact& contact : contacts) {
    const Vec3 place = random.in_box(1.0), n = random.direction(), t = n.unitOrthogonal();
    int row = 0;
    for (const Vec3& axis : {n, t, Vec3(n.cross(t))}) {
      contact.J.row(row).head<3>() = axis;
      contact.J.row(row++).tail<3>() = place.cross(axis);
    }
    contact.c = -contact.J * before;
    contact.c[0] += random.chance(0.5) ? 0.0 : random.uniform(0.0, 0.3);
    contact.mu = random.chance(0.2) ? 0.0 : random.uniform(0.0, most_mu);
  }
  return contacts;
}

inline Twist random_twist(Random& random) {
  Twist xi;
  for (auto& x : xi) x = random.uniform(-1.0, 1.0);
  return xi;
}

// By how much the law is missed; lengths and forces over those of the free motion.
inline double violation(const Mat6& K, const Twist& e, const std::vector<LinearContact>& contacts, const Twist& delta) {
  using Real = long double;
  Eigen::Matrix<Real, 6, 1> off = -(K.cast<Real>() * (e + delta).cast<Real>());
  const Real force = (K * e).norm(), length = e.norm() + delta.norm();
  Real worst = 0.0L;
  for (const LinearContact& contact : contacts) {
    const Eigen::Matrix<Real, 3, 1> f = contact.f.cast<Real>();
    const Eigen::Matrix<Real, 3, 1> u = contact.J.cast<Real>() * delta.cast<Real>() + contact.c.cast<Real>();
    off += contact.J.cast<Real>().transpose() * f;
    const Real limit = static_cast<Real>(contact.mu) * f[0];
    worst = std::max({worst, -f[0] / force, -u[0] / length, std::min(f[0] / force, u[0] / length)});
    worst = std::max(worst, (f.tail<2>().norm() - limit) / force);
    if (f[0] > 1e-9L * force && u.tail<2>().norm() > 1e-9L * length) {
      worst = std::max(worst, (f.tail<2>() + limit * u.tail<2>().normalized()).norm() / force *
                                  std::min<Real>(1.0L, u.tail<2>().norm() / length));
    }
  }
  return static_cast<double>(std::max(worst, off.norm() / force));
}

}  // namespace proxarm::models
