// One run of the stress study (stress.hpp): a world, a proxy and a force in it, all of them drawn by the run's seed,
// and what came of its steps.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace proxarm::studies {

// Which worlds: those of random_scene(), random_mesh_scene() or random_layer_scene(), each a study of its own, so that
// what a seed gives in the one stays what it was. order_2: those of random_scene(), all stepped by order 2. tools:
// rigid tools in those of random_tool_scene() (tool_run.hpp); moving_tools: the same, set in motion.
enum class StressWorlds { all, meshes, layers, order_2, tools, moving_tools };

enum Invariant { finite, inside, law, stiffness, work, invariant_count };
inline constexpr std::array<const char*, invariant_count> invariant_names{"finite", "inside", "law", "stiffness",
                                                                          "work"};

struct Tally {
  std::string kind;
  int dimensions = 3, order = 1;
  std::size_t objects = 0;
  double mass_kg = 0.0, period_s = 0.0, force_N = 0.0;
  std::int64_t steps = 0, contact = 0, slipping = 0, several = 0, unresolved = 0, edge = 0, not_judged = 0;
  std::int64_t squeezed = 0;
  double deepest_m = 0.0;
  std::array<std::int64_t, invariant_count> violations{};
  std::string first = "none";
  std::int64_t first_step = -1;

  void violated(Invariant which, std::int64_t step) {
    ++violations[which];
    if (first_step >= 0) return;
    first = invariant_names[which];
    first_step = step;
  }
};

// `report`, if there is one, is given a line for each violation.
Tally run_seed(std::uint64_t seed, StressWorlds worlds, std::string* report);

}  // namespace proxarm::studies
