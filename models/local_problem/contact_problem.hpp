// Solves the local problem of a step: a rigid tool on a coupling K is held by contacts whose geometry is frozen at a
// pose q_i.
//
//   K (e + δ) = Σ J_cᵀ f_c          e = q_i ⊟ p̂; δ is the twist from q_i to the solution
//   u_c = J_c δ + c_c               row 1: gap; rows 2, 3: displacement of the material point since q(k−1), along
//                                   two tangents
//   0 ≤ u_n ⊥ f_n ≥ 0,  ‖f_t‖ ≤ μ f_n,  and u_t ≠ 0 → f_t = −μ f_n u_t/‖u_t‖      Coulomb's law, not approximated
//
// With K = L Lᵀ, y = Lᵀ(e + δ) and H = J L⁻ᵀ this becomes y = Σ Hᵀf, u = H y + b: six unknowns, whatever the number of
// contacts.
//
// Methods:
// 1. A single contact is solved without a system of six unknowns (one_contact.cpp).
// 2. Semismooth Newton. Alart and Curnier's projection ("A mixed formulation for frictional contact problems prone to
//    Newton like solution methods", 1991) writes the law as f = P(f − r u) for any r > 0; P is the projection on the
//    cone's section. Newton on y, with f as multipliers, solves a 6 × 6 system in each step and converges in two to
//    five steps. r is large, so the multipliers converge in two steps.
// 3. Without friction there is a solution if all gaps can be kept, and it is always found (frictionless.cpp).
// 4. With friction, Newton may cycle. Up to three contacts, all combinations of open, stick and slip are then tried.
// 5. Projected Gauss-Seidel over the contacts (Jean and Moreau's nonsmooth contact dynamics) leads near a solution, and
//    Newton with a line search goes on from there.
// 6. If the first sweeps fail, friction is raised from zero, and the solution is followed.
// Every solution that is returned has passed the test of the law itself.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "models/geometry/small_matrix.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

enum class ContactState : std::uint8_t { open, stick, slip };

struct LinearContact {
  // Rows: normal, two tangents; maps a twist at the reference point to displacements of the contact.
  Eigen::Matrix<double, 3, 6> J;
  Vec3 c = Vec3::Zero();  // gap, and slip along the tangents, at δ = 0; m
  double mu = 0.0;
  Vec3 f = Vec3::Zero();  // in: a guess; out: the force along normal and tangents, N
  ContactState state = ContactState::open;
};

class ContactProblem {
 public:
  // Largest number of contacts that are solved together: 24 is the number for six faces of boxes at once.
  static constexpr std::size_t most = 24;

  // Sets K, and does nothing if K hasn't changed. Precondition: K is symmetric and positive definite.
  void set_stiffness(const Mat6& K) noexcept;

  // Finds δ, and f and state of each contact. False if no solution was found; δ is then the last result of the
  // Gauss-Seidel sweeps, which keeps gaps only as far as the sweeps have converged. `rough` is the violation of the law
  // that may remain, as a share of the force that the free motion would exert, if the problem will be posed again from
  // this solution; 0: only rounding may remain. Precondition: at most `most` contacts.
  bool solve(const Twist& e, std::span<LinearContact> contacts, Twist& delta, double rough = 0.0) noexcept;

  // True if the contacts' given forces obey the law to within rounding. δ is then the twist to which these forces lead,
  // and the contacts' states are set. This test is useful before solve(): if contacts hold each other, many sets of
  // forces obey the law, and solve() would replace one such set by another, because it requires gaps that rounding has
  // made contradict each other.
  bool holds(const Twist& e, std::span<LinearContact> contacts, Twist& delta) noexcept;

  // Sets whether one_contact() is used for a single contact (one_contact.cpp).
  void use_closed_form(bool use) noexcept { closed_form_ = use; }

  // Limits the work of all following calls of solve() together. The unit is one contact in one step of Newton's method
  // or one Gauss-Seidel sweep. Without a call of allow(), the work isn't limited.
  void allow(int work) noexcept { work_ = work; }
  [[nodiscard]] bool exhausted() const noexcept { return work_ <= 0; }

  // Returns the number of different y among all combinations of open, stick and slip, for up to four contacts. It is 1
  // if the solution is unique. The function runs Newton's method up to 3⁴ times.
  int count_solutions(const Twist& e, std::span<const LinearContact> contacts) noexcept;

  // Returns K⁻¹ w: the twist by which the coupling yields to a contact's wrench w.
  [[nodiscard]] Twist yield_to(const Twist& wrench) const noexcept;

 private:
  struct Row {
    Eigen::Matrix<double, 3, 6> H;
    Vec3 b;
    double mu = 0.0;
    double w = 0.0;  // trace of H Hᵀ: how far the contact yields per newton, m/N
    double root_w = 0.0;
    Vec3 f;
    ContactState state = ContactState::open;
    // Results of the last look() or violation(): u at y, and the state that follows from the projection.
    Vec3 u;
    ContactState seen = ContactState::open;
  };
  using Rows = std::span<Row>;
  struct Iterate {
    Twist y;
    std::array<Vec3, most> f;
  };

  static bool one_contact(Row& row, Twist& y, double size, double tolerance) noexcept;
  static void look(Rows rows, const Twist& y) noexcept;
  static void take_seen_states(Rows rows) noexcept;
  // Precondition: look() or violation() was called at y.
  static bool newton_step(Rows rows, Twist& y) noexcept;
  bool newton(Rows rows, Twist& y, double size, int most_iterations) noexcept;
  bool damped_newton(Rows rows, Twist& y, double size, int most_iterations) noexcept;
  bool next_to(const Iterate& reached, Rows rows, Twist& y, double size) noexcept;
  bool held_newton(Rows rows, Twist& y, double size, int most_iterations, bool quick) noexcept;
  bool newton_with_states(Rows rows, Twist& y, double size, Twist start, bool quick) noexcept;
  void gauss_seidel(Rows rows, Twist& y, int sweeps) noexcept;
  bool is_solved(Rows rows, const Twist& y, double size, double tolerance) const noexcept;
  static void balance(Rows rows, const Twist& y) noexcept;
  static double violation(Rows rows, const Twist& y) noexcept;
  static double residual2(Rows rows, const Twist& y) noexcept;
  static Iterate kept(Rows rows, const Twist& y) noexcept;
  static void go_to(const Iterate& a, Rows rows, Twist& y) noexcept;
  // Sets the iterate to a + share (b − a).
  static void go_to(const Iterate& a, const Iterate& b, double share, Rows rows, Twist& y) noexcept;
  static bool without_friction(Rows rows, Twist& y) noexcept;  // false: no y keeps all gaps
  bool by_more_friction(Rows rows, Twist& y, double size) noexcept;
  bool enumerate(Rows rows, Twist& y, double size, int* different) noexcept;
  double make_rows(const Twist& e, std::span<const LinearContact> contacts) noexcept;

  [[nodiscard]] bool may_look_at(Rows rows) noexcept {
    work_ -= static_cast<int>(rows.size());
    return work_ > 0;
  }

  int work_ = std::numeric_limits<int>::max();
  double rough_ = 0.0;
  bool closed_form_ = true;
  Mat6 K_ = Mat6::Zero();
  Mat6 L_ = Mat6::Identity(), L_inverse_ = Mat6::Identity();
  std::array<Row, most> rows_;
};

}  // namespace proxarm::models
