// The interface of an object in a World.
//
// A World asks each obstacle near the step for its step alone, and combines those that matter by their tangent planes.
// New kinds of objects implement this interface, as meshes and moving objects do.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

// An axis-aligned box in W, metres. Infinite for infinite objects: planes, and solids around a cavity.
struct Bounds {
  Vec3 low = Vec3::Constant(-std::numeric_limits<double>::infinity());
  Vec3 high = Vec3::Constant(std::numeric_limits<double>::infinity());

  [[nodiscard]] bool finite() const noexcept { return low.allFinite() && high.allFinite(); }
};

class Obstacle {
 public:
  // The step if this object were alone: r = p and touches = false if the proxy reaches p without contact.
  struct Step {
    Vec3 r = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  // unit, out of the object
    std::int32_t feature = 0;    // face, edge or region; an argument of tangent()
    bool touches = false;
    bool slips = false;
    bool resolved = true;  // false: no set of the object's contacts was complete (a mesh has many)
  };

  // The object's surface as seen from a proxy at r.
  struct Tangent {
    FlatSurface<3> surface;
    double mu = 0.0;
  };

  Obstacle() = default;
  Obstacle(const Obstacle&) = default;
  Obstacle& operator=(const Obstacle&) = default;
  virtual ~Obstacle() = default;

  // 𝒢 of this object alone, for stiffness K. It obeys (17) exactly: the force is K (r − p), and friction acts against N
  // Nᵀ (r − q), with the normal at r. Precondition: K > 0, p and q are finite. None of these functions allocates or
  // locks.
  [[nodiscard]] virtual Step step(double K, const Vec3& p, const Vec3& q) const noexcept = 0;

  // Writes the contacts of step(K, p, q), which has returned `s`, and returns their number: one, unless the object has
  // several surfaces. The caller fills in `object`.
  [[nodiscard]] virtual std::size_t contacts(double /*K*/, const Vec3& /*p*/, const Vec3& /*q*/, const Step& s,
                                             std::array<Contact<3>, 3>& out) const noexcept {
    out[0] = {0, s.feature, s.slips, s.normal};
    return 1;
  }

  // The elastic layer ({}: no layer).
  [[nodiscard]] virtual Layer layer() const noexcept { return {}; }
  [[nodiscard]] virtual bool presses_at(const Vec3& /*r*/) const noexcept { return false; }

  // True if a proxy that comes from q can't end at r: r is inside by more than rounding, or beyond a thin object.
  [[nodiscard]] virtual bool excludes(const Vec3& q, const Vec3& r) const noexcept = 0;

  // Whether the straight way from x to y enters the object by more than rounding. Precondition: the proxy may be at x.
  [[nodiscard]] virtual bool bars(const Vec3& x, const Vec3& y) const noexcept = 0;

  // The point at which a proxy that goes around the object leaves its surface, on the way from q to p; q if there is
  // none. A proxy goes around if step() doesn't touch although the straight way passes through the inside.
  [[nodiscard]] virtual Vec3 detour(const Vec3& /*p*/, const Vec3& q) const noexcept { return q; }

  // The tangent plane at the surface point nearest to r; `feature` is the one that step() returned.
  [[nodiscard]] virtual Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept = 0;

  // Signed distance (m): negative inside, exact outside up to rounding. A mesh has no inside, so its distance is never
  // negative.
  [[nodiscard]] virtual double distance(const Vec3& x) const noexcept = 0;

  [[nodiscard]] virtual Bounds bounds() const noexcept = 0;

  // The point to which the object's motion in this step carries q; q itself if the object stands still.
  [[nodiscard]] virtual Vec3 carry(const Vec3& q) const noexcept { return q; }

  [[nodiscard]] virtual bool moves() const noexcept { return false; }

  // False only if the whole object is farther than `reach` (finite) from x.
  [[nodiscard]] virtual bool comes_within(const Vec3& x, double reach) const noexcept { return distance(x) <= reach; }

  // For a surface without an inside (a mesh): whether it lies between two points. If so, `normal` becomes its normal
  // there, towards x.
  virtual bool parts(const Vec3& /*x*/, const Vec3& /*y*/, Vec3& /*normal*/) const noexcept { return false; }

  // For the object of a MovingObstacle: sets the size (m) of coordinates in W, which bounds the rounding of points on
  // their way to the object's frame.
  virtual void set_rounding_size(double /*size_m*/) noexcept {}

  // Takes effect with the next step. Precondition: finite and not negative.
  virtual void set_friction(double friction) noexcept = 0;

  virtual void set_time(double /*time_s*/, double /*period_s*/) noexcept {}
};

}  // namespace proxarm::models
