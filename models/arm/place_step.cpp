#include "models/arm/place_step.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace proxarm::models {
namespace {

// λ² is sought by factors of `rung`, and then between two of them by halving its exponent: to 8^(2⁻²⁰), 2e-6 of itself.
constexpr double rung = 8.0;
constexpr int most_rungs = 40, halvings = 20;

// Written so that NaN, from a singular A, is outside.
bool between(const JointVector& d, const JointVector& low, const JointVector& high) noexcept {
  return (d.array() >= low.array()).all() && (d.array() <= high.array()).all();
}

class Turning {
 public:
  Turning(const Jacobian& J_W, const Vec<6>& e, const StepRoom& room) noexcept : room_(room) {
    const Jacobian JD = J_W * room.most_rad.asDiagonal();
    const SmallColumns3 At = JD.topRows<3>().transpose(), Bt = JD.bottomRows<3>().transpose();
    const SmallColumns3 inverse = At * Mat3(At.transpose() * At).inverse();
    y0_ = inverse * Vec3(e.head<3>() - J_W.topRows<3>() * room.brakes_rad);
    C_ = Bt - inverse * Mat3(At.transpose() * Bt);
    left_ = e.tail<3>() - J_W.bottomRows<3>() * room.brakes_rad - Bt.transpose() * y0_;
    squared_ = C_.transpose() * C_;
    place_ = step(y0_);
    low_ = room.eased_low_rad.cwiseMin(place_).cwiseMax(room.low_rad);
    high_ = room.eased_high_rad.cwiseMax(place_).cwiseMin(room.high_rad);
  }

  [[nodiscard]] const JointVector& place() const noexcept { return place_; }
  [[nodiscard]] bool allows(const JointVector& d) const noexcept { return between(d, low_, high_); }
  [[nodiscard]] double scale() const noexcept { return squared_.trace(); }
  [[nodiscard]] JointVector damped(double lambda2) const noexcept {
    return step(y0_ + C_ * Vec3(Mat3(squared_ + lambda2 * Mat3::Identity()).inverse() * left_));
  }

 private:
  [[nodiscard]] JointVector step(const JointVector& y) const noexcept {
    return room_.brakes_rad + room_.most_rad.cwiseProduct(y);
  }

  const StepRoom& room_;
  JointVector y0_, place_, low_, high_;
  SmallColumns3 C_;
  Mat3 squared_;
  Vec3 left_;
};

}  // namespace

bool StepRoom::allows(const JointVector& step_rad) const noexcept {
  return between(step_rad, low_rad, high_rad) && between(step_rad, eased_low_rad, eased_high_rad);
}

bool place_step(const Jacobian& J_W, const Vec<6>& e, const StepRoom& room, JointVector& step_rad) noexcept {
  const Turning turning(J_W, e, room);
  if (!turning.place().allFinite() || !turning.allows(turning.place())) return false;
  double within = turning.scale(), beyond = within;
  for (int i = 0; i < most_rungs && !turning.allows(turning.damped(within)); ++i) within *= rung;
  for (int i = 0; i < most_rungs && turning.allows(turning.damped(beyond)); ++i) beyond /= rung;
  step_rad = turning.damped(within);
  if (!turning.allows(step_rad)) step_rad = turning.place();
  for (int i = 0; i < halvings && within > beyond; ++i) {
    const double lambda2 = std::sqrt(within * beyond);
    const JointVector d = turning.damped(lambda2);
    if (turning.allows(d)) {
      within = lambda2;
      step_rad = d;
    } else {
      beyond = lambda2;
    }
  }
  return true;
}

}  // namespace proxarm::models
