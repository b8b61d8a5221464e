// A small quadratic program: the point of a polyhedron that is nearest to u₀ = H⁻¹g in the metric H.
//
//   minimise ½ uᵀH u − g·u   where   e_k·u = f_k  and  a_i·u ≤ b_i
//
// Solved by the dual active-set method of Goldfarb and Idnani (Mathematical Programming 27, 1983). It starts at u₀ and
// takes in the most violated row, one after the other; each row that is taken in increases the objective, so no active
// set occurs twice. With H = L Lᵀ and v = Lᵀ(u − u₀) the metric is the identity, and a row's normal is L⁻¹a.
//
// Up to eight unknowns and `most` rows. Units are the caller's. Neither allocates, locks nor throws.
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
  // Adds e·u = f. Precondition: before any inequality.
  void equal(const SmallVector& e, double f) noexcept;
  // Adds a·u ≤ b. A row of zeros is left out. Rows beyond `most` are dropped.
  void at_most(const SmallVector& a, double b) noexcept;
  // Adds low ≤ u ≤ high: two rows for each unknown, of its upper and of its lower bound, at a quarter of their cost.
  void within(const SmallVector& low, const SmallVector& high) noexcept;

  // Solves it. False if no point satisfies all rows to `tolerance` (in units of a row's bound, per unit of |L⁻¹a|); u()
  // is then the last iterate.
  bool solve() noexcept;

  [[nodiscard]] const SmallVector& u() const noexcept { return u_; }
  // The multiplier of row i, in the order in which they were added; 0 if it isn't active. The multipliers make
  // H u − g + Σ λ_i a_i = 0.
  [[nodiscard]] double multiplier(std::size_t i) const noexcept { return lambda_[i]; }
  // The number of the next row. A row of zeros has none.
  [[nodiscard]] std::size_t rows() const noexcept { return count_; }

 private:
  using Basis = std::array<SmallVector, most_rows>;

  void add(const SmallVector& a, double b) noexcept;
  void push(const SmallVector& normal, double length, double bound) noexcept;
  [[nodiscard]] SmallVector forward(SmallVector b) const noexcept;   // L⁻¹b
  [[nodiscard]] SmallVector backward(SmallVector b) const noexcept;  // L⁻ᵀb
  // Takes row p in; false if that contradicts the active rows.
  bool take_in(std::size_t p) noexcept;
  void leave(std::size_t k) noexcept;
  // The part of row p's normal outside of the active ones' span, and its coefficients in them.
  void split(std::size_t p, SmallVector& outside, std::array<double, most_rows>& coefficients) const noexcept;
  void orthogonalise() noexcept;
  [[nodiscard]] bool holds() const noexcept;

  SmallMatrix L_;
  SmallVector u0_, u_, v_;
  std::array<SmallVector, most> normal_;  // L⁻¹a, to unit length
  std::array<double, most> bound_{}, length_{}, lambda_{};
  std::size_t count_ = 0, equalities_ = 0;
  std::array<std::size_t, most_rows> active_{};
  std::size_t active_count_ = 0;
  Basis e_;                                                   // orthonormal; spans the active normals
  std::array<std::array<double, most_rows>, most_rows> R_{};  // active normal k = Σ_j R_[j][k] e_j
};

}  // namespace proxarm::models
