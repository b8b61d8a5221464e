// Guides (virtual fixtures): the proxy is held on a line, a plane or a polyline, from both sides, with friction along
// it.
//
// On a line with direction e, in units where K = 1: f = r − p has any part across e, and along it
//   r = q if |eᵀ(p − q)| ≤ μ ‖f_⟂‖,  else eᵀ(r − p) = ∓ μ ‖f_⟂‖,
// which is (4) with the distance from the line in the place of the penetration. q is taken to its nearest point first.
//
// A plane among objects is two half-spaces back to back (scenes/compile.cpp): a World solves it with them.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "models/flat_surface.hpp"
#include "models/geometric_algorithm.hpp"
#include "models/world.hpp"

namespace proxarm::models {

// Both sides of a plane.
class PlaneGuide final : public GeometricAlgorithm<3> {
 public:
  PlaneGuide(const Vec3& point_m, const Vec3& normal, double friction);
  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {&contact_, 1}; }

 private:
  FlatSurface<3> surface_;
  double mu_;
  Contact<3> contact_;
};

// A chain of straight pieces, open or closed; one piece with endless ends is a line. At a corner the proxy stays while
// neither piece leads it away.
class PolylineGuide final : public GeometricAlgorithm<3> {
 public:
  // At least two points, neighbours apart from each other. Throws std::invalid_argument otherwise, and for a friction
  // that isn't finite and ≥ 0.
  PolylineGuide(const std::vector<Vec3>& points_m, bool closed, double friction);
  // An endless line.
  static PolylineGuide line(const Vec3& point_m, const Vec3& direction, double friction);

  // Objects that stand still stop the proxy on its way along the guide, which has no other way to go: whatever their
  // friction and however they lean, what they and the guide can bear together holds it there. `index`: of the guide in
  // contacts.
  void stop_at(std::shared_ptr<World> objects, std::int32_t index) noexcept {
    objects_ = std::move(objects);
    contacts_[0].object = index;
  }

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }
  // The guide's, and that with what stops the proxy.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

 private:
  struct Piece {
    Vec3 a;         // its beginning
    Vec3 e;         // unit
    double length;  // infinite for a line
    double begin;   // 0, or minus infinity
  };
  PolylineGuide() = default;
  [[nodiscard]] std::size_t nearest_piece(const Vec3& q) const noexcept;
  Vec3 report(const Vec3& r, const Vec3& p, std::size_t piece, bool slips) noexcept;
  bool leads(const Vec3& from, Vec3& to) noexcept;

  std::vector<Piece> pieces_;
  bool closed_ = false;
  double mu_ = 0.0;
  std::size_t last_ = 0;            // where the proxy was: where the search begins
  std::shared_ptr<World> objects_;  // none: an empty world
  std::array<Contact<3>, 2> contacts_;
  std::size_t count_ = 1;
};

}  // namespace proxarm::models
