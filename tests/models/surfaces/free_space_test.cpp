// 𝒢 of a world without anything.
#include <gtest/gtest.h>

#include "models/surfaces/free_space.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using models::FreeSpace;
using models::Vec3;

TEST(FreeSpace, LetsTheProxyGo) {
  FreeSpace<3> g;
  const Vec3 p(0.1, 0.2, 0.3);
  EXPECT_EQ(g(1.0, p, Vec3::Zero()), p);
  EXPECT_TRUE(g.contacts().empty());
}

TEST(Contract, FreeSpace) { expect_contract<3>(FreeSpace<3>(), {.friction = {0.0}}); }

}  // namespace
}  // namespace proxarm::tests
