// A world of any number of obstacles.
//
// Each obstacle near the step is asked for its step alone. If all others allow that point, it is the solution.
// Otherwise pairs and triples of contacts are solved as in a PlaneComposition (contact_search.hpp), on the tangent
// planes at the solution itself. For curved surfaces the planes are taken anew at each point until it settles
// (settling.hpp). Among complete sets, fewer contacts come first, then the smallest ‖r − p‖.
//
// If five or more objects press in one place, World::choose picks those that would hold the proxy without friction.
// They are tried first, then other sets, up to most_attempts in a step. So a step among a thousand objects costs little
// more than one among ten; a step still without a solution counts as unresolved.
//
// If an elastic layer presses together with other obstacles, all that press share the force (shared_support.hpp).
//
// A step with q and p within the last known clearance touches nothing and skips all this.
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
  // Contacts report `object`. Several obstacles may be one object: a box seen from inside is six.
  struct Entry {
    std::unique_ptr<Obstacle> obstacle;
    std::int32_t object = 0;
    std::int32_t feature = -1;  // reported; -1: the obstacle's feature
  };
  explicit World(std::vector<Entry> entries);

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override { return !moving_.empty(); }
  [[nodiscard]] std::span<const Contact<3>> contacts() const noexcept override {
    return {are_shared_ ? shared_.data() : contacts_.data(), count_};
  }

  // Signed distance to the nearest obstacle, metres; infinite in an empty world.
  [[nodiscard]] double distance(const Vec3& x) const noexcept;

  // How far a point gets along the straight way from x to y before an obstacle stops it. For a proxy with no other way
  // to go, as on a guide. Precondition: no obstacle excludes x.
  struct Sweep {
    Vec3 end;
    bool stopped = false;
    Contact<3> contact;  // with the obstacle that stopped it
  };
  [[nodiscard]] Sweep sweep(const Vec3& x, const Vec3& y) noexcept;

  // Steps so far in which no set of contacts was complete: a jam, or a tool deeper than a curved surface's radius. The
  // proxy then goes as far as a shorter step leads, or stays.
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return unresolved_; }
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }

 private:
  // The obstacles that may be part of the solution, and their steps alone. Typical steps have one to three. Candidates
  // beyond the twelfth are dropped; the step counts as unresolved if no set of the twelve is complete.
  struct Candidates {
    static constexpr std::size_t most = 12;
    std::array<std::size_t, most> index{};
    std::array<Obstacle::Step, most> alone{};
    std::size_t count = 0;
    bool grew = false;
    bool around = false;  // points beyond an object count as reached if it lets the proxy go around, see gets_around()

    void clear() noexcept {
      count = 0;
      grew = around = false;
    }
    [[nodiscard]] bool has(std::size_t i) const noexcept;
    void add(std::size_t i, const Obstacle::Step& step) noexcept;
  };
  struct Choice;

  // An obstacle that would hold the proxy alone.
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
  std::vector<std::size_t> moving_;     // moving ones, bounded or not
  BoundsTree tree_;                     // all others
  std::vector<bool> elastic_;           // for each obstacle: whether it has an elastic layer
  bool soft_ = false;                   // whether any has
  // The obstacles that a step may meet: first the resting ones within near_radius_ of near_centre_, gathered anew only
  // when a step leaves that ball; then the moving ones that are close in this step.
  std::vector<std::size_t> near_;
  std::size_t near_fixed_ = 0;
  Vec3 near_centre_ = Vec3::Zero();
  double near_radius_ = -1.0;
  Candidates candidates_;  // a member, so that a step needn't initialise all of it
  std::array<Contact<3>, 3> contacts_{};
  std::array<Contact<3>, Candidates::most> shared_{};  // used instead of contacts_ if elastic layers share the force
  bool are_shared_ = false;
  std::vector<Pressed> pressed_;         // of this step; reserved for all obstacles
  std::array<std::size_t, 3> likely_{};  // obstacles of a crowd that would hold the proxy without friction
  std::size_t likely_count_ = 0;
  int attempts_left_ = 0;   // pairs and triples that this step may still try
  int support_budget_ = 0;  // what SharedSupport may still spend in this step
  std::size_t count_ = 0;
  std::uint64_t unresolved_ = 0;
  bool squeezed_ = false;
  // No obstacle is closer than clearance_ to clear_at_. Used only in worlds without moving obstacles.
  Vec3 clear_at_ = Vec3::Zero();
  double clearance_ = -1.0;
};

}  // namespace proxarm::models
