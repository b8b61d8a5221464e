// Equation (2), a wall without friction.
#include <gtest/gtest.h>

#include <limits>

#include "models/surfaces/plane.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using models::Plane;
using models::Vec;
using models::Vec3;

TEST(Contract, Plane) {
  expect_contract<1>(Plane<1>(Vec<1>(0.25), Vec<1>(-1.0)), {.friction = {0.0}});
  expect_contract<2>(Plane<2>({0.1, -0.2}, {1.0, 2.0}), {.friction = {0.0}});
  expect_contract<3>(Plane<3>({0.1, -0.2, 0.3}, {1.0, 2.0, -0.5}), {.friction = {0.0}});
}

TEST(Plane, IsEquation2) {
  Plane<3> g(Vec3::Zero(), Vec3::UnitZ());
  EXPECT_EQ(g(1.0, {1, 2, 3}, Vec3::Zero()), Vec3(1, 2, 3));
  EXPECT_TRUE(g.contacts().empty());
  EXPECT_EQ(g(1.0, {1, 2, -3}, Vec3::Zero()), Vec3(1, 2, 0));
  ASSERT_EQ(g.contacts().size(), 1u);
  EXPECT_EQ(g.contacts()[0].normal, Vec3(Vec3::UnitZ()));
}

TEST(Plane, RefusesWhatHasNoMeaning) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Plane<3>(Vec3::Zero(), Vec3::Zero()), std::invalid_argument);
  EXPECT_THROW(Plane<3>(Vec3::Zero(), Vec3(nan, 0, 1)), std::invalid_argument);
  EXPECT_THROW(Plane<3>(Vec3(0, inf, 0), Vec3::UnitX()), std::invalid_argument);
  EXPECT_NO_THROW(Plane<3>(Vec3::Zero(), Vec3(1e-300, 1e-300, 0)));  // small, but with a direction
  EXPECT_NO_THROW(Plane<3>(Vec3::Zero(), Vec3(1e300, 1e300, 0)));
}

}  // namespace
}  // namespace proxarm::tests
