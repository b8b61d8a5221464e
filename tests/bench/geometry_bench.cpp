// The cost of one step of 𝒢, by what is in the world. Each loop renders a proxy that is pushed as (26) pushes it:
// penetrations of micrometres, a direction that keeps turning.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

#include "models/free_space.hpp"
#include "models/friction_plane.hpp"
#include "models/plane.hpp"
#include "models/plane_composition.hpp"

namespace {

using namespace proxarm::models;

// Pushes prepared beforehand: `depth` against `normal`, with a sideways part that turns and is 0.5 of it.
std::vector<Vec3> pushes(const Vec3& normal, double depth) {
  std::vector<Vec3> out;
  const Vec3 x = normal.unitOrthogonal(), y = normal.cross(x);
  for (int i = 0; i < 1024; ++i) {
    const double a = 2.0 * M_PI * i / 1024.0;
    out.push_back(depth * (-normal + 0.5 * (std::cos(a) * x + std::sin(a) * y)));
  }
  return out;
}

void steps(benchmark::State& state, GeometricAlgorithm<3>& g, Vec3 q, const std::vector<Vec3>& push) {
  std::size_t i = 0, contacts = 0;
  for (auto _ : state) {
    q = g(1e6, q + push[i++ & 1023], q);
    contacts += g.contacts().size();
    benchmark::DoNotOptimize(q);
  }
  state.counters["contacts"] = benchmark::Counter(static_cast<double>(contacts), benchmark::Counter::kAvgIterations);
}

void free_space(benchmark::State& state) {
  std::unique_ptr<GeometricAlgorithm<3>> g = std::make_unique<FreeSpace<3>>();
  steps(state, *g, Vec3::Zero(), pushes(Vec3::UnitZ(), 5e-6));
}
BENCHMARK(free_space);

void smooth_plane(benchmark::State& state) {
  std::unique_ptr<GeometricAlgorithm<3>> g = std::make_unique<Plane<3>>(Vec3(0.1, 0.2, 0.3), Vec3(1, 2, 3));
  steps(state, *g, Vec3(0.1, 0.2, 0.3), pushes(Vec3(1, 2, 3).normalized(), 5e-6));
}
BENCHMARK(smooth_plane);

void frictional_plane(benchmark::State& state) {
  std::unique_ptr<GeometricAlgorithm<3>> g =
      std::make_unique<FrictionPlane<3>>(Vec3(0.1, 0.2, 0.3), Vec3(1, 2, 3), 0.3);
  steps(state, *g, Vec3(0.1, 0.2, 0.3), pushes(Vec3(1, 2, 3).normalized(), 5e-6));
}
BENCHMARK(frictional_plane);

void groove(benchmark::State& state) {
  const Vec3 n1 = Vec3(1, 0, 1).normalized(), n2 = Vec3(-1, 0.1, 1).normalized();
  PlaneComposition g(
      {Face{FlatSurface<3>(Vec3(0.1, 0.2, 0.3), n1), 0.3}, Face{FlatSurface<3>(Vec3(0.1, 0.2, 0.3), n2), 0.2}});
  steps(state, g, Vec3(0.1, 0.2, 0.3), pushes((n1 + n2).normalized(), 5e-6));
}
BENCHMARK(groove);

void corner(benchmark::State& state) {
  const Vec3 o(0.1, 0.2, 0.3);
  PlaneComposition g({Face{FlatSurface<3>(o, Vec3(1, 0.1, 0)), 0.3}, Face{FlatSurface<3>(o, Vec3(0, 1, 0.1)), 0.2},
                      Face{FlatSurface<3>(o, Vec3(0.1, 0, 1)), 0.1}});
  steps(state, g, o, pushes(Vec3(1, 1, 1).normalized(), 5e-6));
}
BENCHMARK(corner);

}  // namespace
