// Renders guides (virtual fixtures): a line, plane or polyline holds the proxy from both sides, with friction along it.
//
// A line with direction e exerts any force across e, and friction along e. In units where K = 1:
//   r = q if |eᵀ(p − q)| ≤ μ ‖f_⟂‖,  else eᵀ(r − p) = ∓ μ ‖f_⟂‖,   f = r − p.
// This is (4) with the distance from the line as penetration. If q is beside the guide, it first moves to the nearest
// point of the guide.
//
// If an object has moved over q, it first pushes the proxy along the line or polyline:
// 1. The object's normal n gives the direction of the push: d = ±e with nᵀd > 0.
// 2. q' is the next point of the guide in this direction that is outside the object.
// 3. q' replaces q. Then (4) and the stops at objects work as with resting objects.
// 4. So the object exerts a force F ≥ 0 along d, and F > 0 only in contact: r = q' if dᵀ(p − q') ≤ μ ‖f_⟂‖.
// 5. q' depends neither on p nor on K, so Assumption 1 holds.
//
// The proxy is squeezed() if no q' exists within ten times the object's motion at q: the object moves nearly across the
// guide, the guide ends, or another object blocks the path.
//
// Among objects, a plane guide is a World with two half-spaces back to back (scenes/compiler/compile.cpp).
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"
#include "models/world/world.hpp"

namespace proxarm::models {

// A plane that holds the proxy from both sides.
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

// A guide of straight pieces, open or closed. A line is one piece with infinite ends. At a corner the proxy stays
// unless one of the two neighbouring pieces leads it away.
class PolylineGuide final : public GeometricAlgorithm<3> {
 public:
  // Throws std::invalid_argument if there are fewer than two points, if neighbouring points are equal, or if the
  // friction isn't finite or is negative.
  PolylineGuide(const std::vector<Vec3>& points_m, bool closed, double friction);
  // Returns a guide along an infinite line.
  static PolylineGuide line(const Vec3& point_m, const Vec3& direction, double friction);

  // Lets resting objects stop the proxy on its path along the guide. The friction and the slope of these objects don't
  // matter, because guide and object together can exert any force along the guide. Contacts report the guide as object
  // `index`.
  void stop_at(std::shared_ptr<World> objects, std::int32_t index) noexcept {
    objects_ = std::move(objects);
    contacts_[0].object = index;
  }
  // Lets moving objects stop the proxy and push it along the guide. Precondition: these objects have no friction and
  // aren't meshes.
  void be_pushed_by(std::vector<World::Entry> movers) {
    movers_ = std::make_shared<std::vector<World::Entry>>(std::move(movers));
    pushes_.assign(movers_->size(), 0);
  }

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return movers_ != nullptr; }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }
  // Returns the contact with the guide and, if an object stops the proxy, as second the contact with this object.
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

 private:
  struct Piece {
    Vec3 a;         // the point where the piece begins
    Vec3 e;         // unit
    double length;  // infinite for a line
    double begin;   // 0; minus infinity for a line
  };
  // A point on the guide.
  struct Place {
    std::size_t piece = 0;
    double s = 0.0;  // distance from the piece's start, m
    Vec3 x = Vec3::Zero();
  };
  struct Lead {
    double to = 0.0;  // distance from the piece's start, m; may be beyond the ends of the piece
    int side = 0;     // 1: forward, −1: backward, 0: the proxy sticks
  };
  PolylineGuide() = default;
  [[nodiscard]] std::size_t nearest_piece(const Vec3& q) const noexcept;
  [[nodiscard]] bool next_piece(std::size_t& piece, bool forward) const noexcept;
  [[nodiscard]] Place advance(Place at, double by) const noexcept;
  [[nodiscard]] bool clear_of(const Obstacle& object, const Vec3& carried, int side, double most,
                              Place& place) const noexcept;
  [[nodiscard]] int pushed_to(const Obstacle& object, const Vec3& carried, const Vec3& q, std::size_t piece,
                              Contact<3>& contact) const noexcept;
  [[nodiscard]] bool reaches(Place from, const Place& to, int side) noexcept;
  bool carry(const Vec3& q, Place& place) noexcept;
  [[nodiscard]] Lead lead(const Piece& piece, const Vec3& p, double from) const noexcept;
  Vec3 slide(const Vec3& p, const Place& place) noexcept;
  Vec3 report(const Vec3& r, const Vec3& p, std::size_t piece, bool slips) noexcept;
  bool leads(const Vec3& from, Vec3& to, bool past_pushing = false) noexcept;

  std::vector<Piece> pieces_;
  bool closed_ = false;
  double mu_ = 0.0;
  std::size_t last_ = 0;            // the piece on which the last step ended
  std::shared_ptr<World> objects_;  // resting objects; null: no objects
  std::shared_ptr<std::vector<World::Entry>> movers_;
  std::vector<char> pushes_;  // for each moving object: 1 if it pushes in this step
  std::uint64_t unresolved_ = 0;
  bool squeezed_ = false;
  std::array<Contact<3>, 2> contacts_;
  std::size_t count_ = 1;
};

}  // namespace proxarm::models
