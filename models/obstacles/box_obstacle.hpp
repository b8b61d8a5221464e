// A solid box.
//
// The proxy is held by the face through which its straight way enters, and slides on it by (4). Beyond the face's edge
// it is free again: the space around a box isn't convex, so the proxy goes around the box. Where friction would hold a
// proxy beside the entered face, beyond an edge that p isn't beyond, that edge holds it (edge_contact.hpp).
#pragma once

#include <array>

#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

class BoxObstacle final : public Obstacle {
 public:
  // size_m: full edge lengths, finite and positive (10 µm will do for a plate). X: of the box in W.
  // Throws std::invalid_argument otherwise, and for a friction that isn't finite and ≥ 0.
  BoxObstacle(const Pose& X, const Vec3& size_m, double friction, const Layer& layer = {});

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override;
  [[nodiscard]] Layer layer() const noexcept override { return layer_; }
  [[nodiscard]] bool presses_at(const Vec3& r) const noexcept override {
    return layer_.soft() && distance(r) < -2.0 * rounding(r);
  }
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override;
  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override;
  [[nodiscard]] Vec3 detour(const Vec3& p, const Vec3& q) const noexcept override;
  [[nodiscard]] Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept override;
  [[nodiscard]] double distance(const Vec3& x) const noexcept override;
  [[nodiscard]] Bounds bounds() const noexcept override;
  void set_friction(double friction) noexcept override { mu_ = friction; }

  // Faces 2 k and 2 k + 1: along +axis k and −axis k. Shared with boxes from inside.
  static std::array<FlatSurface<3>, 6> faces(const Pose& X, const Vec3& size_m);

 private:
  struct Crossing;  // of the straight way from q to p with the box
  [[nodiscard]] Crossing cross(const Vec3& q, const Vec3& p) const noexcept;
  [[nodiscard]] Step beside_face(std::int32_t face, double K, const Vec3& p, const Vec3& q) const noexcept;
  [[nodiscard]] Vec3 local(const Vec3& x) const noexcept { return axes_.transpose() * (x - centre_); }
  [[nodiscard]] double rounding(const Vec3& x) const noexcept;

  Vec3 centre_;
  Mat3 axes_;
  Vec3 half_;
  double mu_;
  Layer layer_;
  std::array<FlatSurface<3>, 6> faces_;
};

}  // namespace proxarm::models
