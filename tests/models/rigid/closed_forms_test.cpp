// A rigid tool against what can be written down: levers, ladders, rollers.
#include <gtest/gtest.h>

#include <numbers>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"

namespace proxarm::models {
namespace {

RigidObject floor_with(double mu, const Vec3& normal = Vec3::UnitZ(), std::int32_t object = 0) {
  RigidObject plane;
  plane.shape = FlatSide{normal, 0.0};
  plane.friction = mu;
  plane.object = object;
  return plane;
}

Mat6 stiffness(double mass_kg = 4.0, double inertia_kgm2 = 0.01) {
  Vec<6> d;
  d << Vec3::Constant(mass_kg * 1e6), Vec3::Constant(inertia_kgm2 * 1e6);
  return d.asDiagonal();
}

Twist wrench(const Vec3& force, const Vec3& torque) {
  Twist w;
  w << force, torque;
  return w;
}

// A step from a pose under a wrench on the tool: p̂ = q ⊞ K⁻¹ w.
ToolPose pushed(RigidWorld& g, const Mat6& K, const ToolPose& q, const Twist& w) {
  return g.step(K, moved(q, K.inverse() * w), q);
}

// The sum of the contacts' wrenches against K (q ⊟ p̂).
double imbalance_N(const RigidWorld& g, const Mat6& K, const ToolPose& q, const ToolPose& p_hat) {
  Twist sum = Twist::Zero();
  for (const PoseContact& contact : g.contacts()) {
    sum += wrench(contact.force_W, (contact.point_W - q.position).cross(contact.force_W));
  }
  return (sum - K * difference(q, p_hat)).norm();
}

// By bisection to the last bit; the function changes its sign between.
template <typename Function>
double root(Function f, double low, double high) {
  const bool rises = f(high) > f(low);
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (low + high);
    ((f(middle) > 0.0) == rises ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

Tool one(const decltype(ToolPart::shape)& shape) { return {{{shape, Pose::Identity(), {}}}}; }

TEST(RigidWorld, ABoxTipsOverItsEdgeAtTheLever) {
  // Width 2a, pressed with N at its middle and pushed with F at a height h above the floor: it tips from F h = N a on.
  const double a = 0.03, height = 0.08, N = 10.0, h = 0.07;
  RigidWorld g(one(BoxTool{{2.0 * a, 0.05, height}}), {floor_with(5.0)});
  const Mat6 K = stiffness();
  const ToolPose q{{0.0, 0.0, 0.5 * height}, Quaternion::Identity()};
  for (const double share : {0.5, 1.0 - 1e-9, 1.0 + 1e-9, 1.5}) {
    const double F = share * N * a / h;
    const Vec3 force(F, 0.0, -N);
    const Twist w = wrench(force, Vec3(0.0, 0.0, h - 0.5 * height).cross(Vec3(F, 0.0, 0.0)));
    const ToolPose r = pushed(g, K, q, w);
    EXPECT_FALSE(g.unresolved());
    const double turned = difference(r, q)[4];
    if (share < 1.0) {
      EXPECT_EQ(r, q) << "it stays, bit for bit";
    } else {
      // It turns by φ about the edge, on which all forces act: the moment of K (q ⊟ p̂) about the edge vanishes.
      const ToolPose p = moved(q, K.inverse() * w);
      const Vec3 edge(a, 0.0, 0.0);
      const auto moment = [&](double angle) {
        Vec3 turn(0.0, angle, 0.0);
        const ToolPose at{edge + rotation_by(turn) * (q.position - edge), rotation_by(turn)};
        const Twist f = K * difference(at, p);
        return (f.tail<3>() + (at.position - edge).cross(f.head<3>())).y();
      };
      const double expected = root(moment, 0.0, 1e-3);
      EXPECT_NEAR(turned, expected, 1e-9 * expected + 1e-16);
      EXPECT_GT(turned, 0.0);
    }
  }
}

TEST(RigidWorld, ABoxSlidesWhenPushedBeyondItsFriction) {
  const double mu = 0.4, N = 10.0, height = 0.02;
  RigidWorld g(one(BoxTool{{0.06, 0.05, height}}), {floor_with(mu)});
  const Mat6 K = stiffness();
  const ToolPose q{{0.1, 0.2, 0.5 * height}, Quaternion::Identity()};
  const ToolPose r = pushed(g, K, q, wrench({6.0, 0.0, -N}, {0.0, -0.5 * height * mu * N, 0.0}));
  EXPECT_FALSE(g.unresolved());
  EXPECT_NEAR(r.position.x() - q.position.x(), (6.0 - mu * N) / K(0, 0), 1e-15);
  EXPECT_EQ(g.contacts().size(), 4U);
  for (const PoseContact& contact : g.contacts()) {
    EXPECT_TRUE(contact.slips);
    EXPECT_NEAR(contact.force_W.head<2>().norm(), mu * contact.force_W.z(), 1e-10);
  }
}

TEST(RigidWorld, APartsOwnFrictionCountsAsTheGeometricMean) {
  const double mu_tool = 0.9, mu = 0.4, N = 10.0, F = 9.0;
  RigidWorld g({{{SphereTool{0.01}, Pose::Identity(), mu_tool}}}, {floor_with(mu)});
  const Mat6 K = stiffness(4.0, 1e6);  // it can't roll
  const ToolPose q{{0.0, 0.0, 0.01}, Quaternion::Identity()};
  const ToolPose r = pushed(g, K, q, wrench({F, 0.0, -N}, Vec3::Zero()));
  EXPECT_NEAR(r.position.x(), (F - std::sqrt(mu_tool * mu) * N) / K(0, 0), 1e-9 * F / K(0, 0));
}

// A rod of length L and radius ρ between floor (z = 0) and wall (x = 0), loaded with W at its middle. With normal
// forces N_f and N_w and friction at its limit: N_w = μ_f N_f, N_f + μ_w N_w = W, and the moments about the middle
// vanish:
//   (L/2)(N_f cos θ − μ_f N_f sin θ − N_w sin θ − μ_w N_w cos θ) … with the arms ρ of friction.
struct Ladder {
  double L, rho, mu_floor, mu_wall;
  static constexpr double W = 10.0;

  [[nodiscard]] double critical_angle() const {
    const double N_f = W / (1.0 + mu_floor * mu_wall), N_w = mu_floor * N_f;
    const auto moment = [&](double angle) {  // turning that lets the foot slide out
      const Vec3 foot(0.5 * L * std::cos(angle), 0.0, -0.5 * L * std::sin(angle)), head = -foot;
      const Vec3 f_f(-mu_floor * N_f, 0.0, N_f), f_w(N_w, 0.0, mu_wall * N_w);
      return ((foot - rho * Vec3::UnitZ()).cross(f_f) + (head - rho * Vec3::UnitX()).cross(f_w)).y();
    };
    return root(moment, 0.1, 1.5);
  }
  // How far the middle goes away from the wall in a step from an angle.
  [[nodiscard]] double slides_m(double angle) const {
    RigidWorld g(one(CapsuleTool{L, rho}), {floor_with(mu_floor), floor_with(mu_wall, Vec3::UnitX(), 1)});
    ToolPose q;
    q.position = Vec3(rho + 0.5 * L * std::cos(angle), 0.0, rho + 0.5 * L * std::sin(angle));
    q.orientation = Quaternion::FromTwoVectors(Vec3::UnitZ(), Vec3(-std::cos(angle), 0.0, std::sin(angle)));
    const ToolPose r = pushed(g, stiffness(0.04, 1e-4), q, wrench({0.0, 0.0, -W}, Vec3::Zero()));
    EXPECT_FALSE(g.unresolved());
    return r.position.x() - q.position.x();
  }
};

TEST(RigidWorld, ALadderSlipsAtItsAngle) {
  for (const Ladder& ladder : {Ladder{0.2, 0.002, 0.35, 0.2}, {0.05, 0.004, 0.6, 0.0}, {0.8, 0.001, 0.15, 0.5}}) {
    const double critical = ladder.critical_angle();
    EXPECT_EQ(ladder.slides_m((1.0 + 1e-9) * critical), 0.0) << "steeper than " << critical << ": it stands";
    // By 3e-14 m at least: of coordinates up to 0.4 m the last place is 6e-17 m.
    EXPECT_GT(ladder.slides_m((1.0 - 1e-9) * critical), 1e-14) << "flatter than " << critical << ": it slides";
  }
}

TEST(RigidWorld, ASphereRollsWhereItSticksAndTurnsFreelyWhereItDoesNot) {
  // Pushed with F at its middle: rolling, friction takes J/(J + M r²) of the force; sliding, none of it turns.
  const double radius = 0.02, F = 2.0, N = 10.0;
  const Mat6 K = stiffness(4.0, 0.001);
  const ToolPose q{{0.0, 0.0, radius}, Quaternion::Identity()};
  const Twist w = wrench({F, 0.0, -N}, Vec3::Zero());
  RigidWorld rough(one(SphereTool{radius}), {floor_with(1.0)});
  const Twist rolled = difference(pushed(rough, K, q, w), q);
  const double M = K(0, 0), J = K(4, 4);
  EXPECT_NEAR(rolled[0], F / (M + J / (radius * radius)), 1e-9 * F / M);
  EXPECT_NEAR(rolled[4], rolled[0] / radius, 1e-9 * F / M / radius);
  RigidWorld smooth(one(SphereTool{radius}), {floor_with(0.0)});
  const Twist slid = difference(pushed(smooth, K, q, w), q);
  EXPECT_NEAR(slid[0], F / M, 1e-9 * F / M);
  EXPECT_EQ(slid[4], 0.0);
}

TEST(RigidWorld, ARowOfContactsHoldsAgainstATwist) {
  // A box on its four corners, pressed in the middle and twisted about z: each corner bears N/4 and slips on a circle
  // of the radius of the half diagonal, so the torque is μ N times that.
  const double mu = 0.3, N = 10.0, x = 0.04, y = 0.03, arm = 0.5 * std::hypot(x, y);
  RigidWorld g(one(BoxTool{{x, y, 0.02}}), {floor_with(mu)});
  const Mat6 K = stiffness();
  const ToolPose q{{0.0, 0.0, 0.01}, Quaternion::Identity()};
  const double limit = mu * N * arm;
  EXPECT_EQ(pushed(g, K, q, wrench({0.0, 0.0, -N}, {0.0, 0.0, (1.0 - 1e-9) * limit})), q);
  const ToolPose p = moved(q, K.inverse() * wrench({0.0, 0.0, -N}, {0.0, 0.0, 1.5 * limit}));
  const ToolPose r = g.step(K, p, q);
  const Twist force = K * difference(r, p);
  EXPECT_NEAR(force[5], -limit, 1e-9 * limit);
  EXPECT_NEAR(difference(r, q)[5], 0.5 * limit / K(5, 5), 1e-9 * limit / K(5, 5));
  EXPECT_LE(imbalance_N(g, K, r, p), 1e-10);
}

TEST(RigidWorld, ARodPivotsInACorner) {
  // Its end in the corner of floor and two walls, pressed into all three; pushed at the other end it turns about the
  // end's middle, and the distances stay as they are.
  const double L = 0.1, rho = 0.003;
  RigidWorld g(one(CapsuleTool{L, rho}),
               {floor_with(0.0), floor_with(0.0, Vec3::UnitX(), 1), floor_with(0.0, Vec3::UnitY(), 2)});
  const Mat6 K = stiffness();
  const Vec3 along = Vec3(1.0, 1.0, 1.0).normalized(), end(rho, rho, rho);
  ToolPose q{end + 0.5 * L * along, Quaternion::FromTwoVectors(Vec3::UnitZ(), along)};
  const Vec3 across = along.unitOrthogonal(), push = 3.0 * across, lever = 0.5 * L * along;
  const ToolPose p = moved(q, K.inverse() * wrench(-20.0 * along + push, lever.cross(push)));
  const ToolPose r = g.step(K, p, q);
  EXPECT_FALSE(g.unresolved());
  EXPECT_EQ(g.contacts().size(), 3U);
  EXPECT_LE((r * Vec3(0.0, 0.0, -0.5 * L) - end).norm(), 1e-15);
  const auto moment = [&](double angle) {
    const Quaternion turn = rotation_by(Vec3(angle * along.cross(across)));
    const ToolPose at{end + turn * lever, turn * q.orientation};
    const Twist f = K * difference(at, p);
    return along.cross(across).dot(f.tail<3>() + (at.position - end).cross(f.head<3>()));
  };
  const double expected = root(moment, 0.0, 1e-3);
  EXPECT_NEAR(difference(r, q).tail<3>().norm(), expected, 1e-9 * expected);
}

// What forces at points are about a place.
Twist sum_of(const std::vector<std::pair<Vec3, Vec3>>& points_and_forces, const Vec3& about) {
  Twist sum = Twist::Zero();
  for (const auto& [point, force] : points_and_forces) sum += wrench(force, (point - about).cross(force));
  return sum;
}

// A prism on the three corners of a triangle: what each bears is a matter of statics alone, however it is pressed. (Of
// four corners it isn't, and with the shares of friction several poses may keep the law.)
TEST(RigidWorld, ThreeUnequalCornersHoldByTheSumOfTheirFrictions) {
  Random random(30);
  const Mat6 K = stiffness();
  for (int k = 0; k < 100; ++k) {
    const std::array<Vec3, 3> corners{Vec3(random.uniform(0.01, 0.03), random.uniform(-0.01, 0.01), -0.01),
                                      Vec3(random.uniform(-0.03, -0.01), random.uniform(0.01, 0.03), -0.01),
                                      Vec3(random.uniform(-0.03, -0.01), random.uniform(-0.03, -0.01), -0.01)};
    ConvexTool prism;
    for (const Vec3& corner : corners) {
      prism.points_m.push_back(corner);
      prism.points_m.emplace_back(corner.x(), corner.y(), 0.01);
    }
    const double mu = random.uniform(0.1, 0.6);
    RigidWorld g(one(prism), {floor_with(mu)});
    const ToolPose q{{0.0, 0.0, 0.01}, Quaternion::Identity()};
    // Turned by φ about a place on the floor, each corner has slipped along a chord.
    const double phi = random.log_uniform(1e-6, 1e-4);
    const Quaternion turn = rotation_by(Vec3(0.0, 0.0, phi));
    const Vec3 centre(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), 0.01);
    const ToolPose expected{centre + turn * (q.position - centre), turn};
    std::vector<std::pair<Vec3, Vec3>> presses, frictions;
    for (const Vec3& corner : corners) {
      const double bears = random.uniform(0.5, 10.0);
      const Vec3 way = expected * corner - q * corner;
      presses.emplace_back(expected * corner, bears * Vec3::UnitZ());
      frictions.emplace_back(expected * corner, -mu * bears * way.normalized());
    }
    const Twist press = sum_of(presses, expected.position), friction = sum_of(frictions, expected.position);
    const ToolPose p = moved(expected, -(K.inverse() * (press + friction)));
    const ToolPose r = g.step(K, p, q);
    EXPECT_FALSE(g.unresolved()) << k;
    EXPECT_LE(difference(r, expected).norm(), 1e-9 * phi + 1e-16) << k;
    EXPECT_LE((K * difference(r, p) - press - friction).norm(), 1e-9 * friction.norm()) << k;
    EXPECT_LE(imbalance_N(g, K, r, p), 1e-10) << k;
  }
}

// The end of a rod, a ball of radius ρ, in the corner of floor and two walls.
struct CorneredRod {
  static constexpr double L = 0.1, rho = 0.003, mu = 0.3;
  RigidWorld g{one(CapsuleTool{L, rho}),
               {floor_with(mu), floor_with(mu, Vec3::UnitX(), 1), floor_with(mu, Vec3::UnitY(), 2)}};
  Mat6 K = stiffness();
  Vec3 along = Vec3(1.0, 1.0, 1.0).normalized(), end{rho, rho, rho};
  ToolPose q{end + 0.5 * L * along, Quaternion::FromTwoVectors(Vec3::UnitZ(), along)};
};

TEST(RigidWorld, ARodSpinsInACornerAgainstTheFrictionOfItsEnd) {
  // Pressed in with F along the diagonal, each face bears F/√3, with a lever of ρ √(2/3) about the diagonal: while it
  // spins, friction has √2 μ F ρ. At rest the faces may also be wedged, by friction towards the corner, s each, with
  // which they bear F/√3 + √2 s; what is then left for the spin is at most 1/√(1 − 2μ²) times that.
  CorneredRod rod;
  const double F = 20.0, spinning = std::numbers::sqrt2 * rod.mu * F * rod.rho;
  const double most = spinning / std::sqrt(1.0 - 2.0 * rod.mu * rod.mu);
  const auto spun = [&](double torque) {
    const ToolPose r = pushed(rod.g, rod.K, rod.q, wrench(-F * rod.along, torque * rod.along));
    EXPECT_FALSE(rod.g.unresolved()) << torque;
    EXPECT_LE((r * Vec3(0.0, 0.0, -0.5 * rod.L) - rod.end).norm(), 1e-15);
    return difference(r, rod.q).tail<3>().dot(rod.along);
  };
  for (const double share : {0.1, 0.5, 0.9, 0.98}) {
    const double torque = share * spinning;
    EXPECT_LE(std::abs(spun(torque)), 1e-7 * torque / rod.K(5, 5))
        << share << ": it holds, by friction within its cones";
  }
  // Friction is against the chord of a slip, which is φ/2 off its tangent: so much less exact is the first order.
  const double J = rod.K(5, 5);
  for (const double torque : {(1.0 + 1e-9) * most, 2.0 * most, 50.0 * most}) {
    const double turn = (torque - spinning) / J;
    EXPECT_NEAR(spun(torque), turn, (1e-9 * torque + 0.5 * turn * spinning) / J);
  }
}

TEST(RigidWorld, ARodPivotsInACornerAgainstTheFrictionOfItsEnd) {
  // About any axis: the faces' points have slipped by ρ (1 − R⁻¹) n over the ball, which says where friction points.
  // With what the faces bear, p̂ follows from the rod's pose.
  CorneredRod rod;
  Random random(31);
  for (int k = 0; k < 200; ++k) {
    const double phi = random.log_uniform(1e-4, 1e-3);
    const Quaternion turn = rotation_by(Vec3(phi * random.direction()));
    const ToolPose expected{rod.end + turn * (rod.q.position - rod.end), turn * rod.q.orientation};
    std::vector<std::pair<Vec3, Vec3>> forces;
    Vec3 friction_Nm = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 n = Vec3::Unit(axis), way = rod.rho * (turn.conjugate() * n - n), slip = way - n * n.dot(way);
      const Vec3 force = random.uniform(5.0, 20.0) * (n - rod.mu * slip.normalized());
      forces.emplace_back(rod.end - rod.rho * n, force);
      friction_Nm += (-rod.rho * n).cross(force);
    }
    const ToolPose p = moved(expected, -(rod.K.inverse() * sum_of(forces, expected.position)));
    const ToolPose r = rod.g.step(rod.K, p, rod.q);
    EXPECT_FALSE(rod.g.unresolved()) << k;
    EXPECT_LE(difference(r, expected).tail<3>().norm(), 1e-9 * phi) << k;
    EXPECT_LE((r * Vec3(0.0, 0.0, -0.5 * rod.L) - rod.end).norm(), 1e-15) << k;
    Vec3 sum_Nm = Vec3::Zero();
    for (const PoseContact& contact : rod.g.contacts()) sum_Nm += (contact.point_W - rod.end).cross(contact.force_W);
    EXPECT_LE((sum_Nm - friction_Nm).norm(), 1e-9 * friction_Nm.norm()) << k;
  }
}

// The iteration ended once the next step would have been below rounding, with forces along normals of before its last
// one: up to 3e-10 rad off those at the end, 3 nN across at 10 N. Found by comparing stiffnesses
// (stiffness_independence_test.cpp): with another one the same wrench led elsewhere by 1e-13 m.
TEST(RigidWorld, ForcesOfRoundBodiesAreAlongTheirNormalsWhereTheToolEnds) {
  Random random(5);
  double worst = 0.0;
  int pressed = 0;
  for (int world = 0; world < 200; ++world) {
    const double radius = random.uniform(0.003, 0.02), other = random.uniform(0.02, 0.05);
    RigidObject sphere;
    sphere.shape = solid_of(SphereTool{other}, Pose::Identity());
    sphere.friction = world % 2 == 0 ? 0.0 : 0.3;
    RigidWorld g(one(SphereTool{radius}), {sphere});
    ToolPose q;
    q.position = (radius + other + 1e-6) * random.direction();
    for (int k = 0; k < 20; ++k) {
      const double size = random.log_uniform(1e-7, 5e-4);
      const Vec3 way = random.in_box(size) - size * q.position.normalized();
      q = g.step(stiffness(), moved(q, wrench(way, random.in_box(1e-3))), q);
      for (const PoseContact& contact : g.contacts()) {
        worst = std::max(worst, contact.normal_W.cross(q.position.normalized()).norm());
        pressed += contact.force_W.norm() > 0.0 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(pressed, 3000);
  EXPECT_LE(worst, 1e-11) << "rad: a tenth of a nanonewton across at 10 N";
}

TEST(RigidWorld, ALongStepGoesThroughNothingThin) {
  // A plate of a tenth of a millimetre; a step that needs more parts than one may have ends early, and says so.
  RigidObject plate;
  plate.shape = solid_of(BoxTool{{1.0, 1.0, 1e-4}}, Pose::Identity());
  for (const double depth : {0.001, 0.01, 1.0, 100.0}) {
    RigidWorld g(one(SphereTool{0.001}), {plate});
    ToolPose q, p;
    q.position.z() = 0.003;
    p.position.z() = -depth;
    for (int k = 0; k < 5; ++k) {
      const bool too_long = q.position.z() + depth > 512 * 0.2 * 1e-4;  // parts of a fifth of the plate's thickness
      q = g.step(stiffness(), p, q);
      EXPECT_GE(q.position.z(), 0.00105 - 1e-12) << depth;
      EXPECT_EQ(g.unresolved(), too_long) << depth;
    }
    EXPECT_NEAR(q.position.z(), 0.00105, 1e-12) << depth;
  }
}

TEST(RigidWorld, RefusesCylindersBesideWhatTheyAreNotHeldBy) {
  RigidObject capsule;
  capsule.shape = HollowTube{};
  EXPECT_THROW(RigidWorld(one(CylinderTool{0.1, 0.1}), {capsule}), std::invalid_argument);
  EXPECT_THROW(RigidWorld(one(SphereTool{0.1}), {floor_with(-1.0)}), std::invalid_argument);
}

// Taken for a point, it ended in a crash at the first step beside a box.
TEST(RigidWorld, RefusesAToolWithoutParts) {
  RigidObject box;
  box.shape = solid_of(BoxTool{Vec3(0.1, 0.1, 0.1)}, Pose::Identity());
  EXPECT_THROW(RigidWorld(Tool{}, {box}), std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::models
