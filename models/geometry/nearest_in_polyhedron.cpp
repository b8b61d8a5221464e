#include "models/geometry/nearest_in_polyhedron.hpp"

#include <cmath>
#include <limits>

namespace proxarm::models {
namespace {

// A row counts as dependent on the active rows if the sine of its angle to their span is below this. At smaller angles
// the QR decomposition of the rows has no correct digits left.
constexpr double dependent = 1e-10;
// Tolerance of a row during the exchanges, relative to the size of its factors: some dozen rounding errors.
constexpr double rounding = 1e-14;
// Tolerance of a row in the solution, relative to the row's bound. Nearly parallel active rows leave no more digits.
constexpr double held = 1e-6;
// Largest number of exchanges of rows. About three are usual. Without rounding the method always ends; with rounding it
// can cycle.
constexpr int most_exchanges = 100;

}  // namespace

void NearestInPolyhedron::start(const SmallMatrix& H, const SmallVector& g) noexcept {
  L_ = H;
  const Eigen::Index n = H.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index k = 0; k < j; ++k) {
      for (Eigen::Index i = j; i < n; ++i) L_(i, j) -= L_(i, k) * L_(j, k);
    }
    const double pivot = std::sqrt(L_(j, j));
    for (Eigen::Index i = j; i < n; ++i) L_(i, j) /= pivot;
  }
  u0_ = backward(forward(g));
  count_ = equalities_ = active_count_ = 0;
}

SmallVector NearestInPolyhedron::forward(SmallVector b) const noexcept {
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) b[i] -= L_(i, j) * b[j];
    b[i] /= L_(i, i);
  }
  return b;
}

SmallVector NearestInPolyhedron::backward(SmallVector b) const noexcept {
  for (Eigen::Index i = b.size(); i-- > 0;) {
    for (Eigen::Index j = i + 1; j < b.size(); ++j) b[i] -= L_(j, i) * b[j];
    b[i] /= L_(i, i);
  }
  return b;
}

void NearestInPolyhedron::add(const SmallVector& a, double b) noexcept {
  if (count_ == most) return;
  const SmallVector n = forward(a);
  const double length = n.norm();
  if (!(length > 0.0) || !std::isfinite(length)) return;
  push(n / length, length, (b - a.dot(u0_)) / length);
}

void NearestInPolyhedron::push(const SmallVector& normal, double length, double bound) noexcept {
  if (count_ == most) return;
  normal_[count_] = normal;
  length_[count_] = length;
  bound_[count_] = bound;
  lambda_[count_++] = 0.0;
}

void NearestInPolyhedron::equal(const SmallVector& e, double f) noexcept {
  add(e, f);
  equalities_ = count_;
}

void NearestInPolyhedron::at_most(const SmallVector& a, double b) noexcept { add(a, b); }

// The normals of these rows are the columns of L⁻¹ and their negatives.
void NearestInPolyhedron::within(const SmallVector& low, const SmallVector& high) noexcept {
  const Eigen::Index size = u0_.size();
  for (Eigen::Index i = 0; i < size; ++i) {
    SmallVector n = SmallVector::Zero(size);
    n[i] = 1.0 / L_(i, i);
    for (Eigen::Index k = i + 1; k < size; ++k) {
      for (Eigen::Index j = i; j < k; ++j) n[k] -= L_(k, j) * n[j];
      n[k] /= L_(k, k);
    }
    const double length = n.norm();
    if (!std::isfinite(length)) continue;
    n /= length;
    push(n, length, (high[i] - u0_[i]) / length);
    push(-n, length, (u0_[i] - low[i]) / length);
  }
}

void NearestInPolyhedron::orthogonalise() noexcept {
  for (std::size_t k = 0; k < active_count_; ++k) {
    SmallVector n = normal_[active_[k]];
    for (std::size_t j = 0; j < k; ++j) {
      R_[j][k] = e_[j].dot(n);
      n -= R_[j][k] * e_[j];
    }
    R_[k][k] = n.norm();
    e_[k] = n / R_[k][k];
  }
}

void NearestInPolyhedron::split(std::size_t p, SmallVector& outside,
                                std::array<double, most_rows>& coefficients) const noexcept {
  outside = normal_[p];
  std::array<double, most_rows> along{};
  for (std::size_t j = 0; j < active_count_; ++j) {
    along[j] = e_[j].dot(outside);
    outside -= along[j] * e_[j];
  }
  for (std::size_t k = active_count_; k-- > 0;) {
    double sum = along[k];
    for (std::size_t j = k + 1; j < active_count_; ++j) sum -= R_[k][j] * coefficients[j];
    coefficients[k] = sum / R_[k][k];
  }
}

void NearestInPolyhedron::leave(std::size_t k) noexcept {
  lambda_[active_[k]] = 0.0;
  for (std::size_t i = k + 1; i < active_count_; ++i) active_[i - 1] = active_[i];
  --active_count_;
  orthogonalise();
}

bool NearestInPolyhedron::take_in(std::size_t p) noexcept {
  double beyond = normal_[p].dot(v_) - bound_[p], lambda = 0.0;
  for (int exchange = 0; exchange < most_exchanges; ++exchange) {
    SmallVector outside;
    std::array<double, most_rows> coefficients{};
    split(p, outside, coefficients);
    const double z2 = outside.squaredNorm();
    const bool free = z2 > dependent * dependent && active_count_ < static_cast<std::size_t>(v_.size());
    const double whole = free ? beyond / z2 : std::numeric_limits<double>::infinity();
    double t = whole;
    std::size_t blocking = active_count_;
    for (std::size_t k = 0; k < active_count_; ++k) {
      if (active_[k] < equalities_ || !(coefficients[k] * beyond > 0.0)) continue;
      const double until = lambda_[active_[k]] / coefficients[k];
      if (std::abs(until) < std::abs(t)) {
        t = until;
        blocking = k;
      }
    }
    if (!std::isfinite(t)) return std::abs(beyond) <= rounding * (1.0 + v_.norm());
    for (std::size_t k = 0; k < active_count_; ++k) lambda_[active_[k]] -= t * coefficients[k];
    lambda += t;
    if (free) {
      v_ -= t * outside;
      beyond -= t * z2;
    }
    if (blocking == active_count_) {
      lambda_[p] = lambda;
      active_[active_count_++] = p;
      orthogonalise();
      return true;
    }
    leave(blocking);
  }
  return false;
}

bool NearestInPolyhedron::solve() noexcept {
  v_ = SmallVector::Zero(u0_.size());
  active_count_ = 0;
  bool feasible = true;
  for (std::size_t i = 0; i < count_; ++i) lambda_[i] = 0.0;
  for (std::size_t i = 0; i < equalities_ && feasible; ++i) feasible = take_in(i);
  for (int exchange = 0; feasible && exchange < most_exchanges; ++exchange) {
    double most_beyond = rounding * (1.0 + v_.norm());
    std::size_t worst = count_;
    for (std::size_t i = equalities_; i < count_; ++i) {
      const double beyond = normal_[i].dot(v_) - bound_[i];
      if (lambda_[i] == 0.0 && beyond > most_beyond) {
        most_beyond = beyond;
        worst = i;
      }
    }
    if (worst == count_) break;
    feasible = take_in(worst);
  }
  u_ = u0_ + backward(v_);
  for (std::size_t i = 0; i < count_; ++i) lambda_[i] /= length_[i];
  return feasible && holds();
}

// Checks all rows at the end, because nearly parallel rows lose digits and the exchanges may have ended too early.
bool NearestInPolyhedron::holds() const noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    const double along = normal_[i].dot(v_), beyond = along - bound_[i];
    const double tolerance = held * (std::abs(along) + std::abs(bound_[i])) + rounding;
    if (!(beyond <= tolerance) || (i < equalities_ && !(beyond >= -tolerance))) return false;
  }
  return true;
}

}  // namespace proxarm::models
