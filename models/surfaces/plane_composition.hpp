// Renders several flat surfaces at once, with friction on each: corners, grooves, wedges, boxes seen from inside.
//
// The free space in front of all faces is convex. The solution of a step is a set of at most three contacts and the
// point that these contacts hold. The search (contact_search.hpp) tries sets until one set is complete: no contact
// pulls, the proxy penetrates no face, and each contact's friction obeys (17). Smaller sets are tried first. Among sets
// of one size, the set with the smallest ‖r − p‖ is chosen; this rule also chooses if Coulomb's law has several
// solutions (grooves sharper than 2 atan μ can jam).
//   one contact     (4), exactly
//   two contacts    solve_groove
//   three contacts  the corner itself, if the sum of the three friction cones contains the force
// K doesn't appear, and the result doesn't depend on earlier steps.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/contact_search.hpp"
#include "models/surfaces/corner.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/groove.hpp"

namespace proxarm::models {

class PlaneComposition final : public GeometricAlgorithm<3> {
 public:
  // The faces become objects 0, 1, … in this order. Throws std::invalid_argument if a μ isn't finite or is negative.
  explicit PlaneComposition(std::vector<Face> faces);

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Returns the number of steps so far in which no set of contacts was complete, so that friction was left out. This
  // number is zero unless faces meet at an angle of less than 2 atan μ.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return without_friction_; }

  // Sets the friction of all faces of an object, from the next step on. Precondition: `friction` is finite and not
  // negative.
  void set_friction(std::int32_t object, double friction) noexcept {
    for (Face& face : faces_) {
      if (face.object == object) face.mu = friction;
    }
  }

 private:
  struct Candidates;
  struct Choice;

  [[nodiscard]] double friction(std::size_t face, const Candidates& candidates) const noexcept;
  bool fits(const Vec3& q, const Vec3& r, const std::array<std::size_t, 3>& contacts, bool creeps,
            Candidates& candidates) const noexcept;
  StepResult try_singles(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  StepResult try_pairs(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  StepResult try_corners(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  bool search(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;

  std::vector<Face> faces_;
  // The lines of all pairs, at i · n + j; empty if the faces are too many for this table.
  std::vector<GrooveLine> lines_;
  // The corners of all triples, at (i · n + j) · n + k; empty if the faces are too many for this table.
  std::vector<CornerPoint> corners_;
  std::array<Contact<3>, 3> contacts_{};
  std::size_t count_ = 0;
  std::uint64_t without_friction_ = 0;
};

}  // namespace proxarm::models
