// Solves a small quadratic program: finds the point of a polyhedron that is nearest to u₀ = H⁻¹g in the metric H.
//
//   minimise ½ uᵀH u − g·u   subject to   e_k·u = f_k  and  a_i·u ≤ b_i
//
// The method is the dual active-set method of Goldfarb and Idnani (Mathematical Programming 27, 1983). It starts at u₀
// and adds the most violated row to the active set, one row at a time. Each added row increases the objective, so no
// active set occurs twice. The code uses H = L Lᵀ and v = Lᵀ(u − u₀): for v the metric is the identity, and the normal
// of row a is L⁻¹a.
//
// A program has up to eight unknowns and `most` rows, in the caller's units. Nothing here allocates, locks or throws.
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
  // Adds low ≤ u ≤ high: two rows for each unknown. This takes a quarter of the time of at_most() for each row.
  void within(const SmallVector& low, const SmallVector& high) noexcept;

  // Solves the program. Returns false if the method finds no point that keeps each row within 1e-6 of its bound
  // (relative); u() is then the last iterate.
  bool solve() noexcept;

  [[nodiscard]] const SmallVector& u() const noexcept { return u_; }
  // Returns the multiplier of row i, counted in the order of adding; 0 if row i isn't active. The multipliers satisfy
  // H u − g + Σ λ_i a_i = 0.
  [[nodiscard]] double multiplier(std::size_t i) const noexcept { return lambda_[i]; }
  // Returns the number that the next added row will get. A skipped row of zeros gets no number.
  [[nodiscard]] std::size_t rows() const noexcept { return count_; }

 private:
  using Basis = std::array<SmallVector, most_rows>;

  void add(const SmallVector& a, double b) noexcept;
  void push(const SmallVector& normal, double length, double bound) noexcept;
  [[nodiscard]] SmallVector forward(SmallVector b) const noexcept;   // returns L⁻¹b
  [[nodiscard]] SmallVector backward(SmallVector b) const noexcept;  // returns L⁻ᵀb
  // Adds row p to the active set. Returns false if row p contradicts the active rows.
  bool take_in(std::size_t p) noexcept;
  void leave(std::size_t k) noexcept;
  // Splits the normal of row p into two parts: the part outside the span of the active normals, and a linear
  // combination of the active normals with these coefficients.
  void split(std::size_t p, SmallVector& outside, std::array<double, most_rows>& coefficients) const noexcept;
  void orthogonalise() noexcept;
  [[nodiscard]] bool holds() const noexcept;

  SmallMatrix L_;
  SmallVector u0_, u_, v_;
  std::array<SmallVector, most> normal_;  // L⁻¹a of each row, scaled to unit length
  std::array<double, most> bound_{}, length_{}, lambda_{};
  std::size_t count_ = 0, equalities_ = 0;
  std::array<std::size_t, most_rows> active_{};
  std::size_t active_count_ = 0;
  // An orthonormal basis of the span of the active normals.
  Basis e_;
  // The coefficients of the active normals in e_: active normal k = Σ_j R_[j][k] e_[j].
  std::array<std::array<double, most_rows>, most_rows> R_{};
};

}  // namespace proxarm::models
