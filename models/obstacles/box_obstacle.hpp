// A solid box as an obstacle.
//
// The face through which the straight path enters holds the proxy by (4). Beyond the edge of this face the proxy is
// free again, so it can go around the box. Friction can make the step on the face end beyond an edge although p isn't
// beyond this edge. Then this edge holds the proxy (edge_contact.hpp).
#pragma once

#include <array>

#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

class BoxObstacle final : public Obstacle {
 public:
  // `size_m`: the full lengths of the edges; a plate may be as thin as 10 µm. `X`: the pose of the box in W. Throws
  // std::invalid_argument if a size isn't finite and positive, or if the friction isn't finite or is negative.
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

  // Returns the six faces. Faces 2 k and 2 k + 1 have normals along +axis k and −axis k. Boxes seen from inside use
  // this function too.
  static std::array<FlatSurface<3>, 6> faces(const Pose& X, const Vec3& size_m);

 private:
  struct Crossing;  // where the straight way from q to p crosses the box
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
