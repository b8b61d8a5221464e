// What a step over a large mesh costs, against Embree's two queries that a proxy would be made of: the closest point
// with a warm radius, and the segment from the proxy to the tool. Same mesh, same way, same run.
//
// The meshes are icospheres of 0.2 m whose triangles come in random order, as files may have them. The tool moves at
// 0.2 m/s and 1 kHz along a great circle that precesses, so that the faces it meets are new ones.
#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <vector>

#include "models/mesh/mesh_surface.hpp"
#include "scenes/mesh_files/mesh_file.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"

namespace {

using namespace proxarm::models;
using Clock = std::chrono::steady_clock;

constexpr double kRadius = 0.2, kStep = 2e-4, kFriction = 0.3;

// 20 · 4^times triangles.
const TriangleSoup& soup_of(int times) {
  static std::map<int, TriangleSoup> soups;
  TriangleSoup& soup = soups[times];
  if (soup.triangles.empty()) {
    soup = proxarm::tests::ball(times, kRadius);
    std::shuffle(soup.triangles.begin(), soup.triangles.end(), std::mt19937_64(1));
  }
  return soup;
}

std::shared_ptr<const TriangleMesh> mesh_of(int times) {
  static std::map<int, std::shared_ptr<const TriangleMesh>> meshes;
  auto& mesh = meshes[times];
  if (mesh == nullptr) mesh = std::make_shared<const TriangleMesh>(soup_of(times));
  return mesh;
}

// The tool's way over the sphere, there and back, `depth_m` below the surface (above: negative); prepared beforehand,
// and long enough that the faces it meets don't stay in the caches.
class Way {
 public:
  Way(const TriangleMesh& mesh, double depth_m) {
    for (int k = 0; k < kPoints; ++k) {
      const double along = 0.1 + k * kStep / kRadius, across = 0.7 + 0.0137 * k * kStep / kRadius;
      const Vec3 x = Vec3(std::cos(across), std::sin(across), 0.3).normalized(), y = x.unitOrthogonal();
      const Vec3 out = std::cos(along) * x + std::sin(along) * y;
      const double height = 1.1 * kRadius * (1.0 - mesh.first_hit(1.1 * kRadius * out, Vec3::Zero()).share);
      points_.push_back((height - depth_m) * out);
    }
  }
  const Vec3& next() noexcept {
    if (at_ + ahead_ < 0 || at_ + ahead_ == kPoints) ahead_ = -ahead_;
    return points_[static_cast<std::size_t>(at_ += ahead_)];
  }

 private:
  static constexpr int kPoints = 1 << 16;
  std::vector<Vec3> points_;
  int at_ = -1, ahead_ = 1;
};

// Median and 99th percentile of single steps, less what reading the clock takes.
template <typename Step>
void measure_singly(benchmark::State& state, Step step) {
  constexpr int kSteps = 50'000;
  std::vector<double> taken, empty;
  for (int k = 0; k < kSteps; ++k) {
    const auto begun = Clock::now();
    const auto clock = Clock::now();
    step();
    const auto ended = Clock::now();
    empty.push_back(std::chrono::duration<double, std::nano>(clock - begun).count());
    taken.push_back(std::chrono::duration<double, std::nano>(ended - clock).count());
  }
  std::sort(taken.begin(), taken.end());
  std::sort(empty.begin(), empty.end());
  state.counters["median_ns"] = taken[kSteps / 2] - empty[kSteps / 2];
  state.counters["p99_ns"] = taken[kSteps * 99 / 100] - empty[kSteps / 2];
}

template <typename Step>
void measure(benchmark::State& state, Step step) {
  for (int k = 0; k < 1000; ++k) step();
  for (auto _ : state) step();
  measure_singly(state, step);
  state.counters["triangles"] = static_cast<double>(soup_of(static_cast<int>(state.range(0))).triangles.size());
}

// Arguments: splits of the icosahedron, and how deep the tool is in the sphere, µm (free space: negative).
void mesh_step(benchmark::State& state) {
  const auto mesh = mesh_of(static_cast<int>(state.range(0)));
  MeshSurface g(mesh, kFriction);
  Way tool(*mesh, 1e-6 * static_cast<double>(state.range(1)));
  Vec3 q = 1.1 * tool.next();
  std::size_t contacts = 0, steps = 0;
  measure(state, [&] {
    q = g(1e6, tool.next(), q);
    contacts += g.contacts().size();
    ++steps;
    benchmark::DoNotOptimize(q);
  });
  state.counters["contacts"] = static_cast<double>(contacts) / static_cast<double>(steps);
  state.counters["unresolved"] = static_cast<double>(g.unresolved_steps());
}

class EmbreeMesh {
 public:
  explicit EmbreeMesh(const TriangleSoup& soup) : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    vertices_ = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                            3 * sizeof(float), soup.vertices.size()));
    triangles_ = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                3 * sizeof(unsigned), soup.triangles.size()));
    for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
      for (int k = 0; k < 3; ++k) vertices_[3 * v + k] = static_cast<float>(soup.vertices[v][k]);
    }
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) triangles_[3 * t + k] = soup.triangles[t][k];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
    if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("Embree has no memory");
  }
  ~EmbreeMesh() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  using Vec3f = Eigen::Vector3f;

  [[nodiscard]] Vec3f closest(const Vec3& x, double radius) {
    RTCPointQuery query{};
    query.x = static_cast<float>(x.x());
    query.y = static_cast<float>(x.y());
    query.z = static_cast<float>(x.z());
    query.radius = static_cast<float>(radius);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &query, &context, &EmbreeMesh::visit, this);
    return nearest_;
  }

  [[nodiscard]] float first_hit(const Vec3& from, const Vec3& to) const {
    RTCRayHit ray{};
    const Eigen::Vector3f o = from.cast<float>(), d = (to - from).cast<float>();
    ray.ray = {o.x(), o.y(), o.z(), 0.0f, d.x(), d.y(), d.z(), 0.0f, 1.0f, ~0u, 0, 0};
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &ray);
    return ray.ray.tfar;
  }

 private:
  [[nodiscard]] Vec3f vertex(unsigned triangle, int k) const {
    return Eigen::Map<const Vec3f>(vertices_ + 3 * triangles_[3 * triangle + k]);
  }

  // Ericson, Real-Time Collision Detection (2005), section 5.1.5.
  static Vec3f on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
    const Vec3f ab = b - a, ac = c - a, ap = p - a;
    const float d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0.0f && d2 <= 0.0f) return a;
    const Vec3f bp = p - b;
    const float d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0.0f && d4 <= d3) return b;
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) return a + d1 / (d1 - d3) * ab;
    const Vec3f cp = p - c;
    const float d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0.0f && d5 <= d6) return c;
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) return a + d2 / (d2 - d6) * ac;
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
      return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    }
    const float scale = 1.0f / (va + vb + vc);
    return a + vb * scale * ab + vc * scale * ac;
  }

  static bool visit(RTCPointQueryFunctionArguments* at) {
    auto& self = *static_cast<EmbreeMesh*>(at->userPtr);
    const Vec3f x(at->query->x, at->query->y, at->query->z);
    const Vec3f near =
        on_triangle(x, self.vertex(at->primID, 0), self.vertex(at->primID, 1), self.vertex(at->primID, 2));
    const float distance = (near - x).norm();
    if (!(distance < at->query->radius)) return false;
    at->query->radius = distance;
    self.nearest_ = near;
    return true;
  }

  RTCDevice device_;
  RTCScene scene_;
  float* vertices_ = nullptr;
  unsigned* triangles_ = nullptr;
  Vec3f nearest_ = Vec3f::Zero();
};

// The closest point's distance changes by no more than the tool moves: that is the warm radius.
void embree_closest_and_segment(benchmark::State& state) {
  static std::map<int, std::unique_ptr<EmbreeMesh>> meshes;
  auto& mesh = meshes[static_cast<int>(state.range(0))];
  if (mesh == nullptr) mesh = std::make_unique<EmbreeMesh>(soup_of(static_cast<int>(state.range(0))));
  Way tool(*mesh_of(static_cast<int>(state.range(0))), 1e-6 * static_cast<double>(state.range(1)));
  Vec3 q = 1.1 * tool.next();
  double distance = 0.2 * kRadius;
  measure(state, [&] {
    const Vec3& p = tool.next();
    const Vec3 near = mesh->closest(p, distance + 1.5 * kStep).cast<double>();
    distance = (near - p).norm();
    benchmark::DoNotOptimize(mesh->first_hit(q, p));
    q = near * (1.0 + 1e-6);
  });
}

// Reading 1.31 M triangles of binary STL: argument 0 without a cache, 1 with the one that the load before has left.
void mesh_load(benchmark::State& state) {
  const auto folder = std::filesystem::temp_directory_path() / "proxarm_mesh_bench";
  const auto file = folder / "ball.stl", cache = folder / "ball.stl.proxarm";
  std::filesystem::create_directories(folder);
  std::ofstream(file, std::ios::binary) << proxarm::tests::stl_of(soup_of(8));
  const auto load = [&] { return proxarm::scenes::load_mesh(file, {1.0, Pose::Identity()}).mesh; };
  std::shared_ptr<const TriangleMesh> mesh = load();
  for (auto _ : state) {
    if (state.range(0) == 0) std::filesystem::remove(cache);
    mesh = load();
  }
  state.counters["bytes_per_triangle"] = static_cast<double>(mesh->bytes()) / static_cast<double>(mesh->size());
  std::filesystem::remove_all(folder);
}
BENCHMARK(mesh_load)->ArgName("cached")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void over_meshes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"splits", "depth_um"});
  for (const int splits : {3, 5, 7, 8}) {
    for (const int depth_um : {5, 5000}) benchmark->Args({splits, depth_um});
  }
  benchmark->Args({8, -2000});
}
BENCHMARK(mesh_step)->Apply(over_meshes);
BENCHMARK(embree_closest_and_segment)->Apply(over_meshes);

}  // namespace
