// A peg in its hole: Whitney's diagram of which forces bring it in, and random pushes among which it stays inside.
#include <gtest/gtest.h>

#include <numbers>

#include "models/rigid/rigid_world.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

constexpr double kHole_m = 0.01, kClearance_m = 15e-6;  // radii

// Along z, with its tip's middle at the tool's origin; it goes in along −z.
RigidWorld peg_in_tube(double length, double mu) {
  Pose X = Pose::Identity();
  X.translation().z() = 0.5 * length;
  RigidObject tube;
  tube.shape = HollowTube{-Vec3::UnitZ(), Vec3::UnitZ(), kHole_m, true};
  tube.friction = mu;
  return {{{{CylinderTool{length, kHole_m - kClearance_m}, X, {}}}}, {tube}};
}

Mat6 stiffness(double mass_kg, double inertia_kgm2, double period_s) {
  Vec<6> d;
  d << Vec3::Constant(mass_kg / (period_s * period_s)), Vec3::Constant(inertia_kgm2 / (period_s * period_s));
  return d.asDiagonal();
}

// Tilted until both ends touch: the tip on the side of `sign` x, the other end across from it.
ToolPose touching_twice(double length, double sign) {
  double low = 0.0, high = 4.0 * kClearance_m / length;
  for (int k = 0; k < 100; ++k) {
    const double angle = 0.5 * (low + high);
    const double reach = 0.5 * length * std::sin(angle) + (kHole_m - kClearance_m) * std::cos(angle);
    (reach < kHole_m ? low : high) = angle;
  }
  ToolPose q;
  q.orientation = rotation_by(Vec3(0.0, -sign * low, 0.0));
  q.position = q.orientation * Vec3(0.0, 0.0, -0.5 * length);
  return q;
}

// D. E. Whitney, "Quasi-static assembly of compliantly supported rigid parts" (1982): force F_x, F_z (inwards) and
// moment M about the tip's middle. With forces f_A at the tip and f_B at the other end, both sliding inwards,
//   F_x = f_A − f_B,   F_z = μ (f_A + f_B),   M = l f_B + μ r (f_B − f_A),
// so that the border between what goes in and what jams is M/(r F_z) = λ − μ(1 + λ) F_x/F_z with λ = l/(2 r μ), from
// F_x/F_z = −1/μ to 1/μ; and the same turned about for the other side.
TEST(PegInItsHole, GoesInOrJamsAsWhitneysDiagramSays) {
  const Mat6 K = stiffness(4.0, 0.05, 1e-4);
  const double r = kHole_m, F_z = 10.0;
  double worst = 0.0;
  int measured = 0;
  for (const double mu : {0.1, 0.3}) {
    for (const double length : {0.012, 0.03}) {
      const double lambda = length / (2.0 * r * mu);
      ASSERT_GT(lambda, 1.0) << "it can't wedge without a push";
      RigidWorld g = peg_in_tube(length, mu);
      for (const double sign : {-1.0, 1.0}) {
        const ToolPose q = touching_twice(length, sign);
        ASSERT_NEAR(g.clearance_m(q), 0.0, 1e-16);
        for (int k = 0; k < 13; ++k) {
          const double x = (k - 6) / 7.0 / mu, m = lambda - mu * (1.0 + lambda) * x;
          // Along the ray through the border's point (x, m): does it go in?
          const auto goes_in = [&](double share) {
            Twist w;
            w << sign * share * x * F_z, 0.0, -F_z, 0.0, -sign * share * m * r * F_z, 0.0;
            const ToolPose next = g.step(K, moved(q, K.inverse() * w), q);
            EXPECT_FALSE(g.unresolved()) << "mu " << mu << " length " << length << " x " << x << " share " << share;
            return next.position.z() < q.position.z() - 1e-6 * F_z / K(0, 0);
          };
          double low = 0.5, high = 1.5;
          ASSERT_TRUE(goes_in(low));
          ASSERT_FALSE(goes_in(high));
          for (int i = 0; i < 20; ++i) (goes_in(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
          EXPECT_NEAR(low, 1.0, 0.01) << "mu " << mu << " length " << length << " x " << x;
          worst = std::max(worst, std::abs(low - 1.0));
          ++measured;
        }
      }
    }
  }
  EXPECT_EQ(measured, 104);
  RecordProperty("furthest_from_the_formula", std::to_string(worst));
}

// Touched along its side, on one side alone: f_A and f_B are on that side, F_x = f_A + f_B and F_z = μ (f_A + f_B), so
// that it goes in between the borders F_x/F_z = ±1/μ, wherever along the side they press.
TEST(PegInItsHole, GoesInBetweenTheBordersOfOneSide) {
  const Mat6 K = stiffness(4.0, 0.05, 1e-4);
  const double r = kHole_m, F_z = 10.0;
  double worst = 0.0;
  for (const double mu : {0.1, 0.3}) {
    for (const double length : {0.012, 0.03}) {
      RigidWorld g = peg_in_tube(length, mu);
      for (const double sign : {-1.0, 1.0}) {
        ToolPose q;
        q.position = Vec3(sign * kClearance_m, 0.0, -0.5 * length);
        ASSERT_NEAR(g.clearance_m(q), 0.0, 1e-16);
        for (const double along : {0.1, 0.3, 0.5, 0.7, 0.9}) {
          const auto goes_in = [&](double share) {
            const double F_x = share * F_z / mu;
            Twist w;
            w << sign * F_x, 0.0, -F_z, 0.0, sign * (along * length * F_x + r * F_z), 0.0;
            const ToolPose next = g.step(K, moved(q, K.inverse() * w), q);
            EXPECT_FALSE(g.unresolved()) << "mu " << mu << " length " << length << " along " << along;
            return next.position.z() < q.position.z() - 1e-6 * F_z / K(0, 0);
          };
          double low = 0.5, high = 1.5;
          ASSERT_TRUE(goes_in(low)) << along;
          ASSERT_FALSE(goes_in(high)) << along;
          for (int i = 0; i < 20; ++i) (goes_in(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
          EXPECT_NEAR(low, 1.0, 1e-5) << "mu " << mu << " length " << length << " along "
                                      << along;  // 2⁻¹⁹ of bisection
          worst = std::max(worst, std::abs(low - 1.0));
        }
      }
    }
  }
  RecordProperty("furthest_from_the_formula", std::to_string(worst));
}

// -- random pushes ----------------------------------------------------------------------------------------------------

using Real = long double;

// The furthest that a circle comes from the z axis, by places all around and thirds.
Real furthest(const Vec3& centre, const Vec3& u, const Vec3& v, double radius) {
  constexpr int places = 32;
  constexpr Real step = 2.0L * std::numbers::pi_v<Real> / places;
  const auto at = [&](Real angle) {
    const Real cos = radius * std::cos(angle), sin = radius * std::sin(angle);
    return std::hypot(centre.x() + cos * u.x() + sin * v.x(), centre.y() + cos * u.y() + sin * v.y());
  };
  std::array<Real, places> value;
  for (int k = 0; k < places; ++k) value[static_cast<std::size_t>(k)] = at(step * static_cast<Real>(k));
  Real most = 0.0L;
  for (int k = 0; k < places; ++k) {
    const Real here = value[static_cast<std::size_t>(k)];
    if (here < value[static_cast<std::size_t>((k + 1) % places)]) continue;
    if (here < value[static_cast<std::size_t>((k + places - 1) % places)]) continue;
    Real low = step * static_cast<Real>(k - 1), high = step * static_cast<Real>(k + 1);
    for (int i = 0; i < 45; ++i) {  // to 1e-9 rad, of which the distance knows 1e-20 m
      const Real x = low + (high - low) / 3.0L, y = high - (high - low) / 3.0L;
      const bool rises = at(x) < at(y);
      (rises ? low : high) = rises ? x : y;
    }
    most = std::max(most, at(0.5L * (low + high)));
  }
  return most;
}

double room_left(const ToolPose& q, double length) {
  const Mat3 R = q.orientation.toRotationMatrix();
  Real most = 0.0L;
  for (const double z : {0.0, length}) {
    most = std::max(most, furthest(q * Vec3(0.0, 0.0, z), R.col(0), R.col(1), kHole_m - kClearance_m));
  }
  return static_cast<double>(static_cast<Real>(kHole_m) - most);
}

// Free in its hole with all that (26) gives it, at up to 0.3 m/s and 10 rad/s, under wrenches of up to 50 N and 2 Nm.
// It stays inside, and gains no energy: with a = p̂ ⊟ q and b = r ⊟ q, bᵀK b ≤ aᵀK a + 2 fᵀb, and the contacts' fᵀb
// isn't positive, since gaps are concave and friction acts against the slip; but for the turn's second order, by which
// a contact's way differs from its twist's: ½ lever θ² of each. 10⁶ steps at PROXARM_TEST_SCALE=34.
TEST(PegInItsHole, StaysInsideAndGainsNoEnergy) {
  tests::Random random(77);
  const Mat6 K = stiffness(4.0, 0.05, 1e-3);
  const std::int64_t steps = tests::scaled(30000.0, 10000);
  std::int64_t unresolved = 0, touching = 0, deep = 0, gained = 0;
  double least = 1.0;
  const std::array<double, 3> lengths = {0.01, 0.02, 0.04};
  for (const double length : lengths) {
    RigidWorld g = peg_in_tube(length, 0.15);
    ToolPose q, last;
    Twist wrench = Twist::Zero();
    for (std::int64_t k = 0; k < steps / 3; ++k) {
      Twist way = difference(q, last);
      if (k % 40 == 0) {
        way << random.log_arrow(1e-7, 3e-4), random.log_arrow(1e-6, 1e-2);
        wrench << random.log_arrow(0.01, 50.0), random.log_arrow(1e-3, 2.0);
        if (q.position.z() * wrench.z() > 0.0) wrench.z() = -wrench.z();
      }
      const Twist a = way + K.inverse() * wrench;
      last = q;
      q = g.step(K, moved(q, a), q);
      const Twist b = difference(q, last);
      unresolved += g.unresolved() ? 1 : 0;
      touching += g.contacts().empty() ? 0 : 1;
      const double room = room_left(q, length);
      least = std::min(least, room);
      deep += room < -1e-12 ? 1 : 0;
      double turns_J = 0.0;
      for (const PoseContact& contact : g.contacts()) {
        turns_J += contact.force_W.norm() * (contact.point_W - q.position).norm() * b.tail<3>().squaredNorm();
      }
      // Metres and radians of a pose are known to ε: a free step of 1e-7 rad once gained 1e-9 of its energy by that.
      const double rounding_J = 4.0 * std::numeric_limits<double>::epsilon() * (K * b).norm();
      const double before_J = a.dot(K * a), after_J = b.dot(K * b);  // twice of each
      gained += after_J > before_J * (1.0 + 1e-9) + turns_J + rounding_J ? 1 : 0;
    }
  }
  EXPECT_EQ(deep, 0) << "least room " << least;
  EXPECT_EQ(gained, 0);
  EXPECT_GT(touching, steps / 2);
  EXPECT_LE(unresolved, steps / 200);
  RecordProperty("unresolved", std::to_string(unresolved));
}

}  // namespace
}  // namespace proxarm::models
