#include "controller/extras/studies/stress/tool_laws.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace proxarm::studies {
namespace {

using models::PoseContact;
using models::Vec3;

// Held by a normal at 45° after a way of 1 mm along x, by 10 N.
struct OverAnEdge {
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.01)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  OverAnEdge() {
    scenes::Object box;
    box.shape = scenes::BoxShape{};
    scene.objects.push_back(box);
    call.K = 1e6 * models::Mat6::Identity();
    call.r.position.x() = 1e-3;
    call.contacts.push_back(contact(Vec3(1.0, 0.0, 1.0)));
  }
  [[nodiscard]] PoseContact contact(const Vec3& normal) const {
    PoseContact out;
    out.normal_W = normal.normalized();
    out.force_W = 10.0 * out.normal_W;
    out.point_W = call.r.position;
    return out;
  }
  [[nodiscard]] double allowed_J(const Vec3& earlier) const {
    return ToolLaws(scene, tool).edges_J(call, {contact(earlier)});
  }
};

TEST(ToolLaws, ANormalThatTurnsOverAnEdgeMayDoItsSineOfTheWay) {
  const double work_J = 10.0 * 1e-3 * std::sqrt(0.5);  // of the force along the way
  EXPECT_NEAR(OverAnEdge().allowed_J(Vec3(0.0, 0.0, 1.0)), work_J, 1e-12 * work_J);
}

// A normal along which the place has come forward doesn't turn into one that pushes: its own push was there before.
TEST(ToolLaws, WhatAPlaceCameFromBehindSaysNothingAboutAnEdge) {
  EXPECT_EQ(OverAnEdge().allowed_J(Vec3(0.1, 0.0, 1.0)), 0.0);
  EXPECT_EQ(OverAnEdge().allowed_J(Vec3(1.0, 0.0, 1.0)), 0.0);
}

// At the vertex where a tool turns over one edge it may touch the far side of it, too, at an angle of 90° or more.
TEST(ToolLaws, ANormalAtARightAngleOrMoreSaysNothingAboutAnEdge) {
  const OverAnEdge here;
  PoseContact far = here.contact(Vec3::UnitZ());
  far.point_W.y() += 2.1e-3;  // from where no place has come that went a millimetre
  for (const double lean : {-1e-9, 1e-9}) {
    const PoseContact near = here.contact(Vec3(-1.0, 0.0, 1.0 + lean));
    const double alone_J = ToolLaws(here.scene, here.tool).edges_J(here.call, {near});
    const double both_J = ToolLaws(here.scene, here.tool).edges_J(here.call, {far, near});
    const double sine = lean > 0.0 ? 1.0 : std::sqrt(0.5);
    EXPECT_EQ(alone_J > 0.0, lean > 0.0);
    EXPECT_NEAR(both_J, 10.0 * 1e-3 * sine, 1e-12) << lean;
  }
}

TEST(ToolLaws, WhereNothingWasMetNoEdgeIsTurnedOver) {
  const OverAnEdge here;
  EXPECT_EQ(ToolLaws(here.scene, here.tool).edges_J(here.call, {}), 0.0);
}

// Forces along a normal count only where the tool came along it.
TEST(ToolLaws, NeitherFrictionNorWhatComesDownPushes) {
  OverAnEdge here;
  const double work_J = 10.0 * 1e-3 * std::sqrt(0.5);  // all of it: nothing turned or is round
  const auto pushed_J = [&] { return ToolLaws(here.scene, here.tool).pushed_J(here.call, 0.0); };
  EXPECT_NEAR(pushed_J(), work_J, 1e-9 * work_J);
  EXPECT_NEAR(ToolLaws(here.scene, here.tool).pushed_J(here.call, 1e-5), work_J - 1e-4, 1e-9 * work_J);
  here.call.contacts[0].force_W += 5.0 * Vec3(1.0, 0.0, -1.0);
  EXPECT_NEAR(pushed_J(), work_J, 1e-9 * work_J);
  here.call.contacts.push_back(here.contact(-Vec3::UnitX()));
  EXPECT_NEAR(pushed_J(), work_J, 1e-9 * work_J);
}

// (Beside its feature a place may be below the feature's plane, and yet inside of nothing.)
TEST(ToolLaws, AGapIsShortByWhatItsContactSaysAndByNoMoreThanAPicometre) {
  PoseContact open, short_by;
  open.gap_m = 1e-10;
  EXPECT_EQ(ToolLaws::short_m(-1e-10, {}), 0.0);
  EXPECT_EQ(ToolLaws::short_m(3e-13, {open}), 3e-13);
  for (const double gap_m : {-7e-14, -1e-12, -1.1e-12}) {
    short_by.gap_m = gap_m;
    EXPECT_EQ(ToolLaws::short_m(-1e-10, {open, short_by, open}), std::min(-gap_m, 1e-12));
  }
}

// By what the tool turns about a place far from its middle, that place comes along no normal; and what a place came
// from behind by more than its normal turns, it met no edge on.
TEST(ToolLaws, TheBendOfALeversWayIsNoneOfAPlaces) {
  OverAnEdge here;
  const double turn = 0.1, way_m = 1e-3;
  here.call.q.orientation = models::rotation_by(turn * Vec3::UnitY());
  here.call.q.position = Vec3(0.0, 0.0, 0.0);
  PoseContact& contact = here.call.contacts[0];
  contact.normal_W = Vec3(std::sin(0.5), 0.0, std::cos(0.5));
  ASSERT_NEAR(here.call.way_of(contact).norm(), way_m, 1e-15);
  const ToolLaws laws(here.scene, here.tool);
  PoseContact was = contact;
  for (const double share : {0.99, 1.01}) {
    was.normal_W = Vec3(share * turn, 0.0, std::sqrt(1.0 - share * share * turn * turn));
    EXPECT_EQ(laws.edges_J(here.call, {was}) > 0.0, share < 1.0);
  }
}

// A corner of a box on a plate that goes by 0.1 m/s along x: pressed by 10 N, it drags the tool by 4.
struct OnABelt {
  static constexpr double T = 1e-3, v = 0.1, f_n = 10.0, f_t = 4.0;
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.01)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  // `tool_m_per_s`: the tool's own.
  OnABelt(double friction, double tool_m_per_s) {
    scenes::Object plate;
    plate.shape = scenes::PlaneShape{Vec3::Zero(), Vec3::UnitZ()};
    plate.friction = friction;
    plate.motion.emplace().velocity_m_per_s = {v, 0.0, 0.0};
    scene.objects.push_back(plate);
    PoseContact contact;
    contact.normal_W = Vec3::UnitZ();
    contact.force_W = {f_t, 0.0, f_n};
    contact.slips = tool_m_per_s != v;
    call.contacts.push_back(contact);
    call.K = 1e6 * models::Mat6::Identity();
    call.stiffest = 1e6 / (ToolLaws::lever_m * ToolLaws::lever_m);
    call.since_s = 0.7;
    call.time_s = call.since_s + T;
    call.r.position = Vec3(0.005, 0.005, 0.005);
    call.q.position = call.r.position - Vec3(tool_m_per_s * T, 0.0, 0.0);
    models::Twist w;
    w << contact.force_W, (-call.r.position).cross(contact.force_W);
    call.p = models::moved(call.r, -call.K.ldlt().solve(w));
    ToolLaws(scene, tool).carry(call);
  }
  [[nodiscard]] std::string missed() const { return ToolLaws(scene, tool).missed(call); }
  [[nodiscard]] double left_J(double rise_J) const { return ToolLaws(scene, tool).left_J(call, rise_J, 0.0); }
};

TEST(ToolLaws, WhatGoesAlongWithAnObjectSticksToIt) {
  EXPECT_EQ(OnABelt(0.6, OnABelt::v).missed(), "");
  EXPECT_EQ(OnABelt(0.3, OnABelt::v).missed(), "out of the cone");
}

// Slower than the belt it is dragged along, with all of the friction; faster it would be held back.
TEST(ToolLaws, FrictionIsAgainstTheSlipOnAnObjectThatMoves) {
  const double friction = OnABelt::f_t / OnABelt::f_n;
  EXPECT_EQ(OnABelt(friction, 0.0).missed(), "");
  EXPECT_EQ(OnABelt(friction, 0.5 * OnABelt::v).missed(), "");
  EXPECT_EQ(OnABelt(friction, 2.0 * OnABelt::v).missed(), "not against the slip");
  EXPECT_EQ(OnABelt(0.6, 0.0).missed(), "not against the slip");
}

TEST(ToolLaws, ASlipIsTold) {
  OnABelt here(OnABelt::f_t / OnABelt::f_n, 0.0);
  here.call.contacts[0].slips = false;
  EXPECT_EQ(here.missed(), "a slip that isn't told");
}

TEST(ToolLaws, WhatAnObjectDoesIsItsOwnWork) {
  const OnABelt here(0.6, OnABelt::v);
  const double work_J = OnABelt::f_t * OnABelt::v * OnABelt::T;
  EXPECT_LE(here.left_J(work_J * (1.0 - 1e-9)), 0.0);
  EXPECT_NEAR(here.left_J(1.5 * work_J), 0.5 * work_J, 2e-12);  // (1e-12 J and what rounding may do are taken off)
}

// Two edges that cross at 0.05 rad, along x = 0 that of the object, and a tool that turns by 0.005 rad about x: the
// normal turns by 0.1 rad.
struct CrossingEdges {
  static constexpr double between = 0.05, turn = 0.005, way_m = 1e-4;
  scenes::Scene scene;
  models::Tool tool{{{models::BoxTool{Vec3::Constant(0.01)}, models::Pose::Identity(), {}}}};
  ToolCall call;

  // `aside`: by how much more the tool came from behind the plane that the edges had at q; m.
  explicit CrossingEdges(double aside_m, double crossing = between) {
    scenes::Object box;
    scenes::BoxShape shape;
    shape.pose_W = models::Pose::Identity();
    shape.pose_W.linear() = Eigen::AngleAxisd(0.8, Vec3::UnitY()).toRotationMatrix();
    shape.size_m = Vec3::Constant(0.1);
    shape.pose_W.translation() = -(shape.pose_W.linear() * Vec3(-0.05, 0.0, 0.05));
    box.shape = shape;
    scene.objects.push_back(box);
    // The tool's lower left edge along y lies on the origin, turned about z and then about x.
    const auto turned = [&](double about_x) {
      return models::Quaternion(models::rotation_by(Vec3(about_x, 0.0, 0.0)) *
                                models::rotation_by(Vec3(0.0, 0.0, -crossing)) *
                                models::rotation_by(Vec3(0.0, -0.8, 0.0)));
    };
    const Vec3 corner(-0.005, 0.0, -0.005);
    call.K = 1e6 * models::Mat6::Identity();
    call.r.orientation = turned(0.0);
    call.r.position = -(call.r.orientation * corner);
    call.q.orientation = turned(-turn);
    const Vec3 own = call.q.orientation * Vec3::UnitY();
    const Vec3 n0 = own.cross(Vec3::UnitY()).normalized(), n = Vec3::UnitZ();
    const Vec3 up = n0.z() > 0.0 ? n0 : Vec3(-n0);
    const Vec3 along = (n - n.dot(up) * up).normalized();
    call.q.position = -(call.q.orientation * corner) - way_m * along - aside_m * up;
    PoseContact contact;
    contact.object = contact.part = 0;
    contact.normal_W = n;
    contact.force_W = 10.0 * n;
    call.contacts.push_back(contact);
  }
  [[nodiscard]] double allowed_J() const { return ToolLaws(scene, tool).curvature_J(call); }
};

TEST(ToolLaws, ANormalOfCrossingEdgesTurnsByMoreThanTheTool) {
  const double sine = std::sin(std::atan2(std::sin(CrossingEdges::turn), std::tan(CrossingEdges::between)));
  const double lever_m = 0.005 * std::sqrt(2.0), theta = CrossingEdges::turn, force_N = 10.0;
  const double bends_m = 0.5 * theta * theta * lever_m;
  const double by_edges_J = force_N * (bends_m + sine * CrossingEdges::way_m);
  EXPECT_NEAR(CrossingEdges(0.0).allowed_J(), by_edges_J, 1e-9 * by_edges_J);
  // The edges came from behind each other: by what rounding and gaps may be short of, or by more.
  EXPECT_NEAR(CrossingEdges(1.99e-12).allowed_J(), by_edges_J, 1e-6 * by_edges_J);
  const double by_turn_J = force_N * (bends_m + theta * CrossingEdges::way_m);
  EXPECT_NEAR(CrossingEdges(2.01e-12).allowed_J(), by_turn_J, 1e-6 * by_turn_J);
}

// Nor where the contact is on no edge, or its normal is another one.
TEST(ToolLaws, WhereNoEdgesCrossANormalTurnsByWhatTheToolDoes) {
  CrossingEdges off(0.0), leaning(0.0);
  const double by_turn_J = 10.0 * CrossingEdges::way_m * CrossingEdges::turn;  // and a fifth for its lever
  off.call.contacts[0].point_W = Vec3(0.0, 0.0, 3e-12);
  EXPECT_LT(off.allowed_J(), 1.3 * by_turn_J);
  leaning.call.contacts[0].normal_W = Vec3(0.0, 1e-6, 1.0).normalized();
  EXPECT_LT(leaning.allowed_J(), 1.3 * by_turn_J);
}

}  // namespace
}  // namespace proxarm::studies
