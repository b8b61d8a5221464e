// Guides without objects; those among objects: guide_among_objects_test.cpp.
#include <gtest/gtest.h>

#include "models/world/guides.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

TEST(Guides, LineHoldsAcrossAndSlidesAlong) {
  auto g = PolylineGuide::line({0, 0, 1}, {2, 0, 0}, 0.2);
  EXPECT_EQ(g(1.0, {5, 3, 5}, {0, 0, 1}), Vec3(4, 0, 1));    // 5 across, so 1 of friction
  EXPECT_EQ(g(1.0, {0.9, 3, 5}, {0, 0, 1}), Vec3(0, 0, 1));  // holds
  EXPECT_EQ(g(1.0, {-5, 3, 5}, {0, 0, 1}), Vec3(-4, 0, 1));
}

TEST(Guides, PolylineTurnsItsCorners) {
  PolylineGuide g({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, false, 0.0);
  EXPECT_LE((g(1.0, {0.5, 3, 0}, {0.2, 0, 0}) - Vec3(0.5, 0, 0)).norm(), 1e-15);
  EXPECT_LE((g(1.0, {1.5, 0.5, 0}, {0.2, 0, 0}) - Vec3(1, 0.5, 0)).norm(), 1e-15);  // around the corner
  EXPECT_LE((g(1.0, {1.5, -0.5, 0}, {0.2, 0, 0}) - Vec3(1, 0, 0)).norm(), 1e-15);   // held in it
  EXPECT_LE((g(1.0, {1.5, 2.5, 0}, {0.2, 0, 0}) - Vec3(1, 1, 0)).norm(), 1e-15);    // the end
  EXPECT_LE((g(1.0, {-1, 0.2, 0}, {1, 0.5, 0}) - Vec3(1, 0.2, 0)).norm(), 1e-15);   // doesn't jump to the other leg
  EXPECT_LE((g(1.0, {-1, -0.2, 0}, {1, 0.5, 0}) - Vec3(0, 0, 0)).norm(), 1e-15);    // and back to the beginning
  PolylineGuide closed({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, true, 0.0);
  EXPECT_LE((closed(1.0, {0.4, 1.4, 0}, {1, 0.5, 0}) - Vec3(0.9, 0.9, 0)).norm(), 1e-15);
}

TEST(Contract, Guides) {
  ContractOptions<3> options;
  options.forces_without_contact = true;
  options.scene_m = 0.4;
  expect_contract<3>(PolylineGuide::line({0.1, 0.2, 0.3}, {1, 2, 3}, 0.3), options);
  expect_contract<3>(PlaneGuide({0.1, 0.2, 0.3}, {1, 2, 3}, 0.3), options);
}

TEST(Guides, RefuseWhatHasNoMeaning) {
  EXPECT_THROW(PolylineGuide({{0, 0, 0}}, false, 0.0), std::invalid_argument);
  EXPECT_THROW(PolylineGuide({{0, 0, 0}, {0, 0, 0}}, false, 0.0), std::invalid_argument);
  EXPECT_THROW(PolylineGuide::line({0, 0, 0}, {0, 0, 0}, 0.0), std::invalid_argument);
  EXPECT_THROW(PlaneGuide({0, 0, 0}, {0, 0, 1}, -1.0), std::invalid_argument);
}

}  // namespace
}  // namespace proxarm::tests
