// Makes one run of the stress study (stress.hpp): draws a world, a proxy and a force from the run's seed, and judges
// the steps.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace proxarm::studies {

// The kinds of worlds. Each kind is a study of its own, so that a change of one kind doesn't change the worlds of the
// others.
//   all            random_scene()
//   meshes         random_mesh_scene()
//   layers         random_layer_scene()
//   order_2        random_scene(), with order 2 only
//   tools          rigid tools in random_tool_scene() or random_mesh_tool_scene() (tool_run.hpp)
//   moving_tools   as `tools`, with moving objects
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

// Makes the run of this seed, and returns its counts. `report`, if not null, gets a line for each violation.
Tally run_seed(std::uint64_t seed, StressWorlds worlds, std::string* report);

}  // namespace proxarm::studies
