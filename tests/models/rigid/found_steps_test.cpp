// Single steps in which long hunts (rigid_hunt_test.cpp) found the law broken, put again in a world that knows nothing
// of the steps before.
#include <gtest/gtest.h>

#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid/rigid_bodies.hpp"

namespace proxarm::models {
namespace {

RigidObject object_of(const Body& body, double friction) {
  RigidObject object;
  object.shape = solid_of_body(body);
  object.friction = friction;
  return object;
}

Mat6 isotropic(double moving, double turning) {
  Vec<6> d;
  d << Vec3::Constant(moving), Vec3::Constant(turning);
  return d.asDiagonal();
}

// At q nothing that is linearised comes into the way to p̂, which overlaps the sphere nevertheless, by 0.25 µm: the
// corner's way bends by 5 µm. The first solution from p̂ on was taken for the end, since a ratio of two steps was formed
// with the way to p̂ for the first one: the box ended 4.4 pm inside. (Seed 3000082, step 375; the same in seeds 1000923,
// 38 pm, and 4000211, 9.6 pm.)
TEST(FoundSteps, ACornerThatMeetsASphereOnlyBecauseItsWayBendsEndsOutside) {
  Body box, sphere;
  box.size = 2.0 * Vec3(0.011860248617865806, 0.023881659106615456, 0.01604255699098003);
  sphere.radius = 0.040017335838155033;
  sphere.X.translation() = Vec3(-0.016663938223844779, -0.067422628583835298, -0.066221635938443907);
  const ToolPose q{{-0.075249222003986815, -0.065895111368829015, -0.086817522815570855},
                   {0.19446232570931679, -0.50419829981748532, -0.18874941637096959, 0.81996471641193147}};
  const ToolPose p{{-0.07507030076630089, -0.065786603395671606, -0.086707124503781527},
                   {0.19232871118850198, -0.5060221292989231, -0.19259057949751268, 0.81844983975877605}};
  RigidWorld g({{{BoxTool{box.size}, Pose::Identity(), {}}}}, {object_of(sphere, 0.0)});
  ASSERT_GT(apart(at(box, isometry(q)), sphere), 0.0);
  const ToolPose r = g.step(isotropic(9693897.9204888009, 605.5680293321052), p, q);
  EXPECT_FALSE(g.unresolved());
  EXPECT_EQ(g.contacts().size(), 1U);
  EXPECT_GE(apart(at(box, isometry(r)), sphere), -1e-16);  // rounding of coordinates of 0.1 m
}

// A key half out of its slot's end touches a side wall, 335 µm behind the wall's end face. The crossing of its edge
// with the wall's edge, on which its corner lies to within rounding, was taken for one that holds it: the step pushed
// it out of the slot by those 335 µm, with 305 N, and gave it 0.09 J. (Seed 1000533, step 1391.)
TEST(FoundSteps, AKeyBesideAWallIsNotPushedOutOverTheWallsEnd) {
  Body key, wall;
  key.size = 2.0 * Vec3(0.0075323861709292173, 0.0024264703963860264, 0.010419470181140629);
  wall.size = Vec3(0.1, 0.03, 0.1);
  wall.X.translation().y() = 0.0024328668981599341 + 0.015;
  const ToolPose q{{-0.0065149006457427524, 6.3965017739085691e-06, -0.062428675608864143},
                   {0.96824374174630667, 2.8596420078603274e-17, 0.25000811300658127, 1.1575326504295778e-16}};
  const ToolPose p{{-0.0065346446786722799, 6.3965017739085742e-06, -0.062696794425656149},
                   {0.96789291182622228, 2.8846487637260257e-17, 0.25136290743973527, 1.1650612660745028e-16}};
  RigidWorld g({{{BoxTool{key.size}, Pose::Identity(), {}}}}, {object_of(wall, 0.53236391878817424)});
  ASSERT_LT(apart(at(key, isometry(p)), wall), 1e-15) << "or else nothing is touched";
  const ToolPose r = g.step(isotropic(4566085.7909124661, 184.17976171027158), p, q);
  EXPECT_FALSE(g.unresolved());
  EXPECT_LE(difference(r, p).norm(), 1e-15);
  EXPECT_GE(apart(at(key, isometry(r)), wall), -1e-16);
}

}  // namespace
}  // namespace proxarm::models
