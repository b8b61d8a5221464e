// Finds which of a few candidate contacts hold the proxy: the active-set search that all worlds share.
//
// A step that meets several surfaces ends at a point that one, two or three of the surfaces hold together; the other
// surfaces exert no force. The search tries sets of contacts, the smallest sets first, until one set is complete. A set
// is complete if no contact pulls, the proxy penetrates no surface, and each contact's friction obeys (17). If a trial
// runs into a surface that isn't a candidate, this surface becomes a candidate and the search starts again. Three rigid
// contacts determine a point, so larger sets add nothing. Elastic layers aren't searched in this way: several layers
// share the force (models/world/shared_support.hpp).
//
// The caller solves the trials: on planes, on tangent planes of curved surfaces, or on faces of a mesh. The order of
// the sets follows from the candidates' numbers, with the greatest number in the outermost loop. So results depend only
// on the order of the candidates.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

enum class StepResult {
  no_progress,  // no set of this size is complete: try larger sets
  progress,     // a candidate was added, or the proxy has moved: start again with single contacts
  arrived,      // a complete set was found
};

// Runs the stages (singles, pairs, triples, …) in rounds, until one stage arrives or all stages make no progress.
// Returns whether one stage arrived. Calls `begin_round` before each round's first stage, and gives up if it returns
// false.
template <typename BeginRound, typename... Stages>
bool search_contacts(BeginRound begin_round, Stages... stages) noexcept {
  StepResult result = StepResult::progress;
  while (result == StepResult::progress && begin_round()) {
    result = StepResult::no_progress;
    ((result == StepResult::no_progress ? void(result = stages()) : void()), ...);
  }
  return result == StepResult::arrived;
}

// Calls attempt(i, j) for all pairs of candidates i < j < count, until the attempt returns something other than
// no_progress. `count` may grow during the calls: pairs with a new candidate come last.
template <typename Attempt>
StepResult try_each_pair(const std::size_t& count, Attempt attempt) noexcept {
  for (std::size_t j = 1; j < count; ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      const StepResult result = attempt(i, j);
      if (result != StepResult::no_progress) return result;
    }
  }
  return StepResult::no_progress;
}

// Calls attempt(i, j, k) for all triples of candidates i < j < k < count, as try_each_pair() does for pairs.
template <typename Attempt>
StepResult try_each_triple(const std::size_t& count, Attempt attempt) noexcept {
  for (std::size_t k = 2; k < count; ++k) {
    for (std::size_t j = 1; j < k; ++j) {
      for (std::size_t i = 0; i < j; ++i) {
        const StepResult result = attempt(i, j, k);
        if (result != StepResult::no_progress) return result;
      }
    }
  }
  return StepResult::no_progress;
}

// The best of several complete sets of one size: the set that leaves the proxy nearest to p. If Coulomb's law has
// several solutions, the solution nearest to p depends least on K.
struct NearestSet {
  double distance2 = std::numeric_limits<double>::infinity();  // ‖r − p‖²
  Vec3 r = Vec3::Zero();

  [[nodiscard]] bool found() const noexcept { return distance2 < std::numeric_limits<double>::infinity(); }
  // Takes the point `at` and returns true if it is nearer to p than the best point so far. The caller then stores the
  // contacts of `at`.
  bool improve(const Vec3& p, const Vec3& at) noexcept {
    const double d2 = (at - p).squaredNorm();
    if (!(d2 < distance2)) return false;
    distance2 = d2;
    r = at;
    return true;
  }
  // Returns the result of a stage that has tried all sets of its size. `grew`: whether the stage added a candidate.
  [[nodiscard]] StepResult result(bool grew) const noexcept {
    return found() ? StepResult::arrived : grew ? StepResult::progress : StepResult::no_progress;
  }
};

}  // namespace proxarm::models
