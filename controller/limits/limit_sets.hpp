// Projects a point onto the limits of one step, in the N coordinates of a scene.
//
//   min ½‖x − y‖²   over   n_i·x ≤ b_i,  ‖x − c_j‖ ≤ r_j
//
// At most N of the sets, the active ones, determine the solution:
//   y − x = Σ λ_i g_i,  λ_i ≥ 0,  g_i: outward unit normal of set i at x
// An active-set method finds the active sets, like a method for linear programs of low dimension (Sharir and Welzl
// 1992). It repeats an exchange:
//   1. The set that the present point violates most becomes a candidate, beside the active sets.
//   2. Every subset of at most N candidates that includes the new candidate is tried (7 subsets if N = 3). One of these
//      subsets is optimal for all candidates, and becomes the active sets.
// Each exchange increases the distance of x from y, so no combination of active sets occurs twice.
//
// All lengths in m. Nothing allocates, locks or throws.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <span>

#include "controller/limits/followable_step.hpp"
#include "controller/limits/step_limits.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The sets of one step, and the projection onto these sets. All points x are relative to q₁: x = q − q₁.
template <int N>
class LimitSets {
 public:
  using V = models::Vec<N>;

  void clear() noexcept {
    soft_count_ = plane_count_ = flat_count_ = hard_count_ = 0;
    arm_ = nullptr;
  }

  // Sets the sets to the intersection of `limits`, given in W, with a scene's space (basis: 3×N, orthonormal).
  void set(const StepLimits& limits, const Eigen::Matrix<double, 3, N>& basis) noexcept {
    clear();
    for (std::size_t i = 0; i < limits.soft_count; ++i) soft_[soft_count_++] = cut(limits.soft[i], basis);
    for (std::size_t i = 0; i < limits.hard_count; ++i) hard_[hard_count_++] = cut(limits.hard[i], basis);
    add({limits.planes.data(), limits.plane_count}, basis);
    arm_ = limits.arm;
    q_k1_W_ = limits.q_k1_W;
    basis_ = basis;
  }

  // Whether the arm can follow a step to x, by its exact kinematics. `scene_x`: the point x in the scene's coordinates,
  // not relative to q₁. If the scene's coordinates are W's, the query uses scene_x itself, the exact place that the arm
  // is sent to.
  [[nodiscard]] bool followed(const V& x, const V& scene_x) const noexcept {
    if (arm_ == nullptr) return true;
    if constexpr (N == 3) {
      if (basis_ == models::Mat3::Identity()) return arm_->contains(scene_x);
    }
    return arm_->contains(to_W(x));
  }

  // Walls are further half-spaces for nearest(): −n·x ≤ −n·point, where n points out of the wall. There are at most
  // `most_walls`.
  static constexpr std::size_t most_walls = 6;
  void clear_walls() noexcept { flat_count_ = plane_count_; }
  void add_wall(const V& point, const V& normal) noexcept {
    if (flat_count_ < plane_count_ + most_walls) planes_[flat_count_++] = {-normal, -normal.dot(point)};
  }

  [[nodiscard]] bool contains(const V& x, double tolerance_m, bool with_soft) const noexcept {
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) {
      if (!inside(soft_[i], x, tolerance_m)) return false;
    }
    for (std::size_t i = 0; i < hard_count_; ++i) {
      if (!inside(hard_[i], x, tolerance_m)) return false;
    }
    for (std::size_t i = 0; i < plane_count_; ++i) {
      if (!(planes_[i].normal.dot(x) <= planes_[i].bound_m + tolerance_m)) return false;
    }
    return true;
  }

  // A point that keeps all sets, and the active sets that determine it.
  struct Nearest {
    Nearest() noexcept { basis.fill(V::Zero()); }

    V x = V::Zero();
    std::array<std::size_t, N> members{};  // the active sets, by their index in violation()
    std::array<V, N> basis;                // orthonormal; spans the active sets' normals at x
    std::size_t count = 0;                 // number of entries of members and of basis
    double bend = 0.0;                     // Σ λ_j/r_j over the active balls
    V shift = V::Zero();                   // −Σ λ_i g_i over the active limits, without walls
    bool exact = false;                    // false: found by Dykstra's algorithm, without members
    ActiveLimits active;

    // Returns ∂x/∂y v = (E − Σ e eᵀ) v / (1 + Σ λ_j/r_j). This formula follows from y − x = Σ λ_i g_i with constant
    // active sets: along the common border of the active sets, each ball's normal turns by 1/r_j per unit of length.
    [[nodiscard]] V derivative(const V& v) const noexcept {
      V along = v;
      for (std::size_t i = 0; i < count; ++i) along -= basis[i].dot(v) * basis[i];
      return along / (1.0 + bend);
    }
  };

  // Returns the point nearest to y that keeps all sets. If no active sets solve the problem, because the sets have
  // almost no common point, Dykstra's algorithm computes the point. `sweeps`: the number of sweeps that Dykstra's
  // algorithm may still make; decreased by the sweeps made.
  [[nodiscard]] Nearest nearest(const V& y, bool with_soft, int& sweeps) noexcept {
    Nearest result;
    for (int cuts = 0;; ++cuts) {
      result = {};
      result.exact = decide(y, with_soft, result);
      if (!result.exact) {
        result = {};
        result.x = project(y, with_soft, result.active, sweeps);
      }
      if (arm_ == nullptr || cuts == most_cuts || !take_in_cut(result.x)) return result;
    }
  }

  // Returns x, moved back into the sets along the line to a base point. The base point is q₁ if q₁ is in the sets, else
  // the point to which braking leads. Use this function if the alternation of contacts and limits, or Dykstra's
  // algorithm, has left x outside.
  [[nodiscard]] V draw_back(const V& x, bool with_soft) const noexcept {
    V base = V::Zero();
    for (std::size_t i = 0; i < hard_count_; ++i) {  // the last ball, the acceleration's, has the last word
      const double off = (base - hard_[i].centre).norm();
      if (off > hard_[i].radius_m) base = hard_[i].centre + hard_[i].radius_m / off * (base - hard_[i].centre);
    }
    const V d = x - base;
    double t = 1.0;
    for (std::size_t i = 0; i < plane_count_; ++i) {
      const double room = planes_[i].bound_m - planes_[i].normal.dot(base), way = planes_[i].normal.dot(d);
      if (room >= 0.0 && way > room) t = std::min(t, room / way);
    }
    for (std::size_t i = 0; i < hard_count_; ++i) t = std::min(t, way_within(hard_[i], base, d));
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) t = std::min(t, way_within(soft_[i], base, d));
    return base + t * d;
  }

 private:
  static constexpr double sweep_tolerance_m = 1e-13;
  static constexpr int most_exchanges = 60;  // usually about 3 are needed
  static constexpr double parallel = 1e-12;  // normals count as parallel below this sine of their angle
  static constexpr int most_cuts = 8;        // most calls of take_in_cut() in one nearest(); usually one or two

  [[nodiscard]] models::Vec3 to_W(const V& x) const noexcept { return q_k1_W_ + basis_ * x; }

  // Adds the half-space that separates x from the steps that the arm can follow. Returns false if the arm can follow x,
  // or if the half-space can't be added. Walls stay last.
  bool take_in_cut(const V& x) noexcept {
    LimitPlane<3> plane;
    if (plane_count_ == StepLimits::max_planes || !arm_->cut(to_W(x), q_k1_W_, plane)) return false;
    const V normal = basis_.transpose() * plane.normal;
    const double length = normal.norm();
    if (!(length > 1e-9)) return false;
    for (std::size_t i = flat_count_; i > plane_count_; --i) planes_[i] = planes_[i - 1];
    planes_[plane_count_++] = {normal / length, plane.bound_m / length, plane.limits};
    ++flat_count_;
    return true;
  }

  void add(std::span<const LimitPlane<3>> planes, const Eigen::Matrix<double, 3, N>& basis) noexcept {
    for (const LimitPlane<3>& plane : planes) {
      if (plane_count_ == StepLimits::max_planes) break;
      const V normal = basis.transpose() * plane.normal;
      const double length = normal.norm();
      if (!(length > 1e-9)) continue;  // no motion in the scene's space approaches this plane
      planes_[plane_count_++] = {normal / length, plane.bound_m / length, plane.limits};
    }
    flat_count_ = plane_count_;
  }

  // The number of sets. Their indices count through planes (limits, then walls), hard balls and soft balls.
  [[nodiscard]] std::size_t size(bool with_soft) const noexcept {
    return flat_count_ + hard_count_ + (with_soft ? soft_count_ : 0);
  }
  [[nodiscard]] bool is_ball(std::size_t i) const noexcept { return i >= flat_count_; }
  [[nodiscard]] bool is_wall(std::size_t i) const noexcept { return i >= plane_count_ && i < flat_count_; }
  [[nodiscard]] const LimitBall<N>& ball(std::size_t i) const noexcept {
    return i < flat_count_ + hard_count_ ? hard_[i - flat_count_] : soft_[i - flat_count_ - hard_count_];
  }
  // Returns the distance of x from the border of set i; negative if x is inside.
  [[nodiscard]] double violation(std::size_t i, const V& x) const noexcept {
    return is_ball(i) ? (x - ball(i).centre).norm() - ball(i).radius_m : planes_[i].normal.dot(x) - planes_[i].bound_m;
  }

  bool decide(const V& y, bool with_soft, Nearest& result) const noexcept {
    const std::size_t all = size(with_soft);
    result.x = y;
    for (int turn = 0; turn < most_exchanges; ++turn) {
      std::size_t worst = all;
      double most = sweep_tolerance_m;
      for (std::size_t i = 0; i < all; ++i) {
        const double v = violation(i, result.x);
        if (v > most) {
          most = v;
          worst = i;
        }
      }
      if (worst == all) {
        for (std::size_t k = 0; k < result.count; ++k) flag(result.members[k], result.active);
        return true;
      }
      const Nearest before = result;
      if (!exchange(y, before, worst, result)) return false;
      if (!((result.x - y).squaredNorm() > (before.x - y).squaredNorm())) return false;  // only rounding differs
    }
    return false;
  }

  // Finds the point nearest to y that keeps the formerly active sets and the set `added`, with `added` active. Tries
  // small subsets first.
  bool exchange(const V& y, const Nearest& before, std::size_t added, Nearest& result) const noexcept {
    for (std::size_t others = 0; others < N && others <= before.count; ++others) {
      for (unsigned choice = 0; choice < 1u << before.count; ++choice) {
        if (static_cast<std::size_t>(std::popcount(choice)) != others) continue;
        result = {};
        for (std::size_t k = 0; k < before.count; ++k) {
          if ((choice & 1u << k) != 0) result.members[result.count++] = before.members[k];
        }
        result.members[result.count++] = added;
        if (!nearest_of_all(y, result)) continue;
        bool within = true;
        for (std::size_t k = 0; within && k < before.count; ++k) {
          within = (choice & 1u << k) != 0 || violation(before.members[k], result.x) <= sweep_tolerance_m;
        }
        if (within) return true;
      }
    }
    return false;
  }

  // Finds the point nearest to y on the borders of all result.members. Returns false if the borders have no common
  // point, or if some λ < 0: then the intersection of the sets has a point nearer to y.
  bool nearest_of_all(const V& y, Nearest& result) const noexcept {
    // Two spheres meet in a circle. Each ball but the first is replaced by the plane of its circle with the first ball.
    std::array<V, N> e;
    e.fill(V::Zero());
    std::array<double, N> offset{};
    std::size_t flats = 0;
    const LimitBall<N>* sphere = nullptr;
    for (std::size_t k = 0; k < result.count; ++k) {
      const std::size_t i = result.members[k];
      V normal;
      double bound;
      if (!is_ball(i)) {
        normal = planes_[i].normal;
        bound = planes_[i].bound_m;
      } else if (sphere == nullptr) {
        sphere = &ball(i);
        continue;
      } else {
        const LimitBall<N>& other = ball(i);
        normal = other.centre - sphere->centre;
        const double apart = normal.norm();
        if (!(apart > 0.0)) return false;
        normal /= apart;
        const double r0 = sphere->radius_m, r1 = other.radius_m;
        bound = normal.dot(sphere->centre) + 0.5 * (apart + (r0 - r1) * (r0 + r1) / apart);
      }
      if (!orthogonal(normal, bound, e, offset, flats)) return false;
      e[flats] = normal;
      offset[flats++] = bound;
    }
    const auto onto_flats = [&](V x) {
      for (std::size_t k = 0; k < flats; ++k) x += (offset[k] - e[k].dot(x)) * e[k];
      return x;
    };
    result.x = onto_flats(y);
    V outwards = V::Zero();  // the normal of a sphere whose radius is zero
    if (sphere != nullptr) {
      const V centre = onto_flats(sphere->centre);
      const double left2 = sphere->radius_m * sphere->radius_m - (centre - sphere->centre).squaredNorm();
      outwards = result.x - centre;
      const double away = outwards.norm();
      if (!(left2 >= 0.0 && away > 0.0)) return false;
      outwards /= away;
      result.x = centre + std::sqrt(left2) * outwards;
    }
    return presses(y, outwards, result);
  }

  // Makes n orthogonal to all e_k (Gram-Schmidt), and changes b by the equations e_k·x = offset_k so that n·x = b stays
  // true. Returns false if n depends linearly on the e_k.
  static bool orthogonal(V& normal, double& bound, const std::array<V, N>& e, const std::array<double, N>& offset,
                         std::size_t count) noexcept {
    for (std::size_t k = 0; k < count; ++k) {
      const double along = e[k].dot(normal);
      normal -= along * e[k];
      bound -= along * offset[k];
    }
    const double length = normal.norm();
    if (!(count < N && length > parallel)) return false;
    normal /= length;
    bound /= length;
    return true;
  }

  // Solves y − x = Σ λ_i g_i by a QR decomposition of the g_i. Returns false if a λ_i is negative, or if the g_i are
  // linearly dependent.
  bool presses(const V& y, const V& outwards, Nearest& result) const noexcept {
    std::array<std::array<double, N>, N> R{};
    std::array<double, N> lambda{};
    std::array<V, N> normals;
    normals.fill(V::Zero());
    for (std::size_t k = 0; k < result.count; ++k) {
      const std::size_t i = result.members[k];
      V g = planes_[is_ball(i) ? 0 : i].normal;
      if (is_ball(i)) g = ball(i).radius_m > 0.0 ? V((result.x - ball(i).centre).normalized()) : outwards;
      normals[k] = g;
      for (std::size_t j = 0; j < k; ++j) {
        R[j][k] = result.basis[j].dot(g);
        g -= R[j][k] * result.basis[j];
      }
      R[k][k] = g.norm();
      if (!(R[k][k] > parallel)) return false;
      result.basis[k] = g / R[k][k];
    }
    for (std::size_t k = result.count; k-- > 0;) {
      double sum = result.basis[k].dot(y - result.x);
      for (std::size_t j = k + 1; j < result.count; ++j) sum -= R[k][j] * lambda[j];
      lambda[k] = sum / R[k][k];
      if (!(lambda[k] >= 0.0)) return false;
      if (is_ball(result.members[k])) result.bend += lambda[k] / ball(result.members[k]).radius_m;
      if (!is_wall(result.members[k])) result.shift -= lambda[k] * normals[k];
    }
    return true;
  }

  void flag(std::size_t i, ActiveLimits& active) const noexcept {
    if (is_ball(i)) {
      active.set(ball(i).limit);
    } else if (!is_wall(i)) {
      active.add(planes_[i].limits);
    }
  }

  // Projects x onto the sets by Dykstra's alternating projections (Boyle and Dykstra 1986). The hard balls come last in
  // each sweep; even a result that hasn't converged so keeps the last of them. Sets `active` to the sets with a nonzero
  // force. `sweeps`: see nearest().
  V project(V x, bool with_soft, ActiveLimits& active, int& sweeps) const noexcept {
    std::array<V, 2> soft{}, hard{};
    std::array<double, StepLimits::max_planes> pushed{};  // corrections along the planes' normals, ≥ 0
    for (auto* corrections : {&soft, &hard}) corrections->fill(V::Zero());
    for (bool first = true; first || sweeps > 0; first = false, --sweeps) {
      double change = 0.0;
      const auto onto_ball = [&](const LimitBall<N>& ball, V& correction) {
        const V y = x + correction;
        const double length = (y - ball.centre).norm();
        const bool outside = length > ball.radius_m;
        const V z = outside ? V(ball.centre + ball.radius_m / length * (y - ball.centre)) : y;
        correction = outside ? V(y - z) : V(V::Zero());
        change = std::max(change, (z - x).norm());
        x = z;
      };
      for (std::size_t i = 0; with_soft && i < soft_count_; ++i) onto_ball(soft_[i], soft[i]);
      for (std::size_t i = 0; i < plane_count_; ++i) {
        const double beyond = planes_[i].normal.dot(x) + pushed[i] - planes_[i].bound_m;
        const double push = std::max(0.0, beyond);
        if (push == pushed[i]) continue;
        x += (pushed[i] - push) * planes_[i].normal;
        change = std::max(change, std::abs(pushed[i] - push));
        pushed[i] = push;
      }
      for (std::size_t i = 0; i < hard_count_; ++i) onto_ball(hard_[i], hard[i]);
      if (change <= sweep_tolerance_m) break;
    }
    active = {};
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) note(soft_[i], soft[i], active);
    for (std::size_t i = 0; i < hard_count_; ++i) note(hard_[i], hard[i], active);
    for (std::size_t i = 0; i < plane_count_; ++i) {
      if (pushed[i] > 0.0) active.add(planes_[i].limits);
    }
    return x;
  }

  static bool inside(const LimitBall<N>& ball, const V& x, double tolerance_m) noexcept {
    return (x - ball.centre).norm() <= ball.radius_m + tolerance_m;
  }
  // Returns the largest t ≤ 1 with base + t d in the ball, from ‖base − c + t d‖² = r². Precondition: base is in the
  // ball.
  static double way_within(const LimitBall<N>& ball, const V& base, const V& d) noexcept {
    const V from = base - ball.centre;
    const double a = d.squaredNorm(), b = from.dot(d);
    const double c = std::min(0.0, from.squaredNorm() - ball.radius_m * ball.radius_m);
    if (!(a + 2.0 * b + c > 0.0)) return 1.0;
    return std::clamp((std::sqrt(b * b - a * c) - b) / a, 0.0, 1.0);
  }
  static void note(const LimitBall<N>& ball, const V& correction, ActiveLimits& active) noexcept {
    if (correction != V::Zero()) active.set(ball.limit);
  }
  // Returns a ball's intersection with the scene's line or plane through q₁; a ball of radius 0 if they don't meet.
  static LimitBall<N> cut(const LimitBall<3>& ball, const Eigen::Matrix<double, 3, N>& basis) noexcept {
    const V centre = basis.transpose() * ball.centre;
    const double off2 = (ball.centre - basis * centre).squaredNorm();
    if constexpr (N == 3) return {centre, ball.radius_m, ball.limit};
    return {centre, std::sqrt(std::max(0.0, ball.radius_m * ball.radius_m - off2)), ball.limit};
  }

  std::array<LimitBall<N>, 2> soft_{}, hard_{};
  std::array<LimitPlane<N>, StepLimits::max_planes + most_walls> planes_{};  // walls last
  std::size_t soft_count_ = 0, plane_count_ = 0, flat_count_ = 0, hard_count_ = 0;
  FollowableStep* arm_ = nullptr;
  models::Vec3 q_k1_W_ = models::Vec3::Zero();
  Eigen::Matrix<double, 3, N> basis_ = Eigen::Matrix<double, 3, N>::Zero();
};

}  // namespace proxarm::controller
