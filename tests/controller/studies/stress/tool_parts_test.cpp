#include "controller/extras/studies/stress/tool_parts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::studies {
namespace {

using models::PoseAlgorithm;
using models::PoseContact;
using models::ToolPose;
using models::Vec3;

constexpr double stiffness_N_per_m = 1e5, slope = 0.5 * M_PI_2;

// A point that something flat holds.
class PointWorld : public PoseAlgorithm {
 public:
  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override { return {&contact_, count_}; }
  [[nodiscard]] double clearance_m(const ToolPose& /*pose*/) const noexcept override { return 0.0; }
  void copy_state(const PoseAlgorithm& /*other*/) noexcept override {}

 protected:
  // By so much off p̂ along the contact's normal.
  void lie(const ToolPose& p_hat, double off_m) noexcept {
    q_ = p_hat;
    q_.position += off_m * contact_.normal_W;
    contact_.force_W = stiffness_N_per_m * off_m * contact_.normal_W;
    contact_.point_W = q_.position;
  }
  ToolPose q_;
  PoseContact contact_;
  std::size_t count_ = 1;
};

// A point on a table that ends at x = 0 in a slope of 45°, with its faults.
struct Table final : PointWorld {
  double early_m = 0.0;    // before the edge, where it jumps onto the slope
  double springs_m = 0.0;  // off the slope, and is held there
  bool stuck = false;      // no solution beyond the edge
  // From where p̂ goes by more than this, another slope is found, or no solution.
  double far_m = 1.0, other_slope = slope;
  bool stuck_far = false;

  const ToolPose& step(const models::Mat6& /*K*/, const ToolPose& p_hat, const ToolPose& q) noexcept override {
    const double x = p_hat.position.x();
    const bool over = x > -early_m, far = x - q.position.x() > far_m;
    const double angle = far ? other_slope : slope;
    contact_.normal_W = over ? Vec3(std::sin(angle), 0.0, std::cos(angle)) : Vec3(Vec3::UnitZ());
    const double off_m = (over ? springs_m : 0.0) - contact_.normal_W.dot(p_hat.position);
    lie(p_hat, off_m);
    count_ = off_m > 0.0 ? 1 : 0;
    if (count_ == 0) q_ = p_hat;
    unresolved_ = over && (stuck || (far && stuck_far));
    return q_;
  }
  [[nodiscard]] bool unresolved() const noexcept override { return unresolved_; }
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override { return std::make_unique<Table>(*this); }

 private:
  bool unresolved_ = false;
};

// A point on a table whose edge is broken: a bevel of 45° leads from x = 0 to its side.
struct BrokenEdge final : PointWorld {
  static constexpr double bevel_m = 1e-4;  // its width and depth
  double springs_m = 0.0;                  // off the side, and is held there
  double early_m = 0.0;                    // before the bevel's end, where it jumps onto the side
  double needle_m = -1.0;                  // where p̂ comes here from over the table, it comes to lie on the edge
  double hidden_m = 0.0;                   // from nearer than this no forces are found on the bevel

  // What it lies on, or the first after it that its foot is on.
  const ToolPose& step(const models::Mat6& /*K*/, const ToolPose& p_hat, const ToolPose& q) noexcept override {
    const double diagonal = std::sqrt(0.5);
    const Vec3 &p = p_hat.position, bevel(diagonal, 0.0, diagonal);
    const Vec3 foot = p - bevel.dot(p) * bevel;
    unresolved_ = false;
    contact_.normal_W = Vec3::UnitX();
    double off_m = bevel_m + springs_m - p.x();
    if (q.position.x() <= 0.0 && p.x() <= 0.0) {
      contact_.normal_W = Vec3::UnitZ();
      off_m = -p.z();
    } else if (q.position.isZero(0.0) || (q.position.x() < 0.0 && std::abs(p.x() - needle_m) < 1e-6)) {
      q_ = ToolPose();
      contact_.normal_W = Vec3::UnitZ();
      contact_.force_W = -stiffness_N_per_m * p.z() * Vec3::UnitZ();
      contact_.point_W.setZero();
      return q_;
    } else if (q.position.x() < bevel_m && foot.x() < bevel_m - early_m) {
      contact_.normal_W = bevel;
      off_m = -bevel.dot(p);
      unresolved_ = (p - q.position).norm() < hidden_m;
    }
    lie(p_hat, off_m);
    return q_;
  }
  [[nodiscard]] bool unresolved() const noexcept override { return unresolved_; }
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override { return std::make_unique<BrokenEdge>(*this); }

 private:
  bool unresolved_ = false;
};

// On the broken edge there is a needle's point, onto which every way over it leads that comes from over the table, and
// any that is within reach.
struct Needle final : PointWorld {
  BrokenEdge around;
  std::optional<double> reach_m{};  // none: no needle
  std::size_t held_by = 2;          // contacts
  std::array<PoseContact, 2> held{};

  const ToolPose& step(const models::Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept override {
    const bool over = q.position.x() < 0.0 && p_hat.position.x() > 0.0;
    if (!reach_m || (!over && q.position.norm() > *reach_m)) {
      q_ = around.step(K, p_hat, q);
      held[0] = around.contacts()[0];
      count_ = 1;
      return q_;
    }
    q_ = ToolPose();
    for (PoseContact& contact : held) {
      contact = {};
      contact.normal_W = Vec3::UnitZ();
      contact.force_W = -0.5 * stiffness_N_per_m * p_hat.position.z() * Vec3::UnitZ();
    }
    count_ = held_by;
    return q_;
  }
  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override { return {held.data(), count_}; }
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override { return std::make_unique<Needle>(*this); }
};

// From 0.2 mm before the edge to 0.3 mm beyond it, pressed by 1 mm.
struct OverTheTable {
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.001)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  OverTheTable() {
    scenes::Object far_below;
    far_below.shape = scenes::PlaneShape{-Vec3::UnitZ(), Vec3::UnitZ()};
    scene.objects.push_back(far_below);
    call.K = stiffness_N_per_m * models::Mat6::Identity();
    call.q.position = Vec3(-2e-4, 0.0, 0.0);
    call.p.position = Vec3(3e-4, 0.0, -1e-3);
  }
  template <typename World>
  [[nodiscard]] ToolCall step_of(World world) const {
    ToolCall step = call;
    step.r = world.step(call.K, call.p, call.q);
    step.contacts.assign(world.contacts().begin(), world.contacts().end());
    return step;
  }
  // Of the step that `world` makes of it, seen by the path of `way`.
  template <typename World>
  [[nodiscard]] bool keeps(const World& world, const World& way, std::vector<PoseContact>* all = nullptr) const {
    std::vector<PoseContact> touched;
    const bool keeps = ToolParts(ToolLaws(scene, tool), way).keep(step_of(world), 0.0, 0.0, touched);
    if (all != nullptr) *all = touched;
    return keeps;
  }
  template <typename World>
  [[nodiscard]] bool keeps(const World& world) const {
    return keeps(world, world);
  }
};

TEST(ToolParts, AStepOverAnEdgeKeepsTheBoundInItsParts) {
  const OverTheTable here;
  EXPECT_TRUE(here.keeps(Table()));
}

TEST(ToolParts, WhatTouchedOnTheWayIsTold) {
  OverTheTable here;
  std::vector<PoseContact> touched;
  ASSERT_TRUE(here.keeps(Table(), Table(), &touched));
  const auto touches = [&](const Vec3& n) {
    return std::any_of(touched.begin(), touched.end(), [&](const PoseContact& c) { return c.normal_W == n; });
  };
  EXPECT_TRUE(touches(Vec3::UnitZ()));
  EXPECT_TRUE(touches(Vec3(std::sin(slope), 0.0, std::cos(slope))));
  // A step that needs no smaller parts: at seven places.
  here.call.p.position.x() = -1e-4;
  touched.clear();
  EXPECT_TRUE(here.keeps(Table(), Table(), &touched));
  EXPECT_EQ(touched.size(), 7U);
}

// It comes down at a fortieth of the way and goes over the edge at a tenth. What it is pushed by there, in the first
// eighth, is less than the curvature may give; what it is pushed by at the end, as pressed as it is then, is more.
TEST(ToolParts, WhatTouchedIsLookedForUntilItAccountsForWhatAStepGives) {
  OverTheTable here;
  here.call.q.position = Vec3(-1e-4, 0.0, 5e-5);
  here.call.p.position = Vec3(9e-4, 0.0, -1.95e-3);
  here.call.p.orientation = models::rotation_by(6.5e-3 * Vec3::UnitY());
  const ToolLaws laws(here.scene, here.tool);
  const Table table;
  const ToolParts parts(laws, table);
  const ToolCall step = here.step_of(table);
  const double pushed_J = laws.pushed_J(step, 0.0);
  ASSERT_GT(pushed_J, 0.0);
  std::vector<PoseContact> touched;
  ASSERT_TRUE(parts.keep(step, 0.0, 0.0, touched));
  EXPECT_EQ(laws.edges_J(step, touched), 0.0);
  touched.clear();
  EXPECT_TRUE(parts.keep(step, 0.0, pushed_J, touched));
  const double edges_J = laws.edges_J(step, touched);
  touched.clear();
  EXPECT_FALSE(parts.keep(step, 0.0, 1.001 * edges_J, touched));
}

// It is pushed by d sin 45° where it jumps from d before the edge. A foot may lie 1e-10 m beside its feature on both
// sides, and rounding is a thousandth of that.
TEST(ToolParts, AStepThatJumpsOverAnEdgeFromBeforeItDoesNot) {
  const OverTheTable here;
  Table world;
  world.early_m = 1.99e-10 / std::sin(slope);
  EXPECT_TRUE(here.keeps(world));
  world.early_m = 2.02e-10 / std::sin(slope);
  EXPECT_FALSE(here.keeps(world));
  world.early_m = 1e-5;
  EXPECT_FALSE(here.keeps(world));
}

// Where it springs at the edge, and where only its end does, which the world asked anew knows nothing of.
TEST(ToolParts, AStepThatSpringsDoesNot) {
  const OverTheTable here;
  Table world;
  world.springs_m = 1.99e-10;
  EXPECT_TRUE(here.keeps(world));
  EXPECT_TRUE(here.keeps(world, Table()));
  world.springs_m = 2.02e-10;
  EXPECT_FALSE(here.keeps(world));
  EXPECT_FALSE(here.keeps(world, Table()));
}

// What curvature_J() says of the step is left to jumps. At the edge, four tenths of the way, p̂ is 0.4 mm below.
TEST(ToolParts, AJumpThatPushesByLessThanCurvatureMayGiveIsNoSpring) {
  OverTheTable here;
  here.call.p.orientation = models::rotation_by(1e-3 * Vec3::UnitY());
  Table world;
  for (int k = 0; k < 20; ++k) {
    const double allowed_J = ToolLaws(here.scene, here.tool).curvature_J(here.step_of(world));
    world.springs_m = 2e-10 + allowed_J / (stiffness_N_per_m * (world.springs_m + 4e-4 * std::sin(slope)));
  }
  const double most_m = world.springs_m;
  EXPECT_GT(most_m, 1e-7);
  world.springs_m = 0.999 * most_m;
  EXPECT_TRUE(here.keeps(world));
  world.springs_m = 1.001 * most_m;
  EXPECT_FALSE(here.keeps(world));
}

// Over the table's end, pressed by 1 mm, with p̂ before the table's side.
struct OverABrokenEdge : OverTheTable {
  OverABrokenEdge() { call.p.position.x() = 0.5 * BrokenEdge::bevel_m; }
};

// It jumps over the bevel, up along the side's normal by its width.
TEST(ToolParts, AJumpOverSeveralEdgesKeepsTheBoundInItsParts) {
  const OverABrokenEdge here;
  const ToolCall step = here.step_of(BrokenEdge());
  ASSERT_EQ(step.contacts[0].normal_W, Vec3::UnitX());
  EXPECT_TRUE(here.keeps(BrokenEdge()));
}

// Where it springs at the last of them, or jumps over that one from before it.
TEST(ToolParts, AJumpThatSpringsOnItsWayDoesNot) {
  const OverABrokenEdge here;
  BrokenEdge springs, jumps;
  springs.springs_m = 1.99e-10;
  EXPECT_TRUE(here.keeps(springs));
  EXPECT_TRUE(here.keeps(springs, BrokenEdge()));
  springs.springs_m = 2.02e-10;
  EXPECT_FALSE(here.keeps(springs));
  EXPECT_FALSE(here.keeps(springs, BrokenEdge()));
  jumps.early_m = 1.99e-10;
  EXPECT_TRUE(here.keeps(jumps));
  jumps.early_m = 2.02e-10;
  EXPECT_FALSE(here.keeps(jumps));
}

// Of a way in eighths one pose is on the needle's point, and stays there, of one in thirds none.
TEST(ToolParts, AStepThatGoesByAPlaceWhereSomeOfItsWaysEndKeepsTheBoundIfOneGoesByToo) {
  const OverABrokenEdge here;
  const Vec3 &from = here.call.q.position, to = here.call.p.position;
  BrokenEdge world, springs;
  world.needle_m = from.x() + 0.875 * (to.x() - from.x());
  ToolCall eighths = here.call;
  eighths.p.position = from + 0.875 * (to - from);
  ASSERT_TRUE(world.step(here.call.K, eighths.p, here.call.q).position.isZero(0.0));
  EXPECT_TRUE(here.keeps(world));
  springs = world;
  springs.springs_m = 2.02e-10;
  EXPECT_FALSE(here.keeps(springs));
  EXPECT_FALSE(here.keeps(springs, world));
}

// A nanometre aside it falls from the point; where it falls is judged as any way is. (A nanometre at 30 mm turns a
// normal by 5e-12 m over the bevel.)
TEST(ToolParts, AStepThatGoesByAPointOnWhichAllOfItsWaysEndKeepsTheBoundIfOneFromNextToThePointLeadsThere) {
  const OverABrokenEdge here;
  Needle step, way, springs;
  way.reach_m = 0.0;
  EXPECT_TRUE(here.keeps(step, way));
  springs.around.springs_m = 2.1e-10;
  EXPECT_FALSE(here.keeps(springs, way));
  springs.reach_m = 0.0;
  EXPECT_FALSE(here.keeps(step, springs));
}

// What lies there as in a wedge comes back, and what one normal holds lies on no point.
TEST(ToolParts, AStepThatGoesByAWedgeInWhichAllOfItsWaysEndDoesNot) {
  const OverABrokenEdge here;
  Needle step, way;
  way.reach_m = 2e-9;
  EXPECT_FALSE(here.keeps(step, way));
  way.reach_m = 0.0;
  way.held_by = 1;
  EXPECT_FALSE(here.keeps(step, way));
}

// As where the tool lies on a vertex for a part of the way, and from q is found beyond: from there on it is asked anew.
TEST(ToolParts, APoseOfTheWayIsFoundFromTheOneBefore) {
  const OverTheTable here;
  Table otherwise_from_far, stuck_from_far;
  otherwise_from_far.far_m = stuck_from_far.far_m = 1e-4;
  otherwise_from_far.other_slope = 0.3 * M_PI_2;
  EXPECT_TRUE(here.keeps(Table(), otherwise_from_far));
  stuck_from_far.stuck_far = true;
  EXPECT_TRUE(here.keeps(Table(), stuck_from_far));
}

// As where edges cross that nearly lie along each other: on the bevel, by whatever steps it comes. Without it the side
// pushes by the bevel's width. (p̂ is over the bevel from 0.69 to 0.82 of the way.)
TEST(ToolParts, WhereNothingIsFoundFromThePoseBeforeAWayMayHaveOneThatIsFoundFromWhereTheStepBegan) {
  OverABrokenEdge here;
  here.call.p.position = Vec3(9e-5, 0.0, -2e-4);
  ASSERT_EQ(here.step_of(BrokenEdge()).contacts[0].normal_W, Vec3::UnitX());
  BrokenEdge way, never;
  way.hidden_m = 1.5e-4;  // from the step's beginning it is 0.2 mm
  EXPECT_TRUE(here.keeps(BrokenEdge(), way));
  never.hidden_m = 1e-3;
  EXPECT_FALSE(here.keeps(BrokenEdge(), never));
  // What springs there does so on that way, too.
  way.springs_m = 2.1e-10;
  EXPECT_FALSE(here.keeps(way));
  BrokenEdge springs;
  springs.springs_m = 2.1e-10;
  way.springs_m = 0.0;
  EXPECT_FALSE(here.keeps(springs, way));
}

// The step ends on another slope than its parts lead to, which both keep the law: it may if it is pushed by no more.
TEST(ToolParts, WhereThereAreSeveralSolutionsAStepMayTakeOneThatPushesNoMoreThanTheOneThatItsPartsLeadTo) {
  const OverTheTable here;
  const ToolLaws laws(here.scene, here.tool);
  Table world;
  world.far_m = 1e-4;
  const double led_J = laws.pushed_J(here.step_of(Table()), 0.0);
  const auto pushed_J = [&](double angle) {
    world.other_slope = angle;
    return laws.pushed_J(here.step_of(world), 0.0);
  };
  // As much on a slope of 32°.
  double low = 0.3 * M_PI_2, high = 0.4 * M_PI_2;
  ASSERT_LT(pushed_J(low), led_J);
  ASSERT_GT(pushed_J(high), led_J);
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    (pushed_J(middle) < led_J ? low : high) = middle;
  }
  world.other_slope = 0.999 * low;
  EXPECT_TRUE(here.keeps(world));
  world.other_slope = 1.001 * high;
  EXPECT_FALSE(here.keeps(world));
}

// Parts are those up to before it, and from there to the end: none that pushes, if they come up to the edge.
TEST(ToolParts, APoseOnTheWayForWhichNoForcesAreFoundSaysNothing) {
  const OverTheTable here;
  Table stuck, springs;
  stuck.stuck = true;
  EXPECT_TRUE(here.keeps(Table(), stuck));
  springs.springs_m = 1e-6;
  EXPECT_FALSE(here.keeps(springs, stuck));
  stuck.early_m = 2.02e-10 / std::sin(slope);
  EXPECT_FALSE(here.keeps(Table(), stuck));
}

// A tip of a pyramid slides on a box, from 20 µm before its edge to 100 µm beyond, pressed by 0.3 mm: one of its own
// edges comes down on the box's.
TEST(ToolParts, ATipThatComesOverABoxsEdgeKeepsTheBound) {
  scenes::Scene scene;
  scenes::Object box;
  scenes::BoxShape shape;
  shape.pose_W.translation() = Vec3(-0.025, 0.0, -0.025);
  shape.size_m = Vec3(0.05, 0.1, 0.05);
  box.shape = shape;
  box.friction = 0.0;
  scene.objects.push_back(box);
  models::ConvexTool pyramid{{Vec3::Zero()}};
  for (const double turn : {0.4, 2.0, 3.6, 5.2}) {
    pyramid.points_m.emplace_back(0.01 * std::cos(turn), 0.01 * std::sin(turn), 0.01);
  }
  const models::Tool tool{{{pyramid, models::Pose::Identity(), {}}}};
  const auto g = scenes::compile_rigid(scene, tool);
  const ToolLaws laws(scene, tool);
  ToolCall call;
  call.K = stiffness_N_per_m * models::Mat6::Identity();
  call.q.position.x() = -20e-6;
  call.p.position = Vec3(100e-6, 0.0, -300e-6);
  ASSERT_LE(laws.depth_m(call.q), 1e-15);
  const auto stepping = g->clone();
  call.r = stepping->step(call.K, call.p, call.q);
  call.contacts.assign(stepping->contacts().begin(), stepping->contacts().end());
  const double pushed_J = laws.pushed_J(call, 0.0);
  ASSERT_GT(pushed_J, 0.0);
  std::vector<PoseContact> touched;
  EXPECT_TRUE(ToolParts(laws, *g).keep(call, 0.0, pushed_J, touched));
}

}  // namespace
}  // namespace proxarm::studies
