// Equation (3), dry friction everywhere.
#include <gtest/gtest.h>

#include <limits>

#include "models/surfaces/coulomb_field.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using models::CoulombField;
using models::Vec3;

TEST(Contract, CoulombField) {
  expect_contract<1>(CoulombField<1>(2.0), {.forces_without_contact = true});
  expect_contract<2>(CoulombField<2>(2.0), {.forces_without_contact = true});
  expect_contract<3>(CoulombField<3>(2.0), {.forces_without_contact = true});
}

TEST(CoulombField, IsEquation3) {
  CoulombField<3> g(2.0);
  EXPECT_EQ(g(1.0, {2, 0, 0}, Vec3::Zero()), Vec3::Zero());
  EXPECT_EQ(g(1.0, {3, 0, 0}, Vec3::Zero()), Vec3(1, 0, 0));
}

// Coordinates and stiffnesses from the least to the largest that doubles hold give finite results.
TEST(CoulombField, HoldsAtTheEdgesOfDoubles) {
  CoulombField<3> g(1.0);
  const double tiny = std::numeric_limits<double>::denorm_min();
  for (const double K : {1e-12, 1.0, 1e12}) {
    for (const double x : {0.0, tiny, 1e-300, 1e-160, 1e-9, 1.0, 1e9}) {
      for (const double z : {0.0, -0.0, tiny, -tiny, -1e-300, -1e-160, -1e-9, -1.0, -1e9}) {
        EXPECT_TRUE(g(K, {x, 0, z}, Vec3::Zero()).allFinite());
      }
    }
  }
  EXPECT_EQ(g(1.0, Vec3::Zero(), Vec3::Zero()), Vec3::Zero());
}

TEST(CoulombField, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(CoulombField<3>(0.0), std::invalid_argument);
  EXPECT_THROW(CoulombField<3>{std::numeric_limits<double>::infinity()}, std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::tests
