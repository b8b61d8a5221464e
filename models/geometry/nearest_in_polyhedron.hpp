// A small quadratic program: the point of a polyhedron that is nearest to u₀ = H⁻¹g in the metric H.
//
//   minimise ½ uᵀH u − g·u   subject to   e_k·u = f_k  and  a_i·u ≤ b_i
//
// Solved by the dual active-set method of Goldfarb and Idnani (Mathematical Programming 27, 1983). It starts at u₀ and
// adds the most violated row to the active set, one at a time. Each added row increases the objective, so no active set
// occurs twice. With H = L Lᵀ and v = Lᵀ(u − u₀) the metric is the identity, and a row's normal is L⁻¹a.
//
// Up to eight unknowns and `most` rows, in the caller's units. Nothing here allocates, locks or throws.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

class NearestInPolyhedron {
 public:
  static constexpr std::size_t most = 64;

  // Starts a program without rows. Precondition: H is symmetric and positive definite.
  void start(const SmallMatrix& H, const SmallVector& g) noexcept;
  // Adds e·u = f. Precondition: all equalities are added before the first inequality.
  void equal(const SmallVector& e, double f) noexcept;
  // Adds a·u ≤ b. A row of zeros is skipped. Rows beyond `most` are dropped.
  void at_most(const SmallVector& a, double b) noexcept;
  // Adds low ≤ u ≤ high: two rows for each unknown, at a quarter of the cost of separate at_most() rows.
  void within(const SmallVector& low, const SmallVector& high) noexcept;

  // Solves the program. Returns false if no point keeps all rows within a relative 1e-6 of their bounds; u() is then
  // the last iterate.
  bool solve() noexcept;

  [[nodiscard]] const SmallVector& u() const noexcept { return u_; }
  // The multiplier of row i, counted in the order of adding; 0 if the row isn't active. The multipliers satisfy
  // H u − g + Σ λ_i a_i = 0.
  [[nodiscard]] double multiplier(std::size_t i) const noexcept { return lambda_[i]; }
  // The number that the next row will get. A skipped row of zeros gets no number.
  [[nodiscard]] std::size_t rows() const noexcept { return count_; }

 private:
  using Basis = std::array<SmallVector, most_rows>;

  void add(const SmallVector& a, double b) noexcept;
  void push(const SmallVector& normal, double length, double bound) noexcept;
  [[nodiscard]] SmallVector forward(SmallVector b) const noexcept;   // L⁻¹b
  [[nodiscard]] SmallVector backward(SmallVector b) const noexcept;  // L⁻ᵀb
  // Adds row p to the active set. False if it contradicts the active rows.
  bool take_in(std::size_t p) noexcept;
  void leave(std::size_t k) noexcept;
  // Splits row p's normal into the part outside the active normals' span and the coefficients in the active normals.
  void split(std::size_t p, SmallVector& outside, std::array<double, most_rows>& coefficients) const noexcept;
  void orthogonalise() noexcept;
  [[nodiscard]] bool holds() const noexcept;

  SmallMatrix L_;
  SmallVector u0_, u_, v_;
  std::array<SmallVector, most> normal_;  // L⁻¹a, scaled to unit length
  std::array<double, most> bound_{}, length_{}, lambda_{};
  std::size_t count_ = 0, equalities_ = 0;
  std::array<std::size_t, most_rows> active_{};
  std::size_t active_count_ = 0;
  Basis e_;                                                   // orthonormal basis of the active normals' span
  std::array<std::array<double, most_rows>, most_rows> R_{};  // active normal k = Σ_j R_[j][k] e_j
};

}  // namespace proxarm::models
