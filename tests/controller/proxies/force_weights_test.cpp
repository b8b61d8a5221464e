#include "controller/proxies/force_weights.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "controller/proxies/admittance_proxy.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/world/media.hpp"
#include "tests/controller/rendering/small_worlds.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::controller {
namespace {

using models::Vec;
using models::Vec3;
using testing::DryFriction;
using testing::InsideBall;
using testing::Wall;
using tests::Random;
using tests::scaled;
using Vec1 = Vec<1>;
using Vec2 = Vec<2>;

// Counts the calls.
template <int N>
class Counted final : public models::GeometricAlgorithm<N> {
 public:
  explicit Counted(models::GeometricAlgorithm<N>& inner) : inner_(inner) {}
  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    ++calls;
    return inner_(K, p, q);
  }
  [[nodiscard]] bool wants_time() const noexcept override { return inner_.wants_time(); }
  void set_time(const models::StepTime& time) noexcept override { inner_.set_time(time); }
  [[nodiscard]] std::span<const models::Contact<N>> contacts() const noexcept override { return inner_.contacts(); }
  int calls = 0;

 private:
  models::GeometricAlgorithm<N>& inner_;
};

class TimelessBall final : public InsideBall<2> {
 public:
  using InsideBall<2>::InsideBall;
  [[nodiscard]] bool wants_time() const noexcept override { return false; }
};

// A slide along the inside of a ball asks 𝒢 once a step, however it turns; at first, too.
TEST(ForceWeights, AsksTheWorldOnceAStep) {
  const double R = 0.1, v = 0.5;
  TimelessBall ball(R);
  Counted<2> counted(ball);
  AdmittanceProxy<2> proxy({.mass_kg = 1.0, .order = 2}, counted);
  ASSERT_TRUE(
      proxy.start({.q = Vec2(R, 0.0), .v = Vec2(0.0, v), .a = Vec2(-v * v / R, 0.0), .contact_established = true}));
  counted.calls = 0;
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(proxy.step(Vec2::Zero()), ProxyFault::none);
  EXPECT_EQ(counted.calls, 1000);
  EXPECT_EQ(proxy.first_order_steps(), 0u);
}

// A wall that is pressed by 2 to 8 N of noise holds the proxy bit for bit, whatever the weights make of the noise, and
// says the force that it holds it with.
TEST(ForceWeights, DoesNotBounceBecauseOfNoise) {
  Random random(201);
  Wall<1> wall(Vec1::Ones(), 0.0);
  AdmittanceProxy<1> proxy({.mass_kg = 2.0, .order = 2}, wall);
  ASSERT_TRUE(proxy.start({.q = Vec1(0.003), .v = Vec1(-0.2)}));
  for (std::int64_t k = 0; k < scaled(20000); ++k) {
    const double h = -5.0 + random.uniform(-3.0, 3.0);
    ASSERT_EQ(proxy.step(Vec1(h)), ProxyFault::none);
    if (k < 20) continue;
    ASSERT_EQ(proxy.q()[0], 0.0) << k;
    // Störmer's correction adds at most (|h₀| + 2|h₁| + |h₂|)/12 of what the noise is.
    ASSERT_NEAR(proxy.f()[0], -h, 4.0 * 3.0 / 12.0 + 1e-9) << k;
  }
}

// Runs against noise in a ball, where the proxy slides and the weights act: it never gains height above the surface by
// more than (26) would in one step, and the energy that is left is no more than what the hand put in.
TEST(ForceWeights, KeepsToACurvedSurfaceUnderNoise) {
  Random random(202);
  for (std::int64_t run = 0; run < scaled(20); ++run) {
    const double R = 0.1, M = 1.0, T = 1e-3;
    TimelessBall ball(R);
    AdmittanceProxy<2> proxy({.mass_kg = M, .period_s = T, .order = 2}, ball);
    ASSERT_TRUE(
        proxy.start({.q = Vec2(R, 0.0), .v = Vec2(0.0, 0.3), .a = Vec2(-0.9, 0.0), .contact_established = true}));
    double work = 0.0;
    for (int k = 0; k < 5000; ++k) {
      const Vec2 out = proxy.q().normalized(), h = 5.0 * out + random.in_box<2>(3.0);
      const Vec2 before = proxy.q();
      ASSERT_EQ(proxy.step(h), ProxyFault::none);
      work += h.dot(proxy.q() - before);
      ASSERT_LE(proxy.q().norm(), R * (1.0 + 1e-15));
      ASSERT_GE(proxy.q().norm(), R - 8.0 * T * T / M);
    }
    // Rounds of noise of 3 N: each step's work is taken at its end, which is T h²/(2M) more than at its middle.
    EXPECT_LT(0.5 * M * proxy.velocity().squaredNorm(), 0.5 * M * 0.09 + std::abs(work) + 0.05) << run;
  }
}

// Friction on a path that turns acts against the velocity at the step's end, not against that in its middle: the error
// falls by four with half the timestep, where (26)'s falls by two.
TEST(ForceWeights, IsOfSecondOrderWhereFrictionTurns) {
  const auto end_of = [](int order, int steps) {
    const double T = 0.2 / steps;
    Wall<3> wall(Vec3::UnitZ(), 0.3);
    AdmittanceProxy<3> proxy({.mass_kg = 1.0, .period_s = T, .order = order}, wall);
    const Vec3 h(0.0, 3.0, -5.0), v(0.5, 0.0, 0.0);
    EXPECT_TRUE(proxy.start({.q = Vec3::Zero(), .v = v, .a = Vec3(-1.5, 3.0, 0.0), .contact_established = true}));
    for (int k = 0; k < steps; ++k) EXPECT_EQ(proxy.step(h), ProxyFault::none);
    return proxy.q();
  };
  const Vec3 exact = end_of(2, 51200);
  const auto error = [&](int order, int steps) { return (end_of(order, steps) - exact).norm(); };
  std::printf("order 1: %.2e, order 2: %.2e m\n", error(1, 400), error(2, 400));
  EXPECT_NEAR(error(1, 200) / error(1, 400), 2.0, 0.2);
  EXPECT_NEAR(error(2, 200) / error(2, 400), 4.0, 0.5);
  EXPECT_LT(error(2, 400), 0.05 * error(1, 400));
}

// Into a viscous half-space at 0.4 m/s, from a hundred places within a step: x = v/b (1 − exp(−bt)) from the border on.
double worst_behind_a_border(int order, double T) {
  const double b = 8.0, v = 0.4, end = 0.3;
  double worst = 0.0;
  for (int phase = 0; phase < 100; ++phase) {
    std::vector<models::Medium> media;
    media.push_back({b, 0.0, std::make_unique<models::PlaneObstacle>(Vec3::Zero(), Vec3(-Vec3::UnitX()), 0.0)});
    models::Media<3> g(std::make_unique<models::FreeSpace<3>>(), std::move(media), T);
    AdmittanceProxy<3> proxy({.mass_kg = 1.0, .period_s = T, .order = order}, g);
    const double enters = (3.0 + phase / 100.0) * T;
    EXPECT_TRUE(proxy.start({.q = Vec3(-v * enters, 0.1, 0.2), .v = Vec3(v, 0.0, 0.0)}));
    for (int k = 1; k * T < end; ++k) {
      EXPECT_EQ(proxy.step(Vec3::Zero()), ProxyFault::none);
      const double t = k * T - enters;
      const double exact = t < 0.0 ? v * t : v / b * (1.0 - std::exp(-b * t));
      worst = std::max(worst, std::abs(proxy.q().x() - exact));
    }
  }
  return worst;
}

TEST(ForceWeights, CutsItsStepAtTheBorderOfAMedium) {
  const double coarse = worst_behind_a_border(2, 4e-3), fine = worst_behind_a_border(2, 2e-3);
  std::printf("4 ms: %.2e m, 2 ms: %.2e m; (26): %.2e m\n", coarse, fine, worst_behind_a_border(1, 2e-3));
  EXPECT_GT(coarse / fine, 3.5);
  EXPECT_LT(fine, 0.01 * worst_behind_a_border(1, 2e-3));
}

// A ramp of 4 N/s lets friction of 2 N go at 0.5 s; from there x = r t³/(6M). Twenty phases.
TEST(ForceWeights, FindsTheMomentAtWhichFrictionLetsGo) {
  const auto worst = [](int order, double T) {
    const double r = 4.0, M = 1.0, F = 2.0;
    double most = 0.0;
    for (int phase = 0; phase < 20; ++phase) {
      DryFriction<1> field(F);
      AdmittanceProxy<1> proxy({.mass_kg = M, .period_s = T, .order = order}, field);
      const double begin = T * phase / 20.0;
      EXPECT_TRUE(proxy.start({.contact_established = true}));
      for (int k = 0; k * T < 1.0; ++k) {
        const double t = begin + k * T;
        EXPECT_EQ(proxy.step(Vec1(r * t)), ProxyFault::none);
        const double slid = std::max(0.0, t + T - F / r);
        most = std::max(most, std::abs(proxy.q()[0] - r * slid * slid * slid / (6.0 * M)));
      }
    }
    return most;
  };
  std::printf("(26): %.2e m, order 2: %.2e m\n", worst(1, 2e-3), worst(2, 2e-3));
  EXPECT_LT(worst(2, 2e-3), 0.1 * worst(1, 2e-3));
  EXPECT_NEAR(worst(1, 4e-3) / worst(1, 2e-3), 4.0, 0.6);
  EXPECT_GT(worst(2, 4e-3) / worst(2, 2e-3), 5.0);
}

// What was archived in the midst of an event goes on to the bit.
TEST(ForceWeights, GoesOnFromAnArchive) {
  Random random(203);
  Wall<3> wall(Vec3::UnitZ(), 0.3), other_wall(Vec3::UnitZ(), 0.3);
  AdmittanceProxy<3> proxy({.mass_kg = 1.0, .order = 2}, wall), copy({.mass_kg = 1.0, .order = 2}, other_wall);
  ASSERT_TRUE(proxy.start({.q = Vec3(0.0, 0.0, 0.01), .v = Vec3(0.2, 0.0, -0.3)}));
  std::array<std::byte, 4096> bytes{};
  for (int k = 0; k < 400; ++k) {
    auto out = fieldbus::StateArchive::writer(bytes);
    proxy.archive(out);
    ASSERT_TRUE(out.whole());
    auto in = fieldbus::StateArchive::reader(bytes);
    copy.archive(in);
    const Vec3 h = Vec3(2.0 * std::sin(0.1 * k), 1.0, -4.0) + random.in_box<3>(k % 50 < 10 ? 6.0 : 0.0);
    ASSERT_EQ(proxy.step(h), ProxyFault::none);
    ASSERT_EQ(copy.step(h), ProxyFault::none);
    ASSERT_EQ(proxy.q(), copy.q()) << k;
    ASSERT_EQ(proxy.f(), copy.f()) << k;
  }
}

}  // namespace
}  // namespace proxarm::controller
