// A rigid tool as (26) on SE(3) moves it, with nothing of a session around it.
#pragma once

#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::models {

struct HeldTool {
  static constexpr double T = 1e-3;  // s

  // Isotropic mass (kg), inertia (kg m²) and damping (Ns/m, Nms/rad).
  HeldTool(double mass, double inertia, double damping, double turning_damping) {
    M << Vec3::Constant(mass), Vec3::Constant(inertia);
    B << Vec3::Constant(damping), Vec3::Constant(turning_damping);
    K = (M / (T * T) + B / T).asDiagonal();
  }

  // p̂ under a wrench on the tool: K (p̂ ⊟ q) = M v/T + w.
  [[nodiscard]] ToolPose freely(const Twist& wrench) const {
    return moved(q, (M.cwiseProduct(v) / T + wrench).cwiseQuotient(K.diagonal()));
  }
  void arrive(const ToolPose& r) {
    v = difference(r, q) / T;
    q = r;
  }
  [[nodiscard]] double energy_J() const { return 0.5 * v.dot(M.cwiseProduct(v)); }

  Twist M, B;
  Mat6 K;
  ToolPose q;
  Twist v = Twist::Zero();
};

}  // namespace proxarm::models
