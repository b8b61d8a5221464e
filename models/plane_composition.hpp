// Several flat surfaces at once: corners, grooves, wedges, boxes seen from inside, with friction on each side.
//
// The free side of all of them is convex. A step's solution is a set of at most three contacts and the point that they
// hold; all sets are tried and the first is taken that is complete: nothing pulls, nothing is penetrated, friction as
// (17) for each contact. Fewest contacts first, then the smallest ‖q − p‖; where Coulomb's law has several solutions
// (grooves sharper than 2 atan μ can jam) this chooses, and `contacts` are those chosen.
//   one contact     (4), exactly
//   two             solve_groove
//   three           the corner itself, if the three friction cones together can bear the force
// Nothing here depends on K, and the result not on what was asked before.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "models/corner.hpp"
#include "models/friction_plane.hpp"
#include "models/geometric_algorithm.hpp"
#include "models/groove.hpp"

namespace proxarm::models {

class PlaneComposition final : public GeometricAlgorithm<3> {
 public:
  // Faces as objects 0, 1, … in this order. Throws std::invalid_argument for a μ that isn't finite and ≥ 0.
  explicit PlaneComposition(std::vector<Face> faces);

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override { return {contacts_.data(), count_}; }

  // Steps so far in which no set of contacts was complete and friction was left out. Zero unless faces meet at less
  // than 2 atan μ.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return without_friction_; }

  // Of all faces of an object, from the next step on; finite and not negative.
  void set_friction(std::int32_t object, double friction) noexcept {
    for (Face& face : faces_) {
      if (face.object == object) face.mu = friction;
    }
  }

 private:
  struct Candidates;
  struct Choice;

  bool fits(const Vec3& q, const Vec3& r, std::size_t i, std::size_t j, std::size_t k, bool creeps,
            Candidates& candidates) const noexcept;
  void try_singles(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  void try_pairs(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  void try_corners(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  bool search(const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;

  std::vector<Face> faces_;
  std::vector<GrooveLine> lines_;     // of all pairs, i · n + j, where there are few faces; else made when needed
  std::vector<CornerPoint> corners_;  // of all triples, likewise
  std::array<Contact<3>, 3> contacts_{};
  std::size_t count_ = 0;
  std::uint64_t without_friction_ = 0;
};

}  // namespace proxarm::models
