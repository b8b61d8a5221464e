// The local problem of a step: a rigid tool on a coupling K, held by contacts whose geometry is frozen at a pose q_i.
//
//   K (e + δ) = Σ J_cᵀ f_c          e = q_i ⊟ p̂, δ the twist from q_i to the solution
//   u_c = J_c δ + c_c               rows: gap; displacement of the material point since q(k−1) along two tangents
//   0 ≤ u_n ⊥ f_n ≥ 0,  ‖f_t‖ ≤ μ f_n,  and u_t ≠ 0 → f_t = −μ f_n u_t/‖u_t‖      Coulomb's law as it is
//
// With K = L Lᵀ, y = Lᵀ(e + δ) and H = J L⁻ᵀ this is y = Σ Hᵀf, u = H y + b: six unknowns, however many contacts.
//
// A single contact has a way of its own (one_contact.cpp).
//
// Method: Alart and Curnier's projection ("A mixed formulation for frictional contact problems prone to Newton like
// solution methods", 1991) writes the law as f = P(f − r u) for any r > 0, with P the projection on the cone's section.
// Semismooth Newton on y, with f as multipliers, solves a 6 × 6 system each time and converges in two to five; r is
// large, so the multipliers settle in two. Without friction there is a solution wherever gaps can be kept, and it is
// found (frictionless.cpp). With friction, where Newton cycles: of up to three contacts all combinations of free, stick
// and slip are tried; then projected Gauss-Seidel over the contacts (Jean and Moreau's nonsmooth contact dynamics)
// leads to the neighbourhood of a solution, and a line search keeps it there; then friction is raised from nothing, and
// the solution followed. What is returned has passed the law's own test.
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
  Eigen::Matrix<double, 3, 6> J;  // rows: normal, tangents; of the twist at the reference point
  Vec3 c = Vec3::Zero();          // gap, slip at δ = 0; m
  double mu = 0.0;
  Vec3 f = Vec3::Zero();  // in: a guess; out: along normal and tangents, N
  ContactState state = ContactState::open;
};

class ContactProblem {
 public:
  // So many contacts are solved together; 24 is six boxes' faces at once.
  static constexpr std::size_t most = 24;

  // Precondition: symmetric and positive definite. Remembered, so that the same K again costs a comparison.
  void set_stiffness(const Mat6& K) noexcept;

  // Fills in δ, and f and state of the contacts. False: no solution found; δ then holds all gaps open as far as
  // Gauss-Seidel got. Precondition: at most `most` contacts.
  // `rough`: what the law may be missed by, over the free motion's press, in a problem that is going to be put again
  // from where this one leads; 0: nothing but rounding.
  bool solve(const Twist& e, std::span<LinearContact> contacts, Twist& delta, double rough = 0.0) noexcept;

  // Whether the forces that are given keep the law, to rounding, and where they bring the tool. Where contacts hold
  // each other, forces are many that do, and solve() leads from ones that do to others: it asks for gaps that rounding
  // has made contradict each other.
  bool holds(const Twist& e, std::span<LinearContact> contacts, Twist& delta) noexcept;

  // Whether a single contact is solved in closed form (one_contact.cpp).
  void use_closed_form(bool use) noexcept { closed_form_ = use; }

  // How much solve() may still do, all calls together: contacts that a step of Newton's or a sweep of Gauss and
  // Seidel's looks at. Without a call it may do all that it knows.
  void allow(int work) noexcept { work_ = work; }
  [[nodiscard]] bool exhausted() const noexcept { return work_ <= 0; }

  // The number of different y among all combinations of free, stick and slip, for up to four contacts: 1 where the
  // solution is unique. Costs up to 3⁴ Newton iterations.
  int count_solutions(const Twist& e, std::span<const LinearContact> contacts) noexcept;

  // The twist that the wrench of a contact's force makes the coupling yield by: K⁻¹ w.
  [[nodiscard]] Twist yield_to(const Twist& wrench) const noexcept;

 private:
  struct Row {
    Eigen::Matrix<double, 3, 6> H;
    Vec3 b;
    double mu = 0.0;
    double w = 0.0;  // the trace of H Hᵀ: how far the contact yields to a newton, m/N
    double root_w = 0.0;
    Vec3 f;
    ContactState state = ContactState::open;
    // What look() or violation() saw last: u at y, and the state that the projection tells.
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
  // Precondition: rows have been looked at, at y.
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
  // a + share (b − a)
  static void go_to(const Iterate& a, const Iterate& b, double share, Rows rows, Twist& y) noexcept;
  static bool without_friction(Rows rows, Twist& y) noexcept;  // false: nothing keeps all gaps
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
