// What is known beforehand of where a solid and a mesh are changes nothing of how deep it stands in it.
#include "models/rigid_features/mesh_overlap.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "models/base/random.hpp"
#include "models/rigid_features/near_faces.hpp"
#include "models/rigid_shapes/cylinder.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"

namespace proxarm::models {
namespace {

Bounds box_of(const Solid& solid) {
  Bounds box;
  for (int k = 0; k < 3; ++k) {
    box.low[k] = -extent_along(solid, -Vec3::Unit(k)) + solid.radius;
    box.high[k] = extent_along(solid, Vec3::Unit(k)) - solid.radius;
  }
  return box;
}

Solid random_solid(Random& random) {
  switch (random.below(4)) {
    case 0:
      return solid_of(BoxTool{Vec3(random.uniform(0.001, 0.02), 0.01, 0.02)}, Pose::Identity());
    case 1:
      return solid_of(CapsuleTool{0.02, 0.003}, Pose::Identity());
    case 2:
      return solid_of(SphereTool{0.004}, Pose::Identity());
    default: {
      ConvexTool tool;
      for (int i = 0; i < 30; ++i) tool.points_m.push_back(0.01 * random.direction());
      return solid_of(tool, Pose::Identity());
    }
  }
}

// A few steps on the surface, so that some poses stand in it and some don't.
View random_pose_at(Random& random, double radius) {
  View at;
  at.R = Eigen::AngleAxisd(random.uniform(0.0, 3.0), random.direction()).toRotationMatrix();
  at.x = random.uniform(0.9, 1.9) * radius * random.direction();
  return at;
}

TEST(MeshOverlap, IsTheSameByTrianglesAndPlanesThatAreKnown) {
  constexpr double enough = -1e-12, reach = 2e-3;
  Random random(11);
  int in = 0, out = 0;
  for (int run = 0; run < 60; ++run) {
    const TriangleFeatures features(std::make_shared<const TriangleMesh>(tests::globe(
        15, 24, [](double theta, double phi) { return 0.02 * (1.0 + 0.2 * std::sin(3.0 * theta) * std::cos(phi)); })));
    const Solid solid = random_solid(random);
    const Bounds box = box_of(solid);
    const View begun = random_pose_at(random, 0.02);
    const NearFaces close(solid, box, features, 1.0, begun, reach, 0.1, NearFaces::most_faces);
    ASSERT_TRUE(close.all());
    PlanesBetween last;
    last.count = 0;
    for (int step = 0; step < 20; ++step) {
      View at = begun;  // by no more than the triangles are known for
      at.x += random.uniform(0.0, reach) * random.direction();
      const std::vector<Vec3> any{random.direction(), -at.x.normalized(), random.direction()};
      const double known =
          overlap_with_mesh(solid, box, features.mesh(), at, false,
                            {.enough = enough, .normals = any, .last = &last, .triangles = close.faces()});
      EXPECT_EQ(known, overlap_with_mesh(solid, box, features.mesh(), at, false, {.enough = enough}))
          << "run " << run << ", step " << step;
      (known < enough ? in : out) += 1;
    }
  }
  EXPECT_GT(in, 200);
  EXPECT_GT(out, 200);
}

TEST(MeshOverlap, PlanesAreThoseOfTheSamePartAndObject) {
  LastPlanes last;
  last.of(0, 1).normals[0] = Vec3::UnitX();
  last.of(0, 1).count = 1;
  EXPECT_EQ(last.of(0, 1).count, 1U);
  EXPECT_EQ(last.of(1, 0).count, 0U);
  for (std::uint16_t other = 0; other < 20; ++other) EXPECT_EQ(last.of(7, other).count, 0U);
  EXPECT_EQ(last.of(0, 1).count, 0U) << "it went where there was no room";
}

}  // namespace
}  // namespace proxarm::models
