// The point of half-spaces and balls that is nearest to another, by trying all choices of up to N of them in long
// double: slow, and independent of how the controller finds it.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::controller::testing {

template <int N>
class NearestPoint {
 public:
  // n·x ≤ bound, n of any length but zero.
  void plane(const models::Vec<N>& normal, double bound_m) {
    const V n = normal.template cast<long double>();
    sets_.push_back({false, n / n.norm(), bound_m / n.norm()});
  }
  void ball(const models::Vec<N>& centre, double radius_m) {
    sets_.push_back({true, centre.template cast<long double>(), radius_m});
  }

  // False where no choice's point is in all of them (within 1e-16 m).
  bool find(const models::Vec<N>& y, models::Vec<N>& x) const {
    least_ = std::numeric_limits<long double>::infinity();
    std::vector<const Set*> chosen;
    try_all(y.template cast<long double>(), 0, chosen);
    x = best_.template cast<double>();
    return least_ < std::numeric_limits<long double>::infinity();
  }

 private:
  using V = Eigen::Matrix<long double, N, 1>;
  struct Set {
    bool ball;
    V n;  // normal or centre
    long double b;
  };

  void try_all(const V& y, std::size_t from, std::vector<const Set*>& chosen) const {
    V x;
    if (on_all(y, chosen, x) && within(x) && (x - y).norm() < least_) {
      least_ = (x - y).norm();
      best_ = x;
    }
    if (chosen.size() == N) return;
    for (std::size_t i = from; i < sets_.size(); ++i) {
      chosen.push_back(&sets_[i]);
      try_all(y, i + 1, chosen);
      chosen.pop_back();
    }
  }

  bool within(const V& x) const {
    for (const Set& set : sets_) {
      if ((set.ball ? (x - set.n).norm() : set.n.dot(x)) - set.b > 1e-16L) return false;
    }
    return true;
  }

  // The point nearest to y on all of their borders. Two spheres meet in a plane.
  static bool on_all(const V& y, const std::vector<const Set*>& chosen, V& x) {
    std::vector<V> e;
    std::vector<long double> offset;
    const Set* sphere = nullptr;
    for (const Set* set : chosen) {
      V n = set->n;
      long double b = set->b;
      if (set->ball && sphere == nullptr) {
        sphere = set;
        continue;
      }
      if (set->ball) {  // |x − c|² − r² of one less that of the other
        n = 2.0L * (set->n - sphere->n);
        b = sphere->b * sphere->b - set->b * set->b + set->n.squaredNorm() - sphere->n.squaredNorm();
        b /= n.norm();
        n /= n.norm();
      }
      for (std::size_t k = 0; k < e.size(); ++k) {
        const long double along = e[k].dot(n);
        n -= along * e[k];
        b -= along * offset[k];
      }
      if (!(n.norm() > 1e-14L)) return false;
      e.push_back(n / n.norm());
      offset.push_back(b / n.norm());
    }
    const auto onto_planes = [&](V z) {
      for (std::size_t k = 0; k < e.size(); ++k) z += (offset[k] - e[k].dot(z)) * e[k];
      return z;
    };
    x = onto_planes(y);
    if (sphere == nullptr) return true;
    const V centre = onto_planes(sphere->n);
    const long double left2 = sphere->b * sphere->b - (centre - sphere->n).squaredNorm(), away = (x - centre).norm();
    if (!(left2 >= 0.0L && away > 0.0L)) return false;
    x = centre + std::sqrt(left2) / away * (x - centre);
    return true;
  }

  std::vector<Set> sets_;
  mutable long double least_ = 0.0L;
  mutable V best_ = V::Zero();
};

}  // namespace proxarm::controller::testing
