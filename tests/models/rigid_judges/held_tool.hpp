// A rigid tool as (26) on SE(3) moves it, with nothing of a session around it.
#pragma once

#include <functional>

#include "models/base/random.hpp"
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

// 4 kg and 0.05 kg m²: (26) with K = diag(M, J)/T².
inline HeldTool realistic(const ToolPose& q) {
  HeldTool held(4.0, 0.05, 0.0, 0.0);
  held.q = q;
  return held;
}

// A hand of 300 N/m about places that it changes four times a second, which turns the tool as it likes, up to a force
// and a torque. One time in five it lets go.
struct RoamingHand {
  std::function<Vec3(Random&, const ToolPose&)> next_place;
  double turn_rad_s = 10.0, most_N = 10.0, most_Nm = 1.0;
  Vec3 place = Vec3::Zero(), turn = Vec3::Zero();
  bool let_go = false;

  Twist wrench(Random& random, const HeldTool& tool, int k) {
    if (k % 250 == 0) {
      place = next_place(random, tool.q);
      turn = random.chance(0.5) ? Vec3(turn_rad_s * random.direction()) : random.in_box(0.3 * turn_rad_s);
      let_go = random.chance(0.2);
    }
    Twist w = Twist::Zero();
    if (let_go) return w;
    w.head<3>() = 300.0 * (place - tool.q.position) - 20.0 * tool.v.head<3>();
    w.tail<3>() = 50.0 * tool.M[3] * (turn - tool.v.tail<3>());
    if (const double size = w.head<3>().norm(); size > most_N) w.head<3>() *= most_N / size;
    if (const double size = w.tail<3>().norm(); size > most_Nm) w.tail<3>() *= most_Nm / size;
    return w;
  }
};

}  // namespace proxarm::models
