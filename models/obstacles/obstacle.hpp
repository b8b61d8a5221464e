// The interface of an object in a World.
//
// A World asks each obstacle near the step for the step that this obstacle alone would make. It combines the obstacles
// that affect the step by their tangent planes. New kinds of objects implement this interface; meshes and moving
// objects are examples.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"
#include "models/surfaces/layer.hpp"

namespace proxarm::models {

// An axis-aligned box in W, metres. It is infinite for infinite objects: planes, and solids around a cavity.
struct Bounds {
  Vec3 low = Vec3::Constant(-std::numeric_limits<double>::infinity());
  Vec3 high = Vec3::Constant(std::numeric_limits<double>::infinity());

  [[nodiscard]] bool finite() const noexcept { return low.allFinite() && high.allFinite(); }
};

class Obstacle {
 public:
  // The step that the proxy makes if this object is alone. If the proxy reaches p without contact, r = p and touches =
  // false.
  struct Step {
    Vec3 r = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  // unit, out of the object
    std::int32_t feature = 0;    // face, edge or region; tangent() takes it as an argument
    bool touches = false;
    bool slips = false;
    // false if no set of the object's contacts was complete. Only an object with several surfaces (a mesh) can return
    // false.
    bool resolved = true;
  };

  // The object's surface as a plane, for a proxy at r.
  struct Tangent {
    FlatSurface<3> surface;
    double mu = 0.0;
  };

  Obstacle() = default;
  Obstacle(const Obstacle&) = default;
  Obstacle& operator=(const Obstacle&) = default;
  virtual ~Obstacle() = default;

  // Returns the step by the 𝒢 of this object alone, for stiffness K. The step obeys (17) exactly: the force is K (r −
  // p), and friction acts against N Nᵀ (r − q), with the normal at r. Precondition: K > 0; p and q are finite. No
  // function of this class allocates or locks.
  [[nodiscard]] virtual Step step(double K, const Vec3& p, const Vec3& q) const noexcept = 0;

  // Writes the contacts of step(K, p, q), which has returned `s`, and returns their number. The number is one unless
  // the object has several surfaces. The caller fills in Contact::object.
  [[nodiscard]] virtual std::size_t contacts(double /*K*/, const Vec3& /*p*/, const Vec3& /*q*/, const Step& s,
                                             std::array<Contact<3>, 3>& out) const noexcept {
    out[0] = {0, s.feature, s.slips, s.normal};
    return 1;
  }

  // Returns the elastic layer, or {} if the object has no layer.
  [[nodiscard]] virtual Layer layer() const noexcept { return {}; }
  [[nodiscard]] virtual bool presses_at(const Vec3& /*r*/) const noexcept { return false; }

  // Whether a proxy that comes from q can't end at r, because r is inside the object by more than rounding, or because
  // r is beyond a thin object.
  [[nodiscard]] virtual bool excludes(const Vec3& q, const Vec3& r) const noexcept = 0;

  // Whether the straight path from x to y enters the object by more than rounding. Precondition: x is a point where the
  // proxy may be.
  [[nodiscard]] virtual bool bars(const Vec3& x, const Vec3& y) const noexcept = 0;

  // Returns the point at which a proxy that goes from q around the object to p leaves the object's surface. Returns q
  // if the proxy doesn't go around. The proxy goes around if step() returns no contact although the straight path
  // passes through the object.
  [[nodiscard]] virtual Vec3 detour(const Vec3& /*p*/, const Vec3& q) const noexcept { return q; }

  // Returns the tangent plane at the surface point nearest to r. `feature` is the feature that step() returned.
  [[nodiscard]] virtual Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept = 0;

  // Returns the signed distance (m) from x to the surface: negative inside, exact outside up to rounding. A mesh has no
  // inside, so the distance to a mesh is never negative.
  [[nodiscard]] virtual double distance(const Vec3& x) const noexcept = 0;

  [[nodiscard]] virtual Bounds bounds() const noexcept = 0;

  // Returns the point to which the object's motion in this step carries q, or q itself if the object stands still.
  [[nodiscard]] virtual Vec3 carry(const Vec3& q) const noexcept { return q; }

  [[nodiscard]] virtual bool moves() const noexcept { return false; }

  // Returns false only if the whole object is farther than `reach` (finite) from x.
  [[nodiscard]] virtual bool comes_within(const Vec3& x, double reach) const noexcept { return distance(x) <= reach; }

  // Whether a surface without an inside (a mesh) lies between the points x and y. If so, `normal` becomes the surface's
  // normal between them, on the side of x.
  virtual bool parts(const Vec3& /*x*/, const Vec3& /*y*/, Vec3& /*normal*/) const noexcept { return false; }

  // Sets the size (m) of the coordinates in W, which determines the rounding of points that are transformed from W to
  // the object's frame. A MovingObstacle calls this for its object.
  virtual void set_rounding_size(double /*size_m*/) noexcept {}

  // Sets the friction from the next step on. Precondition: `friction` is finite and not negative.
  virtual void set_friction(double friction) noexcept = 0;

  virtual void set_time(double /*time_s*/, double /*period_s*/) noexcept {}
};

}  // namespace proxarm::models
