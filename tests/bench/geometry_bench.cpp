// The cost of one step of 𝒢, by what is in the world. Each loop renders a proxy that is pushed as (26) pushes it:
// penetrations of micrometres, a direction that keeps turning.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/cylinder_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "models/world/world.hpp"

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

template <typename T, typename... Arguments>
World one(Arguments&&... arguments) {
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<T>(std::forward<Arguments>(arguments)...), 0, -1});
  return World(std::move(entries));
}

// Pressed by 5 N (5 µm at 1 kg and 1 kHz) against the surface that is found from `from`, and dragged around in a circle
// by 0.5 of that: it slips where μ is less.
void on_surface(benchmark::State& state, GeometricAlgorithm<3>& g, const Vec3& from, const Vec3& towards) {
  std::vector<Vec3> turning;
  for (int i = 0; i < 1024; ++i) {
    const double a = 2.0 * M_PI * i / 64.0;
    turning.push_back(5e-6 * Vec3(std::cos(a), std::sin(a), 0.3));
  }
  Vec3 q = g(1e6, from + towards, from), n = g.contacts()[0].normal;
  std::size_t i = 0, contacts = 0;
  for (auto _ : state) {
    q = g(1e6, q - 5e-6 * n + 0.5 * n.cross(turning[i++ & 1023]), q);
    if (!g.contacts().empty()) n = g.contacts()[0].normal;
    contacts += g.contacts().size();
    benchmark::DoNotOptimize(q);
  }
  state.counters["contacts"] = benchmark::Counter(static_cast<double>(contacts), benchmark::Counter::kAvgIterations);
}

void sphere(benchmark::State& state) {
  World g = one<Sphere>(PointCore{Vec3(0.1, 0.2, 0.3)}, 0.1, 0.3, false);
  on_surface(state, g, Vec3(0.1, 0.25, 0.5), Vec3(0, -0.02, -0.15));
}
BENCHMARK(sphere);

void sphere_inside(benchmark::State& state) {
  World g = one<Sphere>(PointCore{Vec3(0.1, 0.2, 0.3)}, 0.1, 0.3, true);
  on_surface(state, g, Vec3(0.1, 0.21, 0.31), Vec3(0, 0.05, 0.15));
}
BENCHMARK(sphere_inside);

void capsule(benchmark::State& state) {
  World g = one<Capsule>(SegmentCore({0, 0, 0}, {0.2, 0, 0}), 0.1, 0.3, false);
  on_surface(state, g, Vec3(0.1, 0.02, 0.2), Vec3(0, 0, -0.15));
}
BENCHMARK(capsule);

void cylinder(benchmark::State& state) {
  World g = one<CylinderObstacle>(Vec3(0, 0, 0), Vec3(0.2, 0, 0), 0.1, 0.3);
  on_surface(state, g, Vec3(0.1, 0.02, 0.2), Vec3(0, 0, -0.15));
}
BENCHMARK(cylinder);

void box(benchmark::State& state) {
  World g = one<BoxObstacle>(Pose::Identity(), Vec3(0.2, 0.3, 0.4), 0.3);
  on_surface(state, g, Vec3(0.01, 0.02, 0.3), Vec3(0, 0, -0.15));
}
BENCHMARK(box);

// A corner of a hard plane and one under an elastic layer, both of which press.
void layer_and_plane(benchmark::State& state) {
  const Vec3 o(0.1, 0.2, 0.3);
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<PlaneObstacle>(o, Vec3(1, 0.1, 0), 0.3, Layer{2e3, 0.02}), 0, -1});
  entries.push_back({std::make_unique<PlaneObstacle>(o, Vec3(0, 1, 0.1), 0.2), 1, -1});
  World g(std::move(entries));
  steps(state, g, o, pushes(Vec3(1, 1, 0).normalized(), 5e-6));
}
BENCHMARK(layer_and_plane);

void sphere_on_plane(benchmark::State& state) {
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<Sphere>(PointCore{Vec3(0, 0, 0)}, 0.1, 0.3, false), 0, -1});
  entries.push_back({std::make_unique<PlaneObstacle>(Vec3(0, 0, 0), Vec3(0, 0.1, 1), 0.2), 1, -1});
  World g(std::move(entries));
  Vec3 q(0.2, 0, 0.05);
  for (int k = 0; k < 100; ++k) q = g(1e6, q - Vec3(1e-3, 0, 1e-3), q);
  steps(state, g, q, pushes(Vec3(1, 0, 1).normalized(), 5e-6));
}
BENCHMARK(sphere_on_plane);

// An octahedron of 20 mm.
std::shared_ptr<const TriangleMesh> small_mesh(const Vec3& at) {
  constexpr double R = 0.02;
  TriangleSoup soup;
  soup.vertices = {{R, 0, 0}, {-R, 0, 0}, {0, R, 0}, {0, -R, 0}, {0, 0, R}, {0, 0, -R}};
  soup.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (Vec3& vertex : soup.vertices) vertex += at;
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

// A crowd of small spheres in a cube of 10 m, every hundredth a mesh, and one in the middle.
std::vector<World::Entry> crowd(int count) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> at(-5.0, 5.0);
  std::vector<World::Entry> entries;
  entries.push_back({std::make_unique<Sphere>(PointCore{Vec3(0.1, 0.2, 0.3)}, 0.1, 0.3, false), 0, -1});
  while (static_cast<int>(entries.size()) < count) {
    const Vec3 x(at(random), at(random), at(random));
    if (x.norm() < 1.0) continue;
    if (entries.size() % 100 == 99) {
      entries.push_back({std::make_unique<MeshObstacle>(small_mesh(x), 0.2), 1, -1});
    } else {
      entries.push_back({std::make_unique<Sphere>(PointCore{x}, 0.02, 0.2, false), 1, -1});
    }
  }
  return entries;
}

// To and fro at 0.2 m/s and 1 kHz, 0.2 m above the sphere in the middle.
void roam(benchmark::State& state, GeometricAlgorithm<3>& g) {
  Vec3 q(0, 0, 0.7);
  std::size_t i = 0;
  for (auto _ : state) {
    const double step = (i++ / 1000) % 2 == 0 ? 2e-4 : -2e-4;
    q = g(1e6, q + Vec3(step, 0, 0), q);
    benchmark::DoNotOptimize(q);
  }
}

void free_in_an_empty_scene(benchmark::State& state) {
  std::unique_ptr<GeometricAlgorithm<3>> g = std::make_unique<FreeSpace<3>>();
  roam(state, *g);
}
BENCHMARK(free_in_an_empty_scene);

void free_among(benchmark::State& state) {
  World g(crowd(static_cast<int>(state.range(0))));
  roam(state, g);
}
BENCHMARK(free_among)->Arg(1)->Arg(10'000);

void contact_among(benchmark::State& state) {
  World g(crowd(static_cast<int>(state.range(0))));
  on_surface(state, g, Vec3(0.1, 0.25, 0.5), Vec3(0, -0.02, -0.15));
}
BENCHMARK(contact_among)->Arg(1)->Arg(10'000);

// For scale: a 𝒢 that visits every object in every step.
void visiting_every_object(benchmark::State& state) {
  const auto entries = crowd(static_cast<int>(state.range(0)));
  const Vec3 q(0, 0, 0.7), p = q + Vec3(2e-4, 0, 0);
  for (auto _ : state) {
    std::size_t touched = 0;
    for (const auto& entry : entries) touched += entry.obstacle->step(1e6, p, q).touches ? 1u : 0u;
    benchmark::DoNotOptimize(touched);
  }
}
BENCHMARK(visiting_every_object)->Arg(10'000);

}  // namespace
