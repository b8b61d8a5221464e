// Solves the local problem without friction: finds the point y nearest to 0 in the intersection of the half-spaces H_n
// y + b_n ≥ 0, one for each contact.
//
// Method: Goldfarb and Idnani's dual method ("A numerically stable dual method for solving strictly convex quadratic
// programs", 1983). It adds violated half-spaces one after the other to a set of held half-spaces, and removes those
// whose force would become negative. It ends after finitely many steps if there is a solution, even if the contacts
// nearly depend on each other.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {
namespace {

// A half-space that is violated by less than this counts as satisfied. It is a tenth of the distance by which a mesh's
// faces are offset outwards (1e-13 m).
constexpr double kHeld_m = 1e-14;
// A normal depends on the held normals if the part of it perpendicular to them is below this share: this part is only
// rounding.
constexpr double kNew = 1e-6;
// A half-space whose normal depends on the held normals may be violated by this much. It is a tenth of the gap
// tolerance (kGap_m).
constexpr double kMissed_m = 1e-13;
constexpr int kMostChanges = 96;  // changes of the held set: four for each contact

class Holding {
 public:
  // Factors the held normals: N = Q R.
  void set(std::span<const Twist> normals, std::span<const std::size_t> held) noexcept {
    count_ = held.size();
    R_.setZero();
    for (std::size_t i = 0; i < count_; ++i) {
      Twist q = normals[held[i]];
      // Two rounds of orthogonalisation are enough.
      for (int round = 0; round < 2; ++round) {
        for (std::size_t j = 0; j < i; ++j) {
          const double along = Q_[j].dot(q);
          R_(static_cast<int>(j), static_cast<int>(i)) += along;
          q -= along * Q_[j];
        }
      }
      const double size = q.norm();
      R_(static_cast<int>(i), static_cast<int>(i)) = size;
      Q_[i] = q / size;
    }
  }
  // Returns the part of `normal` that is perpendicular to the held normals. change[j] becomes the amount by which held
  // force j falls when the force along `normal` grows by one.
  [[nodiscard]] Twist beyond(const Twist& normal, std::array<double, 6>& change) const noexcept {
    Twist z = normal;
    std::array<double, 6> along{};
    for (int round = 0; round < 2; ++round) {
      for (std::size_t j = 0; j < count_; ++j) {
        const double part = Q_[j].dot(z);
        along[j] += part;
        z -= part * Q_[j];
      }
    }
    change = weights(along);
    return z;
  }
  // Returns the point nearest to 0 at which all held half-spaces are touched: Nᵀy = −b.
  [[nodiscard]] Twist place(const std::array<double, 6>& b) const noexcept {
    Twist y = Twist::Zero();
    std::array<double, 6> x{};
    for (std::size_t k = 0; k < count_; ++k) {
      double sum = -b[k];
      for (std::size_t j = 0; j < k; ++j) sum -= R_(static_cast<int>(j), static_cast<int>(k)) * x[j];
      x[k] = sum / R_(static_cast<int>(k), static_cast<int>(k));
      y += x[k] * Q_[k];
    }
    return y;
  }
  // Returns the forces of the held half-spaces whose sum is y.
  [[nodiscard]] std::array<double, 6> forces(const Twist& y) const noexcept {
    std::array<double, 6> along{};
    for (std::size_t j = 0; j < count_; ++j) along[j] = Q_[j].dot(y);
    return weights(along);
  }

 private:
  // Solves R x = a.
  [[nodiscard]] std::array<double, 6> weights(const std::array<double, 6>& a) const noexcept {
    std::array<double, 6> x{};
    for (std::size_t k = count_; k-- > 0;) {
      double sum = a[k];
      for (std::size_t j = k + 1; j < count_; ++j) sum -= R_(static_cast<int>(k), static_cast<int>(j)) * x[j];
      x[k] = sum / R_(static_cast<int>(k), static_cast<int>(k));
    }
    return x;
  }

  std::array<Twist, 6> Q_;
  Mat6 R_ = Mat6::Zero();
  std::size_t count_ = 0;
};

}  // namespace

bool ContactProblem::without_friction(Rows rows, Twist& y) noexcept {
  std::array<Twist, most> normals;
  std::array<std::size_t, 6> held{};
  std::array<double, 6> force{};
  std::array<bool, most> depends{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) normals[i] = rows[i].H.row(0).transpose();
  y.setZero();
  Holding holding;
  for (int changes = 0; changes < kMostChanges;) {
    std::size_t worst = rows.size();
    double missed = -kHeld_m;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double gap = normals[i].dot(y) + rows[i].b[0];
      if (!(gap < missed) || (depends[i] && gap > -kMissed_m)) continue;
      missed = gap;
      worst = i;
    }
    if (worst == rows.size()) {
      for (Row& row : rows) {
        row.f.setZero();
        row.state = ContactState::open;
      }
      holding.set({normals.data(), rows.size()}, {held.data(), count});
      // y and the forces are computed again from the held set, which removes the rounding of all changes.
      std::array<double, 6> b{};
      for (std::size_t j = 0; j < count; ++j) b[j] = rows[held[j]].b[0];
      y = holding.place(b);
      force = holding.forces(y);
      for (std::size_t j = 0; j < count; ++j) {
        Row& row = rows[held[j]];
        row.f[0] = std::max(force[j], 0.0);
        row.state = row.f[0] > 0.0 ? ContactState::slip : ContactState::open;
      }
      return y.allFinite();
    }
    double own = 0.0;
    for (bool holds = false; !holds; ++changes) {
      if (changes >= kMostChanges) return false;
      std::array<double, 6> change{};
      holding.set({normals.data(), rows.size()}, {held.data(), count});
      const Twist z = holding.beyond(normals[worst], change);
      const bool is_new = count < held.size() && z.norm() > kNew * normals[worst].norm();
      double growth = is_new ? -(normals[worst].dot(y) + rows[worst].b[0]) / z.dot(normals[worst])
                             : std::numeric_limits<double>::infinity();
      std::size_t let_go = count;
      for (std::size_t j = 0; j < count; ++j) {
        if (!(change[j] > 0.0) || force[j] / change[j] >= growth) continue;
        growth = force[j] / change[j];
        let_go = j;
      }
      if (!std::isfinite(growth)) {
        if (!(missed > -kMissed_m)) return false;  // no point lies in all half-spaces
        depends[worst] = true;
        break;
      }
      for (std::size_t j = 0; j < count; ++j) force[j] -= growth * change[j];
      own += growth;
      if (is_new) y += growth * z;
      holds = let_go == count;
      if (holds) {
        held[count] = worst;
        force[count++] = own;
      } else {
        --count;
        held[let_go] = held[count];
        force[let_go] = force[count];
      }
    }
  }
  return false;
}

}  // namespace proxarm::models
