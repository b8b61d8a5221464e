#include "scenes/rigid/explain_rigid.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <vector>

#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::scenes {
namespace {

using models::Mat6;
using models::ToolPose;
using models::Vec3;

// Returns the stiffness K for 4 kg and 0.05 kg m² at 1 kHz.
Mat6 stiffness() {
  Mat6 K = Mat6::Identity() * 4e6;
  K.bottomRightCorner<3, 3>() *= 0.05 / 4.0;
  return K;
}

struct Cost {
  double median_ns = 0.0, worst_ns = 0.0;
  std::size_t most_contacts = 0, unresolved = 0;
};

// Measures the cost of steps towards p̂ = q + push. p̂ moves to and fro by a tenth of the push, as it does at 1 kHz.
Cost cost_of_steps(models::PoseAlgorithm& g, ToolPose q, const Vec3& push) {
  constexpr int steps_measured = 4000;
  const Mat6 K = stiffness();
  std::vector<double> times_ns;
  Cost cost;
  for (int k = 0; k < steps_measured; ++k) {
    ToolPose p_hat = q;
    p_hat.position += push + Vec3::Constant(k % 2 == 0 ? 1e-7 : -1e-7);
    const auto begin = std::chrono::steady_clock::now();
    q = g.step(K, p_hat, q);
    times_ns.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
    cost.most_contacts = std::max(cost.most_contacts, g.contacts().size());
    cost.unresolved += g.unresolved() ? 1U : 0U;
  }
  const auto at = [&](std::size_t i) {
    std::nth_element(times_ns.begin(), times_ns.begin() + static_cast<std::ptrdiff_t>(i), times_ns.end());
    return times_ns[i];
  };
  cost.median_ns = at(times_ns.size() / 2);
  cost.worst_ns = at(times_ns.size() * 99 / 100);
  return cost;
}

// Returns the pose with the largest clearance for the tool that was found near the scene's objects. If this pose isn't
// outside of all objects, no free pose was found.
ToolPose roomy_place(const Scene& scene, const models::PoseAlgorithm& g) {
  ToolPose best, tried;
  double room_m = -1.0;
  for (std::size_t i = 0; i < 200; ++i) {
    const Shape& shape = scene.objects[i % scene.objects.size()].shape;
    Vec3 offset;
    for (int a = 0; a < 3; ++a) offset[a] = std::sin(12.9898 * static_cast<double>(i + 1) * (a + 1.37));
    tried.position = middle_of(shape) + 1.5 * size_of(shape) * offset;
    const double clearance_m = g.clearance_m(tried);
    if (clearance_m <= room_m) continue;
    room_m = clearance_m;
    best = tried;
  }
  return best;
}

void tell_costs(const Scene& scene, models::PoseAlgorithm& g, std::ostringstream& out) {
  if (scene.objects.empty()) return;
  ToolPose q = roomy_place(scene, g);
  if (g.clearance_m(q) < 0.0) return;
  out << "cost of a step here, median and 99 of 100\n";
  const Cost free = cost_of_steps(g, q, Vec3::Zero());
  out << "  free: " << free.median_ns << " ns, " << free.worst_ns << " ns\n";
  // Moves the tool in various directions until it meets a surface. The tool is then pressed by 5 µm, as 20 N do.
  for (int i = 0; i < 60; ++i) {
    Vec3 direction;
    for (int a = 0; a < 3; ++a) direction[a] = std::sin(2.0 + 78.233 * (i + 1) * (a + 1));
    ToolPose at = q;
    for (int k = 0; k < 400 && g.contacts().empty(); ++k) {
      ToolPose p_hat = at;
      p_hat.position += 0.005 * direction.normalized();
      at = g.step(stiffness(), p_hat, at);
    }
    if (g.contacts().empty()) continue;
    const Cost pressed = cost_of_steps(g, at, -5e-6 * g.contacts()[0].normal_W);
    out << "  pressed on "
        << scene.objects[static_cast<std::size_t>(g.contacts().empty() ? 0 : g.contacts()[0].object)].name
        << ", with up to " << pressed.most_contacts << " contacts: " << pressed.median_ns << " ns, " << pressed.worst_ns
        << " ns\n";
    return;
  }
}

struct NameOf {
  std::string operator()(const models::SphereTool& /*shape*/) const { return "sphere"; }
  std::string operator()(const models::CapsuleTool& /*shape*/) const { return "capsule"; }
  std::string operator()(const models::BoxTool& /*shape*/) const { return "box"; }
  std::string operator()(const models::CylinderTool& /*shape*/) const { return "cylinder"; }
  std::string operator()(const models::ConvexTool& shape) const {
    return "hull of " + std::to_string(shape.points_m.size()) + " points";
  }
  std::string operator()(const models::MeshTool& shape) const {
    return "mesh of " + std::to_string(shape.triangles.size()) + " triangles";
  }
};

}  // namespace

std::string explain_rigid(const Scene& scene) {
  const std::unique_ptr<models::PoseAlgorithm> g = compile_rigid(scene, scene.tool->shape);
  std::ostringstream out;
  out.precision(3);
  out << scene.name << ", a rigid tool in 3 dimensions\n";
  out << "a step goes through\n";
  for (const models::ToolPart& part : scene.tool->shape.parts) {
    out << "  " << std::visit(NameOf{}, part.shape) << ", part of the tool";
    if (part.friction) out << ", friction √(" << *part.friction << " μ) with an object's μ";
    out << "\n";
  }
  for (const Object& object : scene.objects) {
    out << "  " << object.name << ", rigid, μ = " << object.friction
        << (object.motion ? ", moves: touched in its own frame" : "") << "\n";
  }
  if (scene.objects.empty()) out << "  nothing to touch: the pose goes where the wrench takes it\n";
  out << "skipped\n  pairs of features that are further apart than the steps to come reach\n";
  const bool moves =
      std::any_of(scene.objects.begin(), scene.objects.end(), [](const Object& object) { return object.motion; });
  out << "  motion: " << (moves ? "of objects that can't reach the tool within a step" : "nothing moves") << "\n";
  tell_costs(scene, *g, out);
  return out.str();
}

}  // namespace proxarm::scenes
