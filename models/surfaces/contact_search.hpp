// Which of a few contacts hold the proxy? The active-set search that all worlds share.
//
// A step that meets several surfaces ends at a point that one, two or three of them hold together; the others don't
// act. The search tries sets of contacts, the smallest first, until one is complete: no contact pulls, nothing is
// penetrated, and each contact's friction obeys (17). A surface that a trial runs into becomes a candidate, and the
// search starts again. Three rigid contacts determine a point, so larger sets add nothing. Elastic layers share their
// force differently (models/world/shared_support.hpp).
//
// The caller solves the trials: on planes, tangent planes of curved surfaces, faces of a mesh. Sets are ordered by the
// candidates' numbers, with the greatest number in the outermost loop, so results depend only on the order of the
// candidates.
#pragma once

#include <cstddef>
#include <limits>
#include <utility>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

enum class StepResult {
  no_progress,  // no set of this size is complete: try larger ones
  progress,     // a candidate was added, or the proxy has moved: start again with single contacts
  arrived,      // a complete set was found
};

// Runs the stages (singles, pairs, triples, …) until one arrives or all make no progress. Returns whether one arrived.
// Calls `begin_round` before each round's first stage and gives up if that returns false.
template <typename BeginRound, typename... Stages>
bool search_contacts(BeginRound begin_round, Stages... stages) noexcept {
  StepResult result = StepResult::progress;
  while (result == StepResult::progress && begin_round()) {
    result = StepResult::no_progress;
    ((result == StepResult::no_progress ? void(result = stages()) : void()), ...);
  }
  return result == StepResult::arrived;
}

// Calls attempt(i, j), i < j < count, for all pairs of candidates, until it returns something other than no_progress.
// `count` may grow meanwhile: pairs with a new candidate come last.
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

// The same for all triples i < j < k < count.
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

// The best of several complete sets of one size: the one that leaves the proxy nearest to p. If Coulomb's law has
// several solutions, this one depends least on K.
struct NearestSet {
  double distance2 = std::numeric_limits<double>::infinity();  // ‖r − p‖²
  Vec3 r = Vec3::Zero();

  [[nodiscard]] bool found() const noexcept { return distance2 < std::numeric_limits<double>::infinity(); }
  // Takes `at` and returns true if it is better than the best so far; the caller then notes its contacts.
  bool improve(const Vec3& p, const Vec3& at) noexcept {
    const double d2 = (at - p).squaredNorm();
    if (!(d2 < distance2)) return false;
    distance2 = d2;
    r = at;
    return true;
  }
  // The result of a stage that has tried all sets of its size; `grew`: a candidate was added.
  [[nodiscard]] StepResult result(bool grew) const noexcept {
    return found() ? StepResult::arrived : grew ? StepResult::progress : StepResult::no_progress;
  }
};

}  // namespace proxarm::models
