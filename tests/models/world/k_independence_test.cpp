// Independence of K at a million random states of each object and of flat compositions.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "models/mesh/mesh_surface.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/cylinder_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "models/world/world.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {
namespace {

using namespace models;  // NOLINT: the whole folder is under test

template <typename... Obstacles>
World together(Obstacles&&... obstacles) {
  std::vector<World::Entry> entries;
  (entries.push_back({std::make_unique<std::decay_t<Obstacles>>(std::forward<Obstacles>(obstacles)),
                      static_cast<std::int32_t>(entries.size()), -1}),
   ...);
  return World(std::move(entries));
}

// Small against the radii, as in obstacle_test.cpp; `several` as counted there.
ContractOptions<3> options(std::vector<double> friction, double several = 0.0, double decades = 6.0) {
  ContractOptions<3> out;
  out.seed = 1001;
  out.friction = std::move(friction);
  out.size_m = out.reach_m = 0.02;
  out.kappa_decades = decades;
  out.condition = 4.0;
  out.several = several;
  return out;
}

const Vec3 middle(0.1, 0.2, 0.3);

TEST(KIndependence, Plane) {
  expect_independent_of_K<3>(FrictionPlane<3>(middle, Vec3(1, 2, 3), 0.3), options({0.3}));
  expect_independent_of_K<2>(FrictionPlane<2>({0.1, 0.2}, {1, 2}, 0.3), {.size_m = 0.02, .reach_m = 0.02});
  expect_independent_of_K<1>(FrictionPlane<1>(Vec<1>(0.1), Vec<1>(1.0), 0.0), {.size_m = 0.02, .reach_m = 0.02});
}
TEST(KIndependence, Groove) {
  expect_independent_of_K<3>(PlaneComposition({Face{FlatSurface<3>(middle, Vec3(1, 0, 1)), 0.3, 0},
                                               Face{FlatSurface<3>(middle, Vec3(-1, 0.1, 1)), 0.2, 1}}),
                             options({0.3, 0.2}, 2e-3));
}
TEST(KIndependence, Corner) {
  expect_independent_of_K<3>(PlaneComposition({Face{FlatSurface<3>(middle, Vec3(1, 0.1, 0)), 0.3, 0},
                                               Face{FlatSurface<3>(middle, Vec3(0, 1, 0.1)), 0.2, 1},
                                               Face{FlatSurface<3>(middle, Vec3(0.1, 0, 1)), 0.1, 2}}),
                             options({0.3, 0.2, 0.1}, 2e-3));
}
TEST(KIndependence, Sphere) {
  expect_independent_of_K<3>(together(Sphere(PointCore{middle}, 0.3, 0.3, false)), options({0.3}));
}
TEST(KIndependence, SphereFromInside) {
  expect_independent_of_K<3>(together(Sphere(PointCore{middle}, 0.3, 0.3, true)), options({0.3}));
}
TEST(KIndependence, Capsule) {
  expect_independent_of_K<3>(together(Capsule(SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, 0.3, false)), options({0.3}));
}
TEST(KIndependence, CapsuleFromInside) {
  expect_independent_of_K<3>(together(Capsule(SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, 0.3, true)), options({0.3}));
}
TEST(KIndependence, Cylinder) {
  expect_independent_of_K<3>(together(CylinderObstacle(Vec3(0, 0, -0.2), Vec3(0.1, 0, 0.2), 0.25, 0.3)),
                             options({0.3}, 2e-3));
}
TEST(KIndependence, Box) {
  Pose X = Pose::Identity();
  X.translation() = middle;
  X.linear() = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  expect_independent_of_K<3>(together(BoxObstacle(X, Vec3(0.4, 0.5, 0.6), 0.3)), options({0.3}, 2e-3));
}
TEST(KIndependence, TwoBallsOnAPlane) {
  ContractOptions<3> states = options({0.3, 0.2, 0.1}, 6e-3);
  states.unresolved = 1e-4;
  expect_independent_of_K<3>(
      together(Sphere(PointCore{Vec3(-0.25, 0, 0)}, 0.3, 0.3, false),
               Sphere(PointCore{Vec3(0.25, 0, 0)}, 0.3, 0.2, false), PlaneObstacle(Vec3::Zero(), Vec3::UnitZ(), 0.1)),
      states);
}
TEST(KIndependence, BoxOnATiltedPlane) {
  expect_independent_of_K<3>(together(BoxObstacle(Pose::Identity(), Vec3::Constant(0.4), 0.3),
                                      PlaneObstacle(Vec3::Zero(), Vec3(0.0, 0.1, 1.0), 0.2)),
                             options({0.3, 0.2}, 6e-3));
}
TEST(KIndependence, MeshOfABall) {
  expect_independent_of_K<3>(MeshSurface(std::make_shared<const TriangleMesh>(ball(3, 0.5)), 0.3),
                             options({0.3}, 6e-3, 2.0));
}
TEST(KIndependence, MeshOfABlock) {
  expect_independent_of_K<3>(MeshSurface(std::make_shared<const TriangleMesh>(block({0.8, 0.9, 1.0})), 0.3),
                             options({0.3}, 6e-3, 2.0));
}

}  // namespace
}  // namespace proxarm::tests
