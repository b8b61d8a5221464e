#include "models/local_problem/contact_problem.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

// A contact sticks without an exact comparison if ‖z_t‖² is below the squared friction limit by more than this share.
// The share is larger than the rounding of a square and of its root.
constexpr double kNextToLimit = 1e-14;

// The result of Alart and Curnier's projection of z = f − u/w: the projected force, and the state of the contact that
// follows from it.
struct Projected {
  Vec3 f = Vec3::Zero();
  ContactState state = ContactState::open;
};

inline Projected project(const Vec3& z, double mu) noexcept {
  Projected out;
  if (!(z[0] > 0.0)) return out;
  const double z_t2 = z.tail<2>().squaredNorm(), limit = mu * z[0];
  out.f = z;
  out.state = ContactState::stick;
  if (z_t2 < (1.0 - kNextToLimit) * (limit * limit)) return out;  // most contacts end here and need no root
  const double z_t = std::sqrt(z_t2);
  if (z_t <= limit) return out;
  out.state = ContactState::slip;
  out.f.tail<2>() *= limit / z_t;
  return out;
}

// How many times stiffer than the coupling the contacts are in Newton's method. In each step the error of the
// multipliers falls by the factor 1/(1 + kStiff λ), where λ is the smallest eigenvalue of the scaled W = H Hᵀ that
// isn't 0. With kStiff above 1e9, rounding of kStiff u would change the states.
constexpr double kStiff = 1e7;
// Tolerance of a solution, as a share of the force that make_rows() returns. It is about a hundred roundings of sums
// over rows.
constexpr double kTolerance = 1e-12;
// Tolerance after kQuiet steps. If contacts hold each other (along an edge, on a face), rounding of the stiff contacts
// moves a slip that is nearly zero, so the law is obeyed only to about 1e-11. The tolerance is 1e-9 N of 10 N.
constexpr double kNoisyTolerance = 1e-10;
constexpr int kQuiet = 18;
constexpr double kRough = 1e-7;  // tolerance before balance() has corrected the forces
// Number of attempts by Gauss-Seidel sweeps. Each attempt has twice as many sweeps as the attempt before.
constexpr int kAttempts = 6;
// Up to kFew contacts, all combinations of states are tried before the Gauss-Seidel sweeps, with at most kQuickSteps
// Newton steps each. A combination is given up when a step leaves more than the share kStays of the violation before
// the step.
constexpr std::size_t kFew = 3;
constexpr int kQuickSteps = 8;
constexpr double kStays = 0.7;
// The force that closes the most negative gap is multiplied by this share in make_rows().
constexpr double kMissed = 0.1;
// For by_more_friction(): the number of Newton steps at each level of friction, and the smallest share by which
// friction is raised.
constexpr int kRaised = 8;
constexpr double kLeastRaise = 1.0 / 128.0;

Twist solved(const Mat6& A, const Twist& b) noexcept {
  FactoredMatrix factors;
  factors.factor(A);
  return factors.solve(b);
}

}  // namespace

void ContactProblem::set_stiffness(const Mat6& K) noexcept {
  if (K == K_) return;
  K_ = K;
  L_ = K.llt().matrixL();
  L_inverse_ = L_.triangularView<Eigen::Lower>().solve(Mat6::Identity());
}

Twist ContactProblem::yield_to(const Twist& wrench) const noexcept {
  return L_inverse_.transpose() * (L_inverse_ * wrench);
}

// Fills rows_. Returns the force to which tolerances refer: the force that the free motion would exert, or the share
// kMissed of the force that closes the most negative gap, whichever is larger. The second force is needed because a
// pose of the iteration may be p̂ itself; the free motion then exerts no force.
double ContactProblem::make_rows(const Twist& e, std::span<const LinearContact> contacts) noexcept {
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const LinearContact& contact = contacts[i];
    Row& row = rows_[i];
    row.H.noalias() = contact.J * L_inverse_.transpose();
    row.b = contact.c - contact.J * e;
    row.mu = contact.mu;
    row.w = row.H.squaredNorm();
    row.root_w = std::sqrt(row.w);
    row.f = contact.f;
    row.state = contact.state;
  }
  double size = (L_.transpose() * e).norm();
  for (std::size_t i = 0; i < contacts.size(); ++i) size = std::max(size, -kMissed * rows_[i].b[0] / rows_[i].root_w);
  return size;
}

// Returns the larger of max_c √w ‖f − P(f − u/w)‖ (over the contacts c) and ‖Σ Hᵀf − y‖, both in the units of y. It is
// 0 exactly at the solutions.
double ContactProblem::violation(Rows rows, const Twist& y) noexcept {
  Twist off = -y;
  double law = 0.0;
  for (Row& row : rows) {
    row.u = row.H * y + row.b;
    const Projected now = project(row.f - row.u / row.w, row.mu);
    row.seen = now.state;
    off += row.H.transpose() * row.f;
    law = std::max(law, (row.f - now.f).norm() * row.root_w);
  }
  return std::max(off.norm(), law);  // in this order, NaN in `off` stays NaN
}

void ContactProblem::look(Rows rows, const Twist& y) noexcept {
  for (Row& row : rows) {
    row.u = row.H * y + row.b;
    row.seen = project(row.f - row.u / row.w, row.mu).state;
  }
}

void ContactProblem::take_seen_states(Rows rows) noexcept {
  for (Row& row : rows) row.state = row.seen;
}

// Returns the violation of the law and of y = Σ Hᵀf as a sum of squares.
double ContactProblem::residual2(Rows rows, const Twist& y) noexcept {
  Twist off = -y;
  double law2 = 0.0;
  for (const Row& row : rows) {
    off += row.H.transpose() * row.f;
    law2 += row.w * (row.f - project(row.f - (row.H * y + row.b) / row.w, row.mu).f).squaredNorm();
  }
  return law2 + off.squaredNorm();
}

// Makes one step of semismooth Newton for y and f, with the states chosen before. The new force of each contact is
// linear in its new displacement, f⁺ = f̄ − P u⁺:
//   open   f⁺ = 0
//   stick  u⁺ = 0, written as f⁺ = f − R u⁺ with a large R (proximal point, so redundant rows need no choice)
//   slip   u_n⁺ = 0, written in the same way; f_t⁺ = μ (f_n⁺ d + z_n T z_t⁺/‖z_t‖)
//          with z = f − u/w, d = z_t/‖z_t‖ and T = I − d dᵀ.
//          The part of f_t⁺ along d is μ f_n⁺. The part across d is −a/(1 − a) u_t⁺/w with a = μ z_n/‖z_t‖.
bool ContactProblem::newton_step(Rows rows, Twist& y) noexcept {
  Mat6 A = Mat6::Identity();
  Twist off = -y;
  std::array<Mat3, most> P;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Row& row = rows[i];
    if (row.state == ContactState::open) {
      row.f.setZero();
      continue;
    }
    const double R = kStiff / row.w;
    const Vec3& u = row.u;
    if (row.state == ContactState::stick) {
      off.noalias() += row.H.transpose() * (row.f - R * u);
      A.noalias() += row.H.transpose() * (R * row.H);
    } else {
      const Eigen::Vector2d z_t = row.f.tail<2>() - u.tail<2>() / row.w;
      const double size = z_t.norm(), z_n = std::max(row.f[0] - u[0] / row.w, 0.0);
      const Eigen::Vector2d d = size > 0.0 ? Eigen::Vector2d(z_t / size) : Eigen::Vector2d(1.0, 0.0);
      const double a = size > 0.0 ? std::min(row.mu * z_n / size, 1.0 - 1.0 / kStiff) : 0.0;
      P[i].setZero();
      P[i](0, 0) = R;
      P[i].block<2, 1>(1, 0) = row.mu * R * d;
      P[i].block<2, 2>(1, 1) = a / ((1.0 - a) * row.w) * (Eigen::Matrix2d::Identity() - d * d.transpose());
      row.f.tail<2>() = row.mu * row.f[0] * d;
      off.noalias() += row.H.transpose() * (row.f - P[i] * u);
      A.noalias() += row.H.transpose() * (P[i] * row.H);
    }
  }
  const Twist step = solved(A, off);
  if (!step.allFinite()) return false;
  y += step;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    Row& row = rows[i];
    if (row.state == ContactState::stick) row.f -= kStiff / row.w * (row.H * y + row.b);
    if (row.state == ContactState::slip) row.f -= P[i] * (row.H * y + row.b);
  }
  return true;
}

bool ContactProblem::newton(Rows rows, Twist& y, double size, int most_iterations) noexcept {
  look(rows, y);
  for (int k = 0; k < most_iterations && may_look_at(rows); ++k) {
    take_seen_states(rows);
    if (!newton_step(rows, y)) return false;
    if (is_solved(rows, y, size, k < kQuiet ? kTolerance : kNoisyTolerance)) return true;
  }
  return false;
}

ContactProblem::Iterate ContactProblem::kept(Rows rows, const Twist& y) noexcept {
  Iterate out;
  out.y = y;
  for (std::size_t i = 0; i < rows.size(); ++i) out.f[i] = rows[i].f;
  return out;
}

void ContactProblem::go_to(const Iterate& a, const Iterate& b, double share, Rows rows, Twist& y) noexcept {
  y = a.y + share * (b.y - a.y);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].f = a.f[i] + share * (b.f[i] - a.f[i]);
}

void ContactProblem::go_to(const Iterate& a, Rows rows, Twist& y) noexcept {
  y = a.y;
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].f = a.f[i];
}

// Newton's method with a line search, for problems in which plain steps cycle between states. The step is halved until
// the residual becomes smaller than before the step. Of the tried shares of the step, the one with the smallest
// residual is taken.
bool ContactProblem::damped_newton(Rows rows, Twist& y, double size, int most_iterations) noexcept {
  for (int k = 0; k < most_iterations && may_look_at(rows); ++k) {
    look(rows, y);
    take_seen_states(rows);
    const Iterate before = kept(rows, y);
    const double wanted = residual2(rows, y);
    if (!newton_step(rows, y)) return false;
    const Iterate after = kept(rows, y);
    if (is_solved(rows, y, size, k < kQuiet ? kTolerance : kNoisyTolerance)) return true;
    double best = 1.0, least = std::numeric_limits<double>::infinity();
    for (double share = 1.0; share > 0.02; share *= 0.5) {
      go_to(before, after, share, rows, y);
      const double now = residual2(rows, y);
      if (now < least) {
        least = now;
        best = share;
      }
      if (now < wanted) break;
    }
    go_to(before, after, best, rows, y);
  }
  return false;
}

bool ContactProblem::is_solved(Rows rows, const Twist& y, double size, double tolerance) const noexcept {
  if (rough_ > 0.0) return violation(rows, y) <= std::max(rough_, tolerance) * size;
  if (violation(rows, y) > kRough * size) return false;
  balance(rows, y);
  return violation(rows, y) <= tolerance * size;
}

// Corrects the forces so that Σ Hᵀf equals y, because the forces contain the rounding of u multiplied by R. The
// difference is made up by the smallest changes that the states allow: along the normal and the tangents for a sticking
// contact, along the force's own ray on the cone for a slipping contact.
void ContactProblem::balance(Rows rows, const Twist& y) noexcept {
  FactoredMatrix factors;
  bool changes = true;  // the rays of slipping contacts change with the forces
  for (int k = 0; k < 2; ++k) {
    Mat6 G = Mat6::Zero();
    Twist lack = y;
    double size = 0.0;
    const bool known = !changes;
    changes = false;
    for (const Row& row : rows) {
      if (row.state == ContactState::open) continue;
      lack.noalias() -= row.H.transpose() * row.f;
      size += row.w;
      if (row.state == ContactState::stick) {
        if (!known) G.noalias() += row.H.transpose() * row.H;
      } else if (row.f[0] > 0.0) {
        changes = true;
        const Twist ray = row.H.transpose() * (row.f / row.f[0]);
        G.noalias() += ray * ray.transpose();
      }
    }
    if (!(size > 0.0)) return;
    G.diagonal().array() += 1e-10 * size;
    if (!known) factors.factor(G);
    const Twist share = factors.solve(lack);
    for (Row& row : rows) {
      if (row.state == ContactState::open) continue;
      if (row.state == ContactState::stick) {
        row.f += row.H * share;
      } else if (row.f[0] > 0.0) {
        const Vec3 ray = row.f / row.f[0];
        row.f += ray * ray.dot(row.H * share);
      }
    }
  }
}

void ContactProblem::gauss_seidel(Rows rows, Twist& y, int sweeps) noexcept {
  y.setZero();
  std::array<double, most> yields;  // upper bound of the largest eigenvalue of H Hᵀ, m/N
  for (std::size_t i = 0; i < rows.size(); ++i) {
    y += rows[i].H.transpose() * rows[i].f;
    yields[i] = (rows[i].H * rows[i].H.transpose()).norm();
  }
  for (int k = 0; k < sweeps && may_look_at(rows); ++k) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Row& row = rows[i];
      for (int j = 0; j < 3; ++j) {  // a few projections on the law of this contact
        const Projected now = project(row.f - (row.H * y + row.b) / yields[i], row.mu);
        y += row.H.transpose() * (now.f - row.f);
        row.f = now.f;
        row.state = now.state;
      }
    }
  }
}

// Solves the problem without friction, which has a solution if all gaps can be kept. Then raises friction as far as
// Newton's method follows. (Of 2,149 problems of a random search that neither Newton's method nor Gauss-Seidel sweeps
// solved within the work of a step, this function solves 1,120.)
bool ContactProblem::by_more_friction(Rows rows, Twist& y, double size) noexcept {
  std::array<double, most> mu;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    mu[i] = std::exchange(rows[i].mu, 0.0);
    rows[i].f.setZero();
  }
  const double rough = rough_;
  bool follows = without_friction(rows, y);
  Iterate reached = kept(rows, y);
  double share = 0.0, raise = 1.0;
  while (follows && share < 1.0 && !exhausted()) {
    const double next = std::min(1.0, share + raise);
    rough_ = next < 1.0 ? std::max(rough, kRough) : rough;
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].mu = next * mu[i];
    go_to(reached, rows, y);
    if (newton(rows, y, size, kRaised)) {
      reached = kept(rows, y);
      share = next;
      raise *= 2.0;
    } else {
      raise *= 0.5;
      follows = raise >= kLeastRaise;
    }
  }
  rough_ = rough;
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].mu = mu[i];
  return follows && share == 1.0;
}

bool ContactProblem::solve(const Twist& e, std::span<LinearContact> contacts, Twist& delta, double rough) noexcept {
  rough_ = rough;
  const double size = make_rows(e, contacts);
  const Rows rows(rows_.data(), contacts.size());
  Twist y = L_.transpose() * e;
  const Twist start = y;
  bool solved = closed_form_ && rows.size() == 1 && may_look_at(rows) &&
                one_contact(rows[0], y, size, std::max(rough, kTolerance));
  if (!solved) {
    y = start;
    solved = newton(rows, y, size, 25);
  }
  const bool slippery = std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.mu == 0.0; });
  if (!solved && slippery) {
    solved = without_friction(rows, y);
    if (!solved) y = start;
  }
  if (!solved && !slippery) {
    y = start;
    solved = rows.size() <= kFew && enumerate(rows, y, size, nullptr);
  }
  for (int attempt = 0; attempt < kAttempts && !solved && !exhausted(); ++attempt) {
    if (attempt == 0) {
      for (Row& row : rows) row.f.setZero();
    }
    // The sweeps of attempt 0 solve most problems, and cost less than by_more_friction().
    if (attempt == 1 && !slippery) {
      const Iterate swept = kept(rows, y);
      solved = by_more_friction(rows, y, size);
      if (solved) break;
      go_to(swept, rows, y);
    }
    gauss_seidel(rows, y, 20 << attempt);
    const Iterate reached = kept(rows, y);
    solved = newton(rows, y, size, 25);
    if (solved) break;
    go_to(reached, rows, y);
    solved = damped_newton(rows, y, size, 40);
    if (solved) break;
    if (attempt % 2 == 1) solved = next_to(reached, rows, y, size);
    if (!solved) go_to(reached, rows, y);
  }
  if (!solved && contacts.size() == 4 && !exhausted()) solved = enumerate(rows, y, size, nullptr);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    contacts[i].f = rows[i].f;
    contacts[i].state = rows[i].state;
  }
  delta = L_inverse_.transpose() * y - e;
  return solved;
}

bool ContactProblem::holds(const Twist& e, std::span<LinearContact> contacts, Twist& delta) noexcept {
  const double size = make_rows(e, contacts);
  const Rows rows(rows_.data(), contacts.size());
  Twist y = Twist::Zero();
  for (const Row& row : rows) {
    if (row.f[0] < 0.0) return false;  // the contact's normal has turned since, so that this force would pull
    y += row.H.transpose() * row.f;
  }
  delta = L_inverse_.transpose() * y - e;
  if (!may_look_at(rows) || !(violation(rows, y) <= kTolerance * size)) return false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const bool bears = row.f[0] > 0.0;
    contacts[i].state = bears ? project(row.f - (row.H * y + row.b) / row.w, row.mu).state : ContactState::open;
  }
  return true;
}

// Runs Newton's method with the states of `reached` held fixed, except for the state of one contact. Each contact and
// each other state is tried. This is needed if contacts nearly wedge the tool: Gauss-Seidel then creeps towards a state
// that it never reaches.
bool ContactProblem::next_to(const Iterate& reached, Rows rows, Twist& y, double size) noexcept {
  for (std::size_t flipped = 0; flipped < rows.size(); ++flipped) {
    for (int turn = 1; turn <= 2; ++turn) {
      go_to(reached, rows, y);
      look(rows, y);
      take_seen_states(rows);
      Row& row = rows[flipped];
      row.state = static_cast<ContactState>((static_cast<int>(row.state) + turn) % 3);
      if (held_newton(rows, y, size, 12, false)) return true;
    }
  }
  return false;
}

// Runs Newton's method with fixed states. `quick`: gives up as soon as a step doesn't reduce the violation by enough
// (kStays).
bool ContactProblem::held_newton(Rows rows, Twist& y, double size, int most_iterations, bool quick) noexcept {
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0; k < most_iterations && may_look_at(rows); ++k) {
    if (!newton_step(rows, y)) return false;
    if (is_solved(rows, y, size, 2 * k < most_iterations ? kTolerance : kNoisyTolerance)) return true;
    if (!quick) continue;
    const double off = std::exchange(last, violation(rows, y));
    if (k > 1 && !(last < kStays * off)) return false;
  }
  return false;
}

// Runs held_newton() from y = start and from zero forces.
bool ContactProblem::newton_with_states(Rows rows, Twist& y, double size, Twist start, bool quick) noexcept {
  y = start;
  for (Row& row : rows) row.f.setZero();
  look(rows, y);
  return held_newton(rows, y, size, quick ? kQuickSteps : 30, quick);
}

bool ContactProblem::enumerate(Rows rows, Twist& y, double size, int* different) noexcept {
  const bool quick = different == nullptr && rows.size() <= kFew;
  const Twist start = y;
  std::array<Twist, 16> found;
  std::size_t count = 0;
  int combinations = 1;
  for (std::size_t i = 0; i < rows.size(); ++i) combinations *= 3;
  for (int number = 0; number < combinations && !exhausted(); ++number) {
    int rest = number;
    for (Row& row : rows) {
      row.state = static_cast<ContactState>(rest % 3);
      rest /= 3;
    }
    if (!newton_with_states(rows, y, size, start, quick)) continue;
    if (different == nullptr) return true;
    const auto same = [&](const Twist& other) { return (other - y).norm() <= 1e-6 * size; };
    if (count < found.size() && std::none_of(found.begin(), found.begin() + count, same)) found[count++] = y;
  }
  if (different != nullptr) *different = static_cast<int>(count);
  return count > 0;
}

int ContactProblem::count_solutions(const Twist& e, std::span<const LinearContact> contacts) noexcept {
  const double size = make_rows(e, contacts);
  Twist y = L_.transpose() * e;
  int different = 0;
  enumerate({rows_.data(), contacts.size()}, y, size, &different);
  return different;
}

}  // namespace proxarm::models
