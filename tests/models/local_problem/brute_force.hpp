// All solutions of a local problem, by trying every combination of contact states in long double. It shares nothing
// with the solver under test: for each combination the unknowns are y, the forces of contacts that stick, and normal
// force and direction of those that slip; Gauss and Newton's method from several directions finds where the equations
// vanish, and the inequalities are looked at afterwards. Where the forces aren't unique (two points that stick may push
// each other along their line), alternating projections look for ones that lie in their cones.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <numbers>
#include <vector>

#include "models/base/random.hpp"
#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {

class BruteForce {
 public:
  using Real = long double;
  using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector6 = Eigen::Matrix<Real, 6, 1>;

  BruteForce(const Mat6& K, const Twist& e, const std::vector<LinearContact>& contacts) : random_(1) {
    const Eigen::Matrix<Real, 6, 6> K_real = K.cast<Real>();
    const Eigen::Matrix<Real, 6, 6> L = K_real.llt().matrixL();
    free_ = L.transpose() * e.cast<Real>();
    size_ = free_.norm();
    for (const LinearContact& contact : contacts) {
      const Eigen::Matrix<Real, 3, 6> J = contact.J.cast<Real>();
      // J L⁻ᵀ, row by row: L x = Jᵀ.
      const Eigen::Matrix<Real, 6, 3> x = L.triangularView<Eigen::Lower>().solve(J.transpose());
      rows_.push_back({x.transpose(), contact.c.cast<Real>() - J * e.cast<Real>(), contact.mu});
    }
    std::size_t combinations = 1;
    for (std::size_t i = 0; i < rows_.size(); ++i) combinations *= 3;
    for (std::size_t number = 0; number < combinations; ++number) {
      std::size_t rest = number;
      for (Row& row : rows_) {
        row.state = static_cast<ContactState>(rest % 3);
        rest /= 3;
      }
      try_states();
    }
  }

  // Lᵀ(e + δ) of each solution.
  [[nodiscard]] const std::vector<Vector6>& solutions() const { return found_; }
  [[nodiscard]] double size() const { return static_cast<double>(size_); }
  // How far a twist is from the nearest solution, over the size of the free motion.
  [[nodiscard]] double distance(const Mat6& K, const Twist& e, const Twist& delta) const {
    const Eigen::Matrix<Real, 6, 6> K_real = K.cast<Real>();
    const Vector6 y = K_real.llt().matrixU() * (e + delta).cast<Real>();
    Real least = std::numeric_limits<Real>::infinity();
    for (const Vector6& other : found_) least = std::min(least, (other - y).norm() / size_);
    return static_cast<double>(least);
  }

 private:
  struct Row {
    Eigen::Matrix<Real, 3, 6> H;
    Eigen::Matrix<Real, 3, 1> b;
    Real mu = 0.0L;
    ContactState state = ContactState::open;
  };
  static constexpr Real exact = 1e-14L;  // of the equations, over the sizes; long double rounds to 1e-19
  static constexpr Real kept = 1e-11L;   // of the inequalities

  [[nodiscard]] Eigen::Index unknowns(ContactState wanted, Eigen::Index each) const {
    Eigen::Index n = 0;
    for (const Row& row : rows_) n += row.state == wanted ? each : 0;
    return n;
  }

  void try_states() {
    const Eigen::Index slipping = unknowns(ContactState::slip, 1);
    const int starts = slipping == 0 ? 1 : slipping == 1 ? 8 : 14;
    for (int start = 0; start < starts; ++start) {
      Vector z = Vector::Zero(6 + unknowns(ContactState::stick, 3) + 2 * slipping);
      z.head<6>() = free_;
      Eigen::Index at = 6;
      for (const Row& row : rows_) {
        if (row.state == ContactState::stick) at += 3;
        if (row.state != ContactState::slip) continue;
        z[at] = size_ / row.H.norm();
        z[at + 1] = slipping == 1 ? std::numbers::pi_v<Real> * start / 4.0L
                                  : static_cast<Real>(random_.uniform(0.0, 2.0 * std::numbers::pi));
        at += 2;
      }
      if (solve(z)) judge(z);
    }
  }

  // The equations and their derivatives.
  void equations(const Vector& z, Vector& out, Matrix& D) const {
    out = Vector::Zero(z.size());
    D = Matrix::Zero(z.size(), z.size());
    const Vector6 y = z.head<6>();
    out.head<6>() = y;
    D.topLeftCorner<6, 6>().setIdentity();
    Eigen::Index at = 6;
    for (const Row& row : rows_) {
      const Eigen::Matrix<Real, 3, 1> u = row.H * y + row.b;
      if (row.state == ContactState::stick) {
        out.head<6>() -= row.H.transpose() * z.segment<3>(at);
        D.block(0, at, 6, 3) = -row.H.transpose();
        out.segment<3>(at) = u;
        D.block(at, 0, 3, 6) = row.H;
        at += 3;
      } else if (row.state == ContactState::slip) {
        const Real f_n = z[at], cos = std::cos(z[at + 1]), sin = std::sin(z[at + 1]);
        const Eigen::Matrix<Real, 3, 1> ray(1.0L, -row.mu * cos, -row.mu * sin),
            turn(0.0L, row.mu * sin, -row.mu * cos);
        out.head<6>() -= row.H.transpose() * ray * f_n;
        D.block(0, at, 6, 1) = -row.H.transpose() * ray;
        D.block(0, at + 1, 6, 1) = -row.H.transpose() * turn * f_n;
        out[at] = u[0];
        D.block(at, 0, 1, 6) = row.H.row(0);
        out[at + 1] = cos * u[2] - sin * u[1];
        D.block(at + 1, 0, 1, 6) = cos * row.H.row(2) - sin * row.H.row(1);
        D(at + 1, at + 1) = -sin * u[2] - cos * u[1];
        at += 2;
      }
    }
  }

  bool solve(Vector& z) const {
    Vector off;
    Matrix D;
    for (int k = 0; k < 25; ++k) {
      equations(z, off, D);
      if (off.norm() <= exact * size_) return true;
      Eigen::CompleteOrthogonalDecomposition<Matrix> cod;
      cod.setThreshold(1e-13L);
      cod.compute(D);
      z -= cod.solve(off);
      if (!z.allFinite() || z.norm() > 1e9L * (1.0L + size_)) return false;
    }
    return false;
  }

  void judge(const Vector& z) {
    const Vector6 y = z.head<6>();
    Eigen::Index at = 6;
    for (const Row& row : rows_) {
      const Eigen::Matrix<Real, 3, 1> u = row.H * y + row.b;
      if (row.state == ContactState::open && u[0] < -kept * size_) return;
      if (row.state == ContactState::stick) at += 3;
      if (row.state == ContactState::slip) {
        // Friction points against the slip.
        if (u[1] * std::cos(z[at + 1]) + u[2] * std::sin(z[at + 1]) < -kept * size_) return;
        at += 2;
      }
    }
    if (!forces_exist(z)) return;
    for (const Vector6& other : found_) {
      if ((other - y).norm() <= 1e-9L * size_) return;
    }
    found_.push_back(y);
  }

  // Forces with Σ Hᵀf = y in their cones: those that were found, or by projections to and fro.
  [[nodiscard]] bool forces_exist(const Vector& z) const {
    const Vector6 y = z.head<6>();
    Matrix A(6, z.size() - 6 - unknowns(ContactState::slip, 1));
    Vector x(A.cols());
    Eigen::Index from = 6, to = 0;
    for (const Row& row : rows_) {
      if (row.state == ContactState::stick) {
        A.middleCols(to, 3) = row.H.transpose();
        x.segment<3>(to) = z.segment<3>(from);
        from += 3;
        to += 3;
      } else if (row.state == ContactState::slip) {
        const Eigen::Matrix<Real, 3, 1> ray(1.0L, -row.mu * std::cos(z[from + 1]), -row.mu * std::sin(z[from + 1]));
        A.col(to) = row.H.transpose() * ray;
        x[to++] = z[from];
        from += 2;
      }
    }
    if (A.cols() == 0) return true;
    const Eigen::CompleteOrthogonalDecomposition<Matrix> cod(A);
    for (int k = 0; k < 3000; ++k) {
      const Vector in = into_cones(x);
      if ((in - x).norm() <= kept * (1.0L + x.norm())) return true;
      if (cod.rank() == A.cols()) return false;
      x = in + cod.solve(y - A * in);
    }
    return false;
  }

  [[nodiscard]] Vector into_cones(Vector x) const {
    Eigen::Index at = 0;
    for (const Row& row : rows_) {
      if (row.state == ContactState::slip) {
        x[at] = std::max(x[at], 0.0L);
        ++at;
      } else if (row.state == ContactState::stick) {
        const Real n = x[at], t = x.segment<2>(at + 1).norm();
        if (t > row.mu * n) {
          const Real normal = std::max((n + row.mu * t) / (1.0L + row.mu * row.mu), 0.0L);
          if (t > 0.0L) x.segment<2>(at + 1) *= row.mu * normal / t;
          x[at] = normal;
        }
        at += 3;
      }
    }
    return x;
  }

  Random random_;
  std::vector<Row> rows_;
  Vector6 free_;
  Real size_ = 0.0L;
  std::vector<Vector6> found_;
};

}  // namespace proxarm::models
