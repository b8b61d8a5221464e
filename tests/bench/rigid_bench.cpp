// What a step of a rigid tool costs: 𝒢 for a pose at 1 kHz, 4 kg and 0.05 kg m², under a hand that presses, slides,
// turns and lets go; seeded. The loop's mean is over all steps. `median_us` and `p99_us` are of single steps that
// touch, `worst_us` of all; `in_solves` is the median over the time of a 6 × 6 Cholesky solve in the same run. The
// label says how many contacts there were, and how many steps stayed unresolved.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "tests/bench/rigid_runs.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/rigid_judges/rigid_bodies.hpp"

namespace proxarm::bench {
namespace {

using namespace models;

double solve_us() {
  Mat6 A = 10.0 * Mat6::Identity();
  Twist b = Twist::Ones();
  constexpr int kTimes = 20'000;
  const auto begun = std::chrono::steady_clock::now();
  for (int k = 0; k < kTimes; ++k) {
    A.diagonal().array() += 1e-6 * b.array();
    b = A.llt().solve(Twist::Ones());
    benchmark::DoNotOptimize(b);
  }
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begun).count() / kTimes;
}

double quantile(std::vector<double>& sorted, double share) {
  const auto at = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
  return sorted.empty() ? 0.0 : sorted[std::min(at, sorted.size() - 1)];
}

std::string label(const std::array<std::size_t, 7>& contacts, std::size_t steps, std::size_t unresolved,
                  const char* wanted) {
  std::string out = "contacts";
  for (std::size_t n = 0; n < contacts.size(); ++n) {
    char text[40];
    std::snprintf(text, sizeof text, " %zu%s: %.1f %%", n, n + 1 == contacts.size() ? "+" : "",
                  100.0 * static_cast<double>(contacts[n]) / static_cast<double>(steps));
    if (contacts[n] > 0) out += text;
  }
  return out + "; unresolved " + std::to_string(unresolved) + " of " + std::to_string(steps) + "; " + wanted;
}

// `most`: steps with more contacts aren't part of the median and the 99th percentile.
void report(benchmark::State& state, const std::vector<Run>& runs, std::size_t most, const char* wanted) {
  std::array<std::size_t, 7> contacts{};
  std::size_t steps = 0, unresolved = 0;
  std::vector<double> touching, all;
  for (const Run& run : runs) {
    const std::vector<double> times = time_steps(run);
    for (std::size_t k = 0; k < times.size(); ++k) {
      const Run::Step& step = run.steps[k];
      ++steps;
      ++contacts[std::min(step.contacts, contacts.size() - 1)];
      unresolved += step.unresolved ? 1 : 0;
      all.push_back(times[k]);
      if (step.contacts > 0 && step.contacts <= most) touching.push_back(times[k]);
    }
  }
  std::sort(touching.begin(), touching.end());
  state.counters["median_us"] = quantile(touching, 0.5);
  state.counters["p99_us"] = quantile(touching, 0.99);
  state.counters["worst_us"] = *std::max_element(all.begin(), all.end());
  state.counters["in_solves"] = quantile(touching, 0.5) / solve_us();
  state.SetLabel(label(contacts, steps, unresolved, wanted));
}

void bench(benchmark::State& state, const std::vector<Run>& runs, std::size_t most, const char* wanted) {
  std::vector<RigidWorld> room;
  std::size_t run = 0, k = 0;
  RigidWorld* g = &runs[0].begin(room);
  for (auto _ : state) {
    const Run::Step& step = runs[run].steps[k];
    benchmark::DoNotOptimize(g->step(runs[run].K, step.p_hat, step.q));
    if (++k < runs[run].steps.size()) continue;
    state.PauseTiming();
    run = (run + 1) % runs.size();
    k = 0;
    g = &runs[run].begin(room);
    state.ResumeTiming();
  }
  report(state, runs, most, wanted);
}

constexpr std::size_t kAny = 1000;

// -- a sphere on a plane ----------------------------------------------------------------------------------------------

void sphere_on_plane(benchmark::State& state) {
  RigidObject plane;
  plane.shape = FlatSide{Vec3::UnitZ(), 0.0};
  plane.friction = 0.3;
  const RigidWorld world({{{SphereTool{0.01}, Pose::Identity(), {}}}}, {plane});
  ToolPose q;
  q.position.z() = 0.012;
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose&) {
    return Vec3(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(-0.02, 0.015));
  }};
  bench(state, {record(world, realistic(q), hand, 1, 50'000)}, kAny, "wanted: 0.2 µs");
}
BENCHMARK(sphere_on_plane)->Unit(benchmark::kMicrosecond);

// -- among ten objects ------------------------------------------------------------------------------------------------

// A box or a capsule of some centimetres, somewhere among ten boxes, capsules and balls of 2 to 10 cm that overlap.
Run among_ten(std::uint64_t seed, bool is_box) {
  Random random(seed);
  Body tool;
  if (is_box) {
    tool.size = random_size(random, 0.01, 0.05);
  } else {
    tool.size.z() = random.uniform(0.01, 0.08);
    tool.radius = random.uniform(0.001, 0.01);
  }
  std::vector<Body> bodies;
  std::vector<RigidObject> objects;
  for (int i = 0; i < 10; ++i) {
    bodies.push_back(random_body(random, 0.02, 0.1));
    bodies.back().X = random_pose(random, 0.1);
    objects.push_back(object_of(bodies.back(), random.uniform(0.0, 0.8)));
  }
  ToolPose q;
  const auto is_free = [&](const Body& body) { return apart(at(tool, isometry(q)), body) > 1e-3; };
  do {
    q = tool_pose(random_pose(random, 0.12));
  } while (!std::all_of(bodies.begin(), bodies.end(), is_free));
  const RoamingHand hand{
      .next_place = [](Random& r, const ToolPose& now) { return Vec3(0.5 * now.position + r.in_box(0.06)); }};
  return record({{{{shape_of(tool), Pose::Identity(), {}}}}, objects}, realistic(q), hand, seed, 5'000);
}

void among_ten(benchmark::State& state, bool is_box) {
  std::vector<Run> runs;
  for (std::uint64_t seed = 0; seed < 12; ++seed) runs.push_back(among_ten(seed, is_box));
  bench(state, runs, 4, "of up to four contacts; wanted: 5 µs, p99 20");
}
BENCHMARK_CAPTURE(among_ten, capsule, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(among_ten, box, true)->Unit(benchmark::kMicrosecond);

// -- a peg in its round hole ------------------------------------------------------------------------------------------

// scenes/peg_in_hole.yaml: 20 mm H7/g6, 40 mm long, about its own middle.
void peg_in_hole(benchmark::State& state) {
  RigidObject tube;
  tube.shape = HollowTube{-Vec3::UnitZ(), Vec3::UnitZ(), 0.01000525, true};
  tube.friction = 0.15;
  const RigidWorld world({{{CylinderTool{0.04, 0.00999325}, Pose::Identity(), {}}}}, {tube});
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose&) {
    return Vec3(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), random.uniform(-0.03, 0.03));
  }};
  bench(state, {record(world, realistic({}), hand, 1, 50'000)}, kAny, "wanted: 20 µs, p99 60");
}
BENCHMARK(peg_in_hole)->Unit(benchmark::kMicrosecond);

// Hit again and again: at up to 0.3 m/s and 10 rad/s, under up to 50 N and 2 Nm (tests/models/rigid/peg_test.cpp).
Run hit_peg(double length) {
  RigidObject tube;
  tube.shape = HollowTube{-Vec3::UnitZ(), Vec3::UnitZ(), 0.01, true};
  tube.friction = 0.15;
  Pose X = Pose::Identity();
  X.translation().z() = 0.5 * length;
  const RigidWorld world({{{CylinderTool{length, 0.01 - 15e-6}, X, {}}}}, {tube});
  RigidWorld g = world;
  Random random(77);
  HeldTool held = realistic({});
  Run run{world, held.K, {}};
  Twist w = Twist::Zero();
  for (int k = 0; k < 10'000; ++k) {
    if (k % 40 == 0) {
      held.v << random.log_arrow(1e-4, 0.3), random.log_arrow(1e-3, 10.0);
      w << random.log_arrow(0.01, 50.0), random.log_arrow(1e-3, 2.0);
      if (held.q.position.z() * w.z() > 0.0) w.z() = -w.z();
    }
    const ToolPose p = held.freely(w), q = held.q;
    held.arrive(g.step(held.K, p, q));
    run.steps.push_back({p, q, g.contacts().size(), g.unresolved()});
  }
  return run;
}

void peg_hit_about(benchmark::State& state) {
  bench(state, {hit_peg(0.01), hit_peg(0.02), hit_peg(0.04)}, kAny, "wanted: 20 µs, p99 60");
}
BENCHMARK(peg_hit_about)->Unit(benchmark::kMicrosecond);

// -- a cylinder at a post ---------------------------------------------------------------------------------------------

// scenes/cylinder_on_post.yaml: sides, ends and rims of two cylinders. By its middle, the tool lies along the post and
// stands on it; between four places beside it and one on top.
void cylinder_on_post(benchmark::State& state) {
  RigidObject post;
  post.shape = solid_of(CylinderTool{0.35, 0.06}, Pose::Identity());
  post.friction = 0.3;
  const RigidWorld world({{{CylinderTool{0.08, 0.03}, Pose::Identity(), {}}}}, {post});
  ToolPose q;
  q.position = Vec3(0.1, 0.0, 0.1);
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose&) {
    if (random.chance(0.3)) return Vec3(random.in_box(0.03) + Vec3(0.0, 0.0, 0.2));
    const double angle = random.uniform(-3.0, 3.0);
    return Vec3(0.085 * std::cos(angle), 0.085 * std::sin(angle), random.uniform(0.05, 0.2));
  }};
  bench(state, {record(world, realistic(q), hand, 1, 50'000)}, kAny, "");
}
BENCHMARK(cylinder_on_post)->Unit(benchmark::kMicrosecond);

// -- a convex tool on a large mesh ------------------------------------------------------------------------------------

double bumpy(const Vec3& out) {
  return 0.2 + 0.002 * (std::sin(40.0 * out.x()) + std::sin(35.0 * out.y() + 1.0) + std::sin(30.0 * out.z() + 2.0));
}

// 327,680 triangles of about 1.3 mm, in random order, as files may have them.
std::shared_ptr<const TriangleFeatures> bumpy_ball() {
  TriangleSoup soup = tests::ball(7, 1.0);
  for (Vec3& v : soup.vertices) v *= bumpy(v.normalized());
  std::shuffle(soup.triangles.begin(), soup.triangles.end(), std::mt19937_64(1));
  return std::make_shared<const TriangleFeatures>(std::make_shared<const TriangleMesh>(std::move(soup)));
}

// Points on an ellipsoid, along a spiral.
ConvexTool pebble(int points) {
  ConvexTool tool;
  for (int i = 0; i < points; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / points, r = std::sqrt(1.0 - z * z);
    const double angle = 2.0 * std::numbers::pi * i / std::numbers::phi;
    tool.points_m.emplace_back(0.008 * r * std::cos(angle), 0.01 * r * std::sin(angle), 0.015 * z);
  }
  return tool;
}

// 10,000 triangles of about 1 mm, with dents.
MeshTool dented_pebble() {
  const TriangleSoup soup = tests::globe(51, 100, [](double theta, double phi) {
    return 0.02 * (1.0 + 0.1 * std::sin(theta) * std::sin(5.0 * theta) * std::cos(6.0 * phi));
  });
  return {soup.vertices, soup.triangles};
}

// Over the bumpy ball by some centimetres, between 1 cm off it and 3 cm in it.
void on_mesh(benchmark::State& state, const decltype(ToolPart::shape)& shape, double from, const char* wanted) {
  RigidObject object;
  object.shape = bumpy_ball();
  object.friction = 0.3;
  const RigidWorld world({{{shape, Pose::Identity(), {}}}}, {object});
  ToolPose q;
  q.position = from * Vec3::UnitX();
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose& now) {
    const Vec3 out = (now.position.normalized() + random.in_box(0.2)).normalized();
    return Vec3((bumpy(out) + random.uniform(-0.03, 0.02)) * out);
  }};
  bench(state, {record(world, realistic(q), hand, 1, 5'000)}, kAny, wanted);
}

void convex_on_mesh(benchmark::State& state) { on_mesh(state, pebble(200), 0.225, "wanted: 20 µs, p99 100"); }
BENCHMARK(convex_on_mesh)->Unit(benchmark::kMicrosecond);

void mesh_on_mesh(benchmark::State& state) { on_mesh(state, dented_pebble(), 0.23, "wanted: p99 300"); }
BENCHMARK(mesh_on_mesh)->Unit(benchmark::kMicrosecond);

void mesh_on_box(benchmark::State& state) {
  Body box;
  box.size = Vec3(0.3, 0.3, 0.1);
  const RigidWorld world({{{dented_pebble(), Pose::Identity(), {}}}}, {object_of(box, 0.3)});
  ToolPose q;
  q.position = 0.08 * Vec3::UnitZ();
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose&) {
    return Vec3(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(0.03, 0.09));
  }};
  bench(state, {record(world, realistic(q), hand, 1, 5'000)}, kAny, "");
}
BENCHMARK(mesh_on_box)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace proxarm::bench
