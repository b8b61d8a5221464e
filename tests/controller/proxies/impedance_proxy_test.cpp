#include "controller/proxies/impedance_proxy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "models/base/setup_error.hpp"
#include "tests/controller/rendering/small_worlds.hpp"

namespace proxarm::controller {
namespace {

using models::Vec;
using testing::Nothing;
using testing::Wall;
using Vec1 = Vec<1>;
using Vec2 = Vec<2>;

ImpedanceConfig config(ImpedanceLaw law) {
  return {.stiffness_N_per_m = 750.0, .damping_Ns_per_m = 8.0, .period_s = 1e-3, .law = law};
}

constexpr ImpedanceLaw all_laws[] = {ImpedanceLaw::plain, ImpedanceLaw::damped_motion, ImpedanceLaw::damped_tool,
                                     ImpedanceLaw::implicit};

// Held still inside the wall, all four give the spring's force.
TEST(ImpedanceProxy, AnswersAHeldToolWithTheSpring) {
  for (const ImpedanceLaw law : all_laws) {
    Wall<1> wall(Vec1::Ones(), 0.0);
    ImpedanceProxy<1> proxy(config(law), wall);
    ASSERT_TRUE(proxy.start(Vec1(0.0)));
    for (int k = 0; k < 200; ++k) ASSERT_EQ(proxy.step(Vec1(-0.002)), ProxyFault::none);
    EXPECT_NEAR(proxy.f()[0], 1.5, 1e-12);
    EXPECT_EQ(proxy.q()[0], 0.0);
  }
}

// In free space only the damper on the tool (6) resists.
TEST(ImpedanceProxy, IsFreeInFreeSpaceButForTheDampedTool) {
  for (const ImpedanceLaw law : all_laws) {
    Nothing<1> space;
    ImpedanceProxy<1> proxy(config(law), space);
    for (int k = 1; k <= 100; ++k) {
      ASSERT_EQ(proxy.step(Vec1(1e-4 * k)), ProxyFault::none);
      ASSERT_NEAR(proxy.f()[0], law == ImpedanceLaw::damped_tool ? -0.8 : 0.0, 1e-11);
    }
  }
}

// The paper's experiment: pulled out of the wall at 0.2 m/s, (5) sucks and (23) doesn't.
TEST(ImpedanceProxy, ImplicitDampingNeverSucksAndThePapersFiveDoes) {
  for (const ImpedanceLaw law : {ImpedanceLaw::damped_motion, ImpedanceLaw::implicit}) {
    Wall<2> wall(Vec2::UnitY(), 0.3);
    ImpedanceProxy<2> proxy(config(law), wall);
    ASSERT_TRUE(proxy.start(Vec2::Zero()));
    double lowest = 0.0, highest = 0.0;
    for (int k = 0; k < 200; ++k) {
      const double y = k < 100 ? -1e-4 * std::min(k, 20) : -2e-3 + 2e-4 * (k - 100);
      ASSERT_EQ(proxy.step(Vec2(0.0, y)), ProxyFault::none);
      lowest = std::min(lowest, proxy.f().y());
      highest = std::max(highest, proxy.f().y());
    }
    EXPECT_GT(highest, 1.5);
    if (law == ImpedanceLaw::implicit) {
      EXPECT_GE(lowest, -1e-12);
    } else {
      EXPECT_LT(lowest, -1.0);  // B·v = 1.6 N of suction at the border
    }
  }
}

// (23) solves (18b): f = K(q − p) + B(∇q − ∇p)/T, with f that 𝒢 can give: inside the cone, never pulling.
TEST(ImpedanceProxy, ImplicitDampingSolvesItsEquation) {
  std::mt19937_64 generator(7);
  std::printf("seed 7\n");
  std::uniform_real_distribution<> along(-2e-3, 2e-3);
  Wall<2> wall(Vec2::UnitY(), 0.3);
  ImpedanceProxy<2> proxy(config(ImpedanceLaw::implicit), wall);
  Vec2 p1 = Vec2::Zero(), q1 = Vec2::Zero(), p = Vec2::Zero();
  for (int k = 0; k < 10000; ++k) {
    p += Vec2(along(generator), along(generator));
    p *= 0.9;
    ASSERT_EQ(proxy.step(p), ProxyFault::none);
    const Vec2 q = proxy.q(), f = proxy.f();
    ASSERT_LT((f - (750.0 * (q - p) + 8.0 * ((q - q1) - (p - p1)) / 1e-3)).norm(), 1e-10);
    ASSERT_GE(q.y(), 0.0);
    ASSERT_GE(f.y(), -1e-12);
    ASSERT_LE(std::abs(f.x()), 0.3 * f.y() + 1e-11);
    p1 = p;
    q1 = q;
  }
}

TEST(ImpedanceProxy, RefusesAPositionThatIsNoNumber) {
  Wall<1> wall(Vec1::Ones(), 0.0);
  ImpedanceProxy<1> proxy(config(ImpedanceLaw::implicit), wall);
  ASSERT_EQ(proxy.step(Vec1(-1e-3)), ProxyFault::none);
  const Vec1 f = proxy.f();
  EXPECT_EQ(proxy.step(Vec1(std::numeric_limits<double>::quiet_NaN())), ProxyFault::input_not_finite);
  EXPECT_EQ(proxy.step(Vec1(-1e308)), ProxyFault::result_not_finite);
  EXPECT_EQ(proxy.f(), f);
  EXPECT_FALSE(proxy.start(Vec1(std::numeric_limits<double>::infinity())));
  EXPECT_THROW((ImpedanceProxy<1>({.stiffness_N_per_m = 0.0}, wall)), description::SetupError);
  EXPECT_THROW((ImpedanceProxy<1>({.damping_Ns_per_m = -1.0}, wall)), description::SetupError);
}

}  // namespace
}  // namespace proxarm::controller
