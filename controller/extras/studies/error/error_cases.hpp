// Defines the error study's motions, whose exact solutions are known.
//
// Units: m, kg, N, s. Each motion has its world twice: as 𝒢 for (26), and as surfaces for the penalty methods
// (penalty_world.hpp).
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::studies {

// The force that the sensor measures at time t, with the tool at q and v:
//   h = constant + ramp t + sine sin(ω t) − K_h (q − x_int) − D_h v
struct CaseForce {
  models::Vec3 constant = models::Vec3::Zero();
  models::Vec3 ramp_N_per_s = models::Vec3::Zero();
  models::Vec3 sine = models::Vec3::Zero();
  double omega_rad_per_s = 0.0;
  double hand_stiffness_N_per_m = 0.0, hand_damping_Ns_per_m = 0.0;
  models::Vec3 intention_m = models::Vec3::Zero();

  [[nodiscard]] models::Vec3 operator()(double t, const models::Vec3& q, const models::Vec3& v) const noexcept {
    models::Vec3 h = constant + t * ramp_N_per_s;
    if (omega_rad_per_s > 0.0) h += std::sin(omega_rad_per_s * t) * sine;
    if (hand_stiffness_N_per_m > 0.0) h -= hand_stiffness_N_per_m * (q - intention_m) + hand_damping_Ns_per_m * v;
    return h;
  }
};

// A surface: a plane through `point` with `normal`, or, if radius_m > 0, the inside of a sphere with its centre at
// `point`.
struct CaseSurface {
  models::Vec3 point = models::Vec3::Zero(), normal = models::Vec3::UnitZ();
  double radius_m = 0.0;
};

struct CaseState {
  models::Vec3 q = models::Vec3::Zero(), v = models::Vec3::Zero();
  models::Vec3 f = models::Vec3::Zero();  // force of the world on the proxy
};

struct ErrorCase {
  std::string name{}, title{};
  double mass_kg = 1.0;
  double duration_s = 1.0;
  CaseForce force{};
  std::vector<CaseSurface> surfaces{};
  double friction = 0.0;
  double medium_Ns_per_m = 0.0;  // damping of a medium where x > 0
  bool starts_in_contact = false;
  double stop_s = -1.0;  // when the proxy comes to rest; negative: never
  // Whether the normal or the direction of the slide turns, so that (26) is of first order.
  bool turns = false;
  std::function<CaseState(double)> exact{};
  std::function<std::unique_ptr<models::GeometricAlgorithm<3>>()> world{};
};

std::vector<ErrorCase> error_cases();

}  // namespace proxarm::studies
