#include "scenes/compiler/explain.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <vector>

#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::Vec;
using models::Vec3;

// Returns the time of one step in ns: the median over blocks of steps. In these steps, p moves by about a micrometre,
// as it does at 1 kHz.
template <int N>
double median_ns(models::GeometricAlgorithm<N>& g, const Vec<N>& q_start, const Vec<N>& push) {
  constexpr int blocks_measured = 41, steps_measured = 500;
  std::vector<double> blocks;
  Vec<N> q = q_start;
  Vec<N> side = push.norm() > 0.0 ? push : Vec<N>::Constant(1e-6);
  for (int b = 0; b < blocks_measured; ++b) {
    const auto begin = std::chrono::steady_clock::now();
    for (int k = 0; k < steps_measured; ++k) q = g(1e6, q + push + (k % 2 == 0 ? 0.1 : -0.1) * side, q);
    const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - begin;
    blocks.push_back(time.count() / steps_measured);
  }
  std::nth_element(blocks.begin(), blocks.begin() + blocks_measured / 2, blocks.end());
  return blocks[blocks_measured / 2];
}

template <int N>
StepCost measure(const Scene& scene) {
  const CompiledScene compiled = compile(scene);
  models::GeometricAlgorithm<N>& g = compiled.algorithm<N>();
  g.set_time({.time_s = 0.0, .period_s = 1e-3});
  StepCost cost;
  // Steps without contact start from the point near the objects that has the largest clearance.
  Vec<N> clear = Vec<N>::Zero();
  double room = -1.0;
  const Clearances clearances(scene);
  for (std::size_t i = 0; i < 2000 && !scene.objects.empty(); ++i) {
    const Shape& shape = scene.objects[i % scene.objects.size()].shape;
    Vec3 offset;
    for (int a = 0; a < 3; ++a) offset[a] = std::sin(12.9898 * static_cast<double>(i + 1) * (a + 1.37));
    const Vec<N> x = compiled.from_W<N>(middle_of(shape) + 1.5 * size_of(shape) * offset);
    const double d = clearances.of_point(compiled.to_W<N>(x));
    if (d > room) {
      room = d;
      clear = x;
    }
  }
  if (scene.objects.empty() || room > 1e-3) cost.free_ns = median_ns<N>(g, clear, Vec<N>::Zero());
  // Steps in contact: the proxy moves in various directions until it meets a surface. It is then pressed by 5 µm, as 5
  // N do at 1 kg and 1 kHz.
  for (int i = 0; i < 200 && !scene.objects.empty() && !(cost.contact_ns > 0.0); ++i) {
    Vec<N> direction;
    for (int a = 0; a < N; ++a) direction[a] = std::sin(2.0 + 78.233 * (i + 1) * (a + 1));
    if (!(direction.norm() > 0.1)) continue;
    Vec<N> q = clear;
    for (int k = 0; k < 400 && g.contacts().empty(); ++k) q = g(1e6, q + 0.01 * direction.normalized(), q);
    if (g.contacts().empty()) continue;
    const Vec<N> n = g.contacts()[0].normal;
    for (int k = 0; k < 3; ++k) q = g(1e6, q - 5e-6 * n, q);
    cost.contact_ns = median_ns<N>(g, q, -5e-6 * n);
  }
  return cost;
}

struct Radius {
  // Returns the smallest radius of convex curvature; 0 if the shape has no convex curvature.
  double operator()(const SphereShape& s) const { return s.inside_out ? 0.0 : s.radius_m; }
  double operator()(const CapsuleShape& s) const { return s.inside_out ? 0.0 : s.radius_m; }
  double operator()(const CylinderShape& s) const { return s.inside_out ? 0.0 : s.radius_m; }
  double operator()(const auto&) const { return 0.0; }
};

}  // namespace

StepCost measure_step(const Scene& scene) {
  if (scene.space.dimensions == 1) return measure<1>(scene);
  if (scene.space.dimensions == 2) return measure<2>(scene);
  return measure<3>(scene);
}

std::string explain(const Scene& scene) {
  const CompiledScene compiled = compile(scene);
  const Narration narration = narrate(scene, compiled.plan);
  std::ostringstream out;
  out.precision(3);
  out << compiled.name << ", " << compiled.dimensions() << (compiled.dimensions() == 1 ? " dimension" : " dimensions")
      << "\n";
  out << "a step goes through\n";
  for (const Stage& stage : narration.stages) out << "  " << stage.what << ": " << stage.why << "\n";
  out << "skipped\n";
  for (const Stage& stage : narration.skipped) out << "  " << stage.what << ": " << stage.why << "\n";
  const StepCost cost = measure_step(scene);
  out << "cost of a step here\n";
  if (cost.free_ns > 0.0) out << "  free: " << cost.free_ns << " ns\n";
  if (cost.contact_ns > 0.0) out << "  in contact: " << cost.contact_ns << " ns\n";
  double sharpest = 0.0;
  for (const Object& object : scene.objects) {
    const double radius = std::visit(Radius{}, object.shape);
    if (radius > 0.0 && (!(sharpest > 0.0) || radius < sharpest)) sharpest = radius;
  }
  if (sharpest > 0.0) {
    // On convex curvature, the environment does a work of at most f_n ‖∇q‖²/(2R) per step.
    out << "note\n  on its sharpest outside (radius " << sharpest
        << " m) (26) gains speed at the rate T f_n/(M R): " << 100.0 * 1e-3 * 5.0 / sharpest
        << " %/s at 1 ms, 5 N and 1 kg; a damping of T f_n/R cancels it, " << 1e-3 * 5.0 / sharpest
        << " Ns/m here, and so does order 2\n";
  }
  return out.str();
}

}  // namespace proxarm::scenes
