#include "models/local_problem/contact_problem.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

// Rounding of a square and its root is less.
constexpr double kNextToLimit = 1e-14;

// Alart and Curnier's projection of z = f − u/w, and the state that it tells.
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
  if (z_t2 < (1.0 - kNextToLimit) * (limit * limit)) return out;  // most do, and need no root
  const double z_t = std::sqrt(z_t2);
  if (z_t <= limit) return out;
  out.state = ContactState::slip;
  out.f.tail<2>() *= limit / z_t;
  return out;
}

// How much stiffer than the coupling the contacts are in Newton's iteration. The multipliers converge by 1/(1 + kStiff
// λ) a step, λ being the smallest eigenvalue of the scaled W = H Hᵀ that isn't 0; beyond 1e9 rounding (kStiff u) would
// be felt in the states.
constexpr double kStiff = 1e7;
// Relative to what the free motion would press with: a hundred roundings of sums over rows.
constexpr double kTolerance = 1e-12;
// Where contacts hold each other (an edge, a face), rounding of the stiff ones moves a slip that is next to none, and
// the law is met to some 1e-11 only. After so many steps that is taken: 1e-9 N of 10 N.
constexpr double kNoisyTolerance = 1e-10;
constexpr int kQuiet = 18;
constexpr double kRough = 1e-7;  // before the forces are balanced
constexpr int kAttempts = 6;     // of Gauss and Seidel's, each with twice the sweeps of the one before
// Of so few contacts all combinations of states are tried before Gauss and Seidel's sweeps are: with so many steps
// each, and only as long as each leaves less than this share of what the law was missed by before it.
constexpr std::size_t kFew = 3;
constexpr int kQuickSteps = 8;
constexpr double kStays = 0.7;
// The share of what the gap that is missed most takes to be held (make_rows()).
constexpr double kMissed = 0.1;
// Where friction is raised from nothing: steps of Newton's at each share of it, and the least by which it is raised.
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

// Returns what the free motion would press with; or, where a pose of the iteration is p̂ itself and that is nothing, a
// share of what the gap that is missed most takes to be held.
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

// ‖f − P(f − u/w)‖ + ‖Σ Hᵀf − y‖, in the units of y: 0 at a solution, and nowhere else.
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
  return std::max(off.norm(), law);  // in this order: what isn't a number stays so
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

// The same as a sum of squares.
double ContactProblem::residual2(Rows rows, const Twist& y) noexcept {
  Twist off = -y;
  double law2 = 0.0;
  for (const Row& row : rows) {
    off += row.H.transpose() * row.f;
    law2 += row.w * (row.f - project(row.f - (row.H * y + row.b) / row.w, row.mu).f).squaredNorm();
  }
  return law2 + off.squaredNorm();
}

// One step of semismooth Newton for y and f, with the states chosen before. Each contact's new force is linear in its
// new displacement, f⁺ = f̄ − P u⁺:
//   stick  u⁺ = 0, for which f⁺ = f − R u⁺ with a large R (the proximal point: redundant rows need no choice)
//   slip   u_n⁺ = 0 likewise; f_t⁺ = μ (f_n⁺ d + z_n T z_t⁺/‖z_t‖), d = z_t/‖z_t‖, T = I − d dᵀ, z = f − u/w. Along d
//          that is μ f_n⁺, across it −a/(1 − a) u_t⁺/w with a = μ z_n/‖z_t‖
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

// Newton with a line search, where plain steps cycle between states: of the halves of a step the first that lessens the
// residual is taken, or the least of all.
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

// Forces carry the rounding of u times r. What the sum lacks of y is made up for by the smallest changes that the
// states allow: along the normal and the tangents where it sticks, along the cone's ray where it slips.
void ContactProblem::balance(Rows rows, const Twist& y) noexcept {
  FactoredMatrix factors;
  bool changes = true;  // rays of what slips, with its forces
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
  std::array<double, most> yields;  // a bound of the largest eigenvalue of H Hᵀ, m/N
  for (std::size_t i = 0; i < rows.size(); ++i) {
    y += rows[i].H.transpose() * rows[i].f;
    yields[i] = (rows[i].H * rows[i].H.transpose()).norm();
  }
  for (int k = 0; k < sweeps && may_look_at(rows); ++k) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Row& row = rows[i];
      for (int j = 0; j < 3; ++j) {  // a few projections on the contact's own law
        const Projected now = project(row.f - (row.H * y + row.b) / yields[i], row.mu);
        y += row.H.transpose() * (now.f - row.f);
        row.f = now.f;
        row.state = now.state;
      }
    }
  }
}

// Without friction there is a solution wherever gaps can be kept. From there friction is raised, by as much as Newton's
// method follows. (Of 2,149 problems of a random hunt that neither Newton's method nor sweeps within a step's work
// solved it finds 1,120.)
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
    if (attempt == 1 && !slippery) {  // most are solved by the first sweeps, for less
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
    if (row.f[0] < 0.0) return false;  // its normal has turned on: nothing pulls
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

// Newton with the states held that `reached` tells, but for one contact's: where contacts nearly wedge the tool, Gauss
// and Seidel's creeps towards a state that it never reaches.
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

// `quick`: no longer than while what the law is missed by lessens.
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

// The same from no forces.
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
