// A solid cylinder with flat ends as an obstacle.
//
// It works like a box: the side or end through which the path enters holds the proxy, and beyond the rim the proxy is
// free. Friction can make the step on the side or end finish beyond the rim although p isn't beyond it. Then the rim
// holds the proxy (edge_contact.hpp).
#pragma once

#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"

namespace proxarm::models {

class CylinderObstacle final : public Obstacle {
 public:
  // `from_m` and `to_m` are the centres of the two ends. Throws std::invalid_argument if these centres coincide, or if
  // the radius or the friction isn't finite or is negative.
  CylinderObstacle(const Vec3& from_m, const Vec3& to_m, double radius_m, double friction, const Layer& layer = {});

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override;
  [[nodiscard]] Layer layer() const noexcept override { return end_[0].layer(); }
  [[nodiscard]] bool presses_at(const Vec3& r) const noexcept override {
    return depth_ > 0.0 && distance(r) < -2.0 * rounding(r);
  }
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override;
  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override;
  [[nodiscard]] Vec3 detour(const Vec3& p, const Vec3& q) const noexcept override;
  [[nodiscard]] Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept override;
  [[nodiscard]] double distance(const Vec3& x) const noexcept override;
  [[nodiscard]] Bounds bounds() const noexcept override;
  void set_friction(double friction) noexcept override {
    side_.set_friction(friction);
    for (PlaneObstacle& end : end_) end.set_friction(friction);
  }

 private:
  enum Feature : std::int32_t { side = 0, far_end = 1, near_end = 2 };
  struct Crossing;

  [[nodiscard]] Crossing cross(const Vec3& q, const Vec3& p) const noexcept;
  [[nodiscard]] Step beside_face(std::int32_t feature, const Step& s, double K, const Vec3& p,
                                 const Vec3& q) const noexcept;
  [[nodiscard]] double along(const Vec3& x) const noexcept { return e_.dot(x - middle_); }
  [[nodiscard]] Vec3 radial(const Vec3& x) const noexcept { return (x - middle_) - e_ * along(x); }
  [[nodiscard]] double rounding(const Vec3& x) const noexcept;

  Vec3 middle_;
  Vec3 e_;
  double half_;
  double R_;
  double depth_;  // the layer's thickness, m
  RoundBar side_;
  PlaneObstacle end_[2];  // far_end, near_end
};

}  // namespace proxarm::models
