// A step of a rigid tool allocates nothing and throws nothing.
#include <gtest/gtest.h>

#include "models/base/random.hpp"
#include "models/local_problem/contact_problem.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/allocation_count.hpp"

namespace proxarm::models {
namespace {

template <typename Type>
Type& any() noexcept;

static_assert(noexcept(any<RigidWorld>().step(any<const Mat6>(), any<const ToolPose>(), any<const ToolPose>())));
static_assert(noexcept(any<RigidWorld>().copy_state(any<const RigidWorld>())));
static_assert(noexcept(any<ContactProblem>().set_stiffness(any<const Mat6>())));
static_assert(noexcept(any<ContactProblem>().solve(any<const Twist>(), std::span<LinearContact>(), any<Twist>())));

TEST(RigidWorld, StepsAndCopiesWithoutAllocating) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  std::vector<RigidObject> objects(4);
  objects[0].shape = FlatSide{Vec3::UnitZ(), 0.0};
  objects[1].shape = solid_of(BoxTool{Vec3::Constant(0.06)}, isometry({{0.05, 0.0, 0.0}, Quaternion::Identity()}));
  objects[2].shape = solid_of(CapsuleTool{0.1, 0.02}, isometry({{-0.05, 0.0, 0.01}, Quaternion::Identity()}));
  objects[3].shape = HollowSphere{Vec3::Zero(), 0.15};
  for (RigidObject& object : objects) object.friction = 0.3;
  objects[2].motion.emplace().script = {.amplitude_m = {0.02, 0.0, 0.01}, .frequency_Hz = 3.0, .turn_rad_per_s = 2.0};
  RigidWorld g({{{BoxTool{{0.02, 0.03, 0.02}}, Pose::Identity(), {}}}}, std::move(objects));
  const std::unique_ptr<PoseAlgorithm> other = g.clone();
  Random random(17);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(4e3);
  ToolPose q;
  q.position.z() = 0.1;
  std::size_t contacts = 0;
  const std::uint64_t before = tests::allocation_count();
  for (int k = 0; k < 5000; ++k) {
    Twist way;
    way << random.log_arrow(1e-7, 5e-3), random.log_arrow(1e-7, 5e-2);
    way.z() -= 1e-4;
    g.set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
    q = g.step(K, moved(q, way), q);
    contacts += g.contacts().size();
    if (k % 100 == 0) other->copy_state(g);
  }
  EXPECT_EQ(tests::allocation_count() - before, 0U);
  EXPECT_GT(contacts, 1000U);
  other->copy_state(g);
  const ToolPose p = moved(q, Twist::Constant(1e-4));
  EXPECT_EQ(other->step(K, p, q), g.step(K, p, q));
}

}  // namespace
}  // namespace proxarm::models
