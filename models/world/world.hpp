// Renders a world of any number of obstacles.
//
// A step is solved as follows:
// 1. Each obstacle near the step is solved alone. If all other obstacles allow the resulting point, it is the solution.
// 2. Otherwise pairs and triples of contacts are solved on tangent planes, as in a PlaneComposition
//    (contact_search.hpp).
// 3. For curved surfaces, step 2 is repeated with the tangent planes at each new point until it settles (settling.hpp).
// 4. Smaller complete sets have priority. Among complete sets of one size, the set with the smallest ‖r − p‖ is taken.
//
// If five or more objects press at one place, World::choose finds the objects that would hold the proxy without
// friction. These are tried first, then other sets, up to most_attempts sets in a step. So a step among a thousand
// objects costs little more than a step among ten. If the step has no solution after most_attempts, it counts as
// unresolved.
//
// If an elastic layer presses together with other obstacles, all obstacles that press share the force
// (shared_support.hpp).
//
// If q and p are both within the last known clearance, the step touches nothing and none of this is done.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/bounds_tree.hpp"
#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/contact_search.hpp"

namespace proxarm::models {

class World final : public GeometricAlgorithm<3> {
 public:
  // An obstacle, and the numbers that its contacts report. Several obstacles may be one object: a box seen from inside
  // is six obstacles.
  struct Entry {
    std::unique_ptr<Obstacle> obstacle;
    std::int32_t object = 0;
    std::int32_t feature = -1;  // feature that contacts report; -1: they report the obstacle's feature
  };
  explicit World(std::vector<Entry> entries);

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return !moving_.empty(); }
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override {
    return {are_shared_ ? shared_.data() : contacts_.data(), count_};
  }

  // Returns the signed distance from x to the nearest obstacle, metres; infinite in an empty world.
  [[nodiscard]] double distance(const Vec3& x) const noexcept;

  // Finds how far a point gets along the straight path from x to y before an obstacle stops it. For a proxy that can't
  // take another path, as on a guide. Precondition: no obstacle excludes x.
  struct Sweep {
    Vec3 end;
    bool stopped = false;
    Contact<3> contact;  // the contact with the obstacle that stopped the point
  };
  [[nodiscard]] Sweep sweep(const Vec3& x, const Vec3& y) noexcept;

  // Returns the number of steps so far in which no set of contacts was complete, because of a jam or because the tool
  // was deeper than a curved surface's radius. In these steps the proxy goes as far as a shorter step leads, or stays.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }

 private:
  // The obstacles that may be part of the solution, and the step of each obstacle alone. Typical steps have one to
  // three candidates. Candidates beyond the twelfth are dropped; if no set of the twelve is complete, the step counts
  // as unresolved.
  struct Candidates {
    static constexpr std::size_t most = 12;
    std::array<std::size_t, most> index{};
    std::array<Obstacle::Step, most> alone{};
    std::size_t count = 0;
    bool grew = false;
    // If true, a point beyond an object is allowed if the proxy can go around the object; see gets_around().
    bool around = false;

    void clear() noexcept {
      count = 0;
      grew = around = false;
    }
    [[nodiscard]] bool has(std::size_t i) const noexcept;
    void add(std::size_t i, const Obstacle::Step& step) noexcept;
  };
  struct Choice;

  // An obstacle that would hold the proxy if it were alone.
  struct Pressed {
    std::size_t index = 0;
    Obstacle::Step step;
  };

  double gather(const Vec3& p, const Vec3& q, double reach) noexcept;
  void add_candidates(double K, const Vec3& p, const Vec3& q, Candidates& candidates) noexcept;
  void choose(double K, const Vec3& p, const Vec3& q) noexcept;
  bool add_those_at(double K, const Vec3& p, const Vec3& q, const Vec3& r) noexcept;
  [[nodiscard]] bool may_try() noexcept { return attempts_left_-- > 0; }
  static void add_face(std::size_t i, const Obstacle::Step& step, Candidates& candidates) noexcept;
  [[nodiscard]] bool is_free(const Vec3& q, const Vec3& r) const noexcept;
  bool fits(const Vec3& q, const Vec3& r, std::span<const std::size_t> contacts, Candidates& candidates, double K,
            const Vec3& p) const noexcept;
  [[nodiscard]] bool all_touch(const Vec3& r, std::span<const std::size_t> contacts) const noexcept;
  [[nodiscard]] bool gets_around(const Obstacle& obstacle, const Vec3& p, const Vec3& q, const Vec3& r) const noexcept;
  StepResult try_singles(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) const noexcept;
  [[nodiscard]] Contact<3> contact_of(const Candidates& candidates, std::size_t candidate, bool slips,
                                      const Vec3& normal) const noexcept;
  void try_pair(double K, const Vec3& p, const Vec3& q, std::array<std::size_t, 2> own, Candidates& candidates,
                Choice& choice) noexcept;
  void try_triple(double K, const Vec3& p, const Vec3& q, const std::array<std::size_t, 3>& own, Candidates& candidates,
                  Choice& choice) noexcept;
  bool try_likely(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept;
  void try_together(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept;
  bool search(double K, const Vec3& p, const Vec3& q, Candidates& candidates, Choice& choice) noexcept;

  bool solve(double K, const Vec3& p, const Vec3& q, Choice& choice) noexcept;
  void stay(const Vec3& p, const Vec3& q, const Candidates& candidates, Choice& choice) const noexcept;

  std::vector<Entry> entries_;
  std::vector<std::size_t> unbounded_;  // obstacles without finite bounds
  std::vector<std::size_t> moving_;     // moving obstacles, with or without finite bounds
  BoundsTree tree_;                     // all resting obstacles with finite bounds
  std::vector<bool> elastic_;           // for each obstacle: whether it has an elastic layer
  bool soft_ = false;                   // whether any obstacle has an elastic layer
  // The obstacles that a step may meet. First come the resting obstacles within near_radius_ of near_centre_, which are
  // gathered again only when a step leaves that ball. Then come the moving obstacles that are near in this step.
  std::vector<std::size_t> near_;
  std::size_t near_fixed_ = 0;
  Vec3 near_centre_ = Vec3::Zero();
  double near_radius_ = -1.0;
  Candidates candidates_;  // a member, so that a step needn't initialise the whole arrays
  std::array<Contact<3>, 3> contacts_{};
  std::array<Contact<3>, Candidates::most> shared_{};  // used instead of contacts_ if elastic layers share the force
  bool are_shared_ = false;
  std::vector<Pressed> pressed_;         // the obstacles that press in this step; memory is reserved for all obstacles
  std::array<std::size_t, 3> likely_{};  // obstacles of a crowd that would hold the proxy without friction
  std::size_t likely_count_ = 0;
  int attempts_left_ = 0;   // pairs and triples that this step may still try
  int support_budget_ = 0;  // the budget that SharedSupport may still use in this step
  std::size_t count_ = 0;
  std::uint64_t unresolved_ = 0;
  bool squeezed_ = false;
  // No obstacle is closer than clearance_ (m) to clear_at_. Used only in worlds without moving obstacles.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
};

}  // namespace proxarm::models
