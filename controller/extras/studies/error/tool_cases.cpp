#include "controller/extras/studies/error/tool_cases.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace proxarm::studies {
namespace {

using models::Vec3;
using models::Wrench;

// The position of the tool's centre in the plane, and the tool's angle about y. Also used for the derivatives of both.
struct Planar {
  double x = 0.0, z = 0.0, angle = 0.0;
};

ToolState state(const Planar& at, const Planar& velocity, const Planar& acceleration) {
  const auto twist = [](const Planar& rate) {
    models::Twist xi;
    xi << rate.x, 0.0, rate.z, 0.0, rate.angle, 0.0;
    return xi;
  };
  return {{Vec3(at.x, 0.0, at.z), models::rotation_by(at.angle * Vec3::UnitY())}, twist(velocity), twist(acceleration)};
}

// The distance ∫∫ sin(ωt) from rest, and its two derivatives.
struct Pushed {
  double way, velocity, acceleration;
};
Pushed pushed(double t, double omega) {
  return {(omega * t - std::sin(omega * t)) / (omega * omega), (1.0 - std::cos(omega * t)) / omega,
          std::sin(omega * t)};
}

// The motion of a tool whose centre turns about a fixed point at distance d under a constant force: φ'' = d (−sin φ F_x
// + cos φ F_z)/I, with the inertia I about that point. The equation is solved by classical Runge-Kutta with 400 steps,
// whose error is 1e-13 rad.
struct Swing {
  double d_m, inertia_kg_m2, force_x_N, force_z_N, from_rad;

  [[nodiscard]] double acceleration(double phi) const {
    return d_m * (-std::sin(phi) * force_x_N + std::cos(phi) * force_z_N) / inertia_kg_m2;
  }
  struct Angle {
    double phi, rate;
  };
  [[nodiscard]] Angle at(double t) const {
    constexpr int steps = 400;
    const double h = t / steps;
    Angle a{from_rad, 0.0};
    for (int k = 0; k < steps; ++k) {
      const double k1 = a.rate, l1 = acceleration(a.phi);
      const double k2 = a.rate + 0.5 * h * l1, l2 = acceleration(a.phi + 0.5 * h * k1);
      const double k3 = a.rate + 0.5 * h * l2, l3 = acceleration(a.phi + 0.5 * h * k2);
      const double k4 = a.rate + h * l3, l4 = acceleration(a.phi + h * k3);
      a.phi += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      a.rate += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
    }
    return a;
  }
  // Returns the tool's state if the fixed point is (x, z) and the tool's angle is `sense` (φ − zero).
  [[nodiscard]] ToolState state_at(const Angle& a, double x, double z, double sense, double zero) const {
    const double s = std::sin(a.phi), c = std::cos(a.phi), w = a.rate, alpha = acceleration(a.phi);
    return state({x + d_m * c, z + d_m * s, sense * (a.phi - zero)}, {-d_m * s * w, d_m * c * w, sense * w},
                 {d_m * (-s * alpha - c * w * w), d_m * (c * alpha - s * w * w), sense * alpha});
  }
};

models::RigidObject side(const Vec3& normal, double friction, std::int32_t object = 0) {
  models::RigidObject out;
  out.shape = models::FlatSide{normal, 0.0};
  out.friction = friction;
  out.object = object;
  return out;
}

template <typename Shape>
models::Tool one(const Shape& shape) {
  return {{{shape, models::Pose::Identity(), {}}}};
}

constexpr double ball_m = 0.05, omega = 2.0 * std::numbers::pi;

ToolCase turn() {
  ToolCase out{.name = "turn", .title = "free, turned by a sine", .tool = one(models::SphereTool{ball_m})};
  constexpr double torque_Nm = 0.05;
  out.hand = [](double t) { return Wrench{Vec3::Zero(), torque_Nm * std::sin(omega * t) * Vec3::UnitY()}; };
  out.exact = [J = out.inertia_kg_m2](double t) {
    const Pushed p = pushed(t, omega);
    const double a = torque_Nm / J;
    return state({0.0, 0.0, a * p.way}, {0.0, 0.0, a * p.velocity}, {0.0, 0.0, a * p.acceleration});
  };
  return out;
}

// A ball that rolls and is pulled at its centre accelerates like a mass of M + J/r².
ToolCase roll() {
  ToolCase out{.name = "roll",
               .title = "a ball rolls",
               .tool = one(models::SphereTool{ball_m}),
               .objects = {side(Vec3::UnitZ(), 0.5)}};
  constexpr double pull_N = 4.0;
  out.hand = [](double t) { return Wrench{Vec3(pull_N * std::sin(omega * t), 0.0, -10.0), Vec3::Zero()}; };
  out.exact = [M = out.mass_kg, J = out.inertia_kg_m2](double t) {
    const Pushed p = pushed(t, omega);
    const double a = pull_N / (M + J / (ball_m * ball_m));
    const auto rolled = [a](double x, double z) { return Planar{a * x, z, a * x / ball_m}; };
    return state(rolled(p.way, ball_m), rolled(p.velocity, 0.0), rolled(p.acceleration, 0.0));
  };
  return out;
}

// A ball slides at first, and friction spins the ball up until it rolls.
ToolCase skid() {
  ToolCase out{.name = "skid",
               .title = "a ball slides until it rolls",
               .tool = one(models::SphereTool{ball_m}),
               .objects = {side(Vec3::UnitZ(), 0.3)}};
  constexpr double press_N = 10.0, friction_N = 3.0, start_m_per_s = 0.3;
  out.hand = [](double /*t*/) { return Wrench{Vec3(0.0, 0.0, -press_N), Vec3::Zero()}; };
  out.exact = [M = out.mass_kg, J = out.inertia_kg_m2](double t) {
    const double a = friction_N / M, alpha = friction_N * ball_m / J, rolls_s = start_m_per_s / (a + alpha * ball_m);
    const double s = std::min(t, rolls_s), left = t - s, v = start_m_per_s - a * s, w = alpha * s;
    const double slides = t < rolls_s ? 1.0 : 0.0;
    return state({start_m_per_s * s - 0.5 * a * s * s + v * left, ball_m, 0.5 * alpha * s * s + w * left}, {v, 0.0, w},
                 {-slides * a, 0.0, slides * alpha});
  };
  return out;
}

// A box that is pushed at its middle turns about the edge over which it tips.
ToolCase tip() {
  constexpr double half_m = 0.03, high_m = 0.04;
  ToolCase out{.name = "tip",
               .title = "a box tips over its edge",
               .tool = one(models::BoxTool{Vec3(2.0 * half_m, 0.05, 2.0 * high_m)}),
               .objects = {side(Vec3::UnitZ(), 3.0)}};
  const Vec3 force(1.6, 0.0, -2.0);
  const double d = std::hypot(half_m, high_m), flat = std::numbers::pi - std::atan2(high_m, half_m);
  const Swing swing{d, out.inertia_kg_m2 + out.mass_kg * d * d, force.x(), force.z(), flat};
  out.hand = [force](double /*t*/) { return Wrench{force, Vec3::Zero()}; };
  out.exact = [swing, flat](double t) { return swing.state_at(swing.at(t), 0.0, 0.0, -1.0, flat); };
  return out;
}

// A box falls from a tilt of 0.2 rad onto its face. The face is so wide that the box rests at once.
ToolCase fall() {
  constexpr double half_m = 0.06, high_m = 0.02, press_N = 2.0;
  ToolCase out{.name = "fall",
               .title = "a tilted box falls onto its face",
               .inertia_kg_m2 = 0.005,
               .tool = one(models::BoxTool{Vec3(2.0 * half_m, 0.05, 2.0 * high_m)}),
               .objects = {side(Vec3::UnitZ(), 3.0)}};
  const double d = std::hypot(half_m, high_m), flat = std::atan2(high_m, half_m);
  const Swing swing{d, out.inertia_kg_m2 + out.mass_kg * d * d, 0.0, -press_N, flat + 0.2};
  double before = 0.0, after = tool_case_s;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (before + after);
    (swing.at(middle).phi > flat ? before : after) = middle;
  }
  out.hand = [](double /*t*/) { return Wrench{Vec3(0.0, 0.0, -press_N), Vec3::Zero()}; };
  out.exact = [swing, flat, rests_s = after](double t) {
    if (t >= rests_s) return state({half_m, high_m, 0.0}, {}, {});
    return swing.state_at(swing.at(t), 0.0, 0.0, -1.0, flat);
  };
  return out;
}

// A rod without friction has one end on the floor and the other end on the wall, so the rod's middle moves on a circle.
ToolCase ladder() {
  constexpr double length_m = 0.2, radius_m = 0.01;
  ToolCase out{.name = "ladder",
               .title = "a rod slides down between wall and floor",
               .tool = one(models::CapsuleTool{length_m, radius_m}),
               .objects = {side(Vec3::UnitZ(), 0.0), side(Vec3::UnitX(), 0.0, 1)}};
  const Vec3 force(-0.5, 0.0, -3.0);
  const double d = 0.5 * length_m;
  const Swing swing{d, out.inertia_kg_m2 + out.mass_kg * d * d, force.x(), force.z(), 1.3};
  out.hand = [force](double /*t*/) { return Wrench{force, Vec3::Zero()}; };
  out.exact = [swing](double t) {
    return swing.state_at(swing.at(t), radius_m, radius_m, 1.0, 0.5 * std::numbers::pi);
  };
  return out;
}

}  // namespace

std::vector<ToolCase> tool_cases() { return {turn(), roll(), skid(), tip(), fall(), ladder()}; }

}  // namespace proxarm::studies
