// Solids in spaces of one and two dimensions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "models/base/setup_error.hpp"
#include "scenes/compiler/check.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using models::Vec;
using models::Vec3;
using scenes::compile;
using scenes::parse_scene;
using scenes::Scene;

struct Case {
  std::string name, object;
  bool room = false;  // from inside
};

// All cut by the line through (0, 0.03, 0.04) along x, and straight by the
// plane through it along x and y.
std::vector<Case> cases() {
  const std::string block =
      "box: {centre_m: [0.5, 0, 0.1], size_m: [0.2, 0.4, "
      "0.3], rpy_rad: [0, 0, 0.4], friction: 0.3";
  const std::string upright =
      "cylinder: {from_m: [0.5, 0, -0.2], to_m: [0.5, "
      "0, 0.2], radius_m: 0.15, friction: 0.3";
  const std::string lying =
      "cylinder: {from_m: [0.5, -0.2, 0], to_m: [0.7, "
      "0.3, 0], radius_m: 0.15, friction: 0.3";
  const std::string bar =
      "capsule: {from_m: [0.5, -0.2, 0.1], to_m: [0.7, "
      "0.3, 0.1], radius_m: 0.15, friction: 0.3";
  const std::string ball = "sphere: {centre_m: [0.5, 0, 0], radius_m: 0.15, friction: 0.3";
  const std::string post =
      "capsule: {from_m: [0.5, 0, 0.1], to_m: [0.5, 0, "
      "0.4], radius_m: 0.15, friction: 0.3";
  std::vector<Case> all;
  for (const auto& [name, object] : {std::pair{"box", block},
                                     {"upright", upright},
                                     {"lying", lying},
                                     {"bar", bar},
                                     {"ball", ball},
                                     {"post", post}}) {
    all.push_back({name, object + "}"});
    all.push_back({std::string(name) + " from inside", object + ", inside_out: true}", true});
  }
  const std::string askew =
      "box: {centre_m: [0.5, 0, 0.1], size_m: [0.2, 0.4, 0.3], rpy_rad: [0.5, -0.7, 0.4], friction: 0.3";
  all.push_back({"askew", askew + "}"});
  all.push_back({"askew from inside", askew + ", inside_out: true}", true});
  const std::string star = source_file("scenes/meshes/star.obj").string();
  all.push_back({"mesh", "mesh: {file: " + star +
                             ", position_m: [0.5, 0, 0.1], rpy_rad: [0.1, 0.2, "
                             "0.3], friction: 0.3}"});
  return all;
}

std::string text_of(const Case& c, int dimensions) {
  return std::string("dimensions: ") + (dimensions == 1 ? "1" : "2") +
         "\nspace: {origin_m: [0, 0.03, 0.04], axes: [[1, 0, 0]" + (dimensions == 2 ? ", [0, 1, 0]" : "") +
         "]}\nobjects:\n  - " + c.object + "\n";
}

// Random steps, from outside or inside: never where the solid of W is, and stopped right at it.
template <int N>
void expect_held_by_the_solid(const Case& c) {
  const Scene scene = parse_scene(text_of(c, N), "section.yaml");
  const auto world = compile(scene);
  auto& g = world.template algorithm<N>();
  Random random(851);
  Vec<N> q = world.template from_W<N>(Vec3(c.room ? 0.52 : 0.2, 0.03, 0.04));
  const Vec<N> start = q;
  double least = 1.0, nearest = 1.0;
  std::size_t contacts = 0;
  for (std::int64_t i = 0; i < std::max(scaled(10'000), std::int64_t{10'000}); ++i) {
    q = g(1e6, q + random.log_uniform(1e-6, 0.3) * random.template direction<N>(), q);
    const double clearance = scenes::Clearances(scene).of_point(world.to_W(q));
    least = std::min(least, clearance);
    if (!g.contacts().empty()) nearest = std::min(nearest, std::abs(clearance));
    contacts += g.contacts().size();
    if ((q - start).norm() > 0.8) q = start;
  }
  EXPECT_GE(least, -1e-12) << c.name << " in " << N;
  EXPECT_LE(nearest, 1e-9) << c.name << " in " << N;
  EXPECT_GT(contacts, 100u) << c.name << " in " << N;
}

TEST(Section, HoldsWhereTheSolidDoes) {
  for (const Case& c : cases()) {
    expect_held_by_the_solid<1>(c);
    expect_held_by_the_solid<2>(c);
  }
}

TEST(Section, KeepsTheContract) {
  for (const Case& c : cases()) {
    for (const int dimensions : {1, 2}) {
      const Scene scene = parse_scene(text_of(c, dimensions), "section.yaml");
      for (const auto& report : scenes::check_scene(scene, {.states = scaled(3000, 500)})) {
        EXPECT_EQ(report.verdict(), scenes::CheckVerdict::fine)
            << c.name << " in " << dimensions << ": " << report.text();
      }
    }
  }
}

// What moves, by script: swings and, in a plane, turns onto a proxy that rests half of the time.
template <int N>
void expect_held_by_the_moving_solid(const Case& c) {
  Case moves = c;
  moves.object.insert(moves.object.size() - 1,
                      std::string(", motion: {velocity_m_per_s: [0.01, 0, 0], swing: {amplitude_m: [0.06, 0, 0], ") +
                          "frequency_Hz: 2}" +
                          (N == 2 ? ", turn: {axis: [0, 0, -2], centre_m: [0.52, 0.03, 7], speed_rad_per_s: 3}" : "") +
                          "}");
  const Scene scene = parse_scene(text_of(moves, N), "section.yaml");
  const auto world = compile(scene);
  auto& g = world.template algorithm<N>();
  Random random(852);
  Vec<N> q = world.template from_W<N>(Vec3(c.room ? 0.52 : 0.3, 0.03, 0.04));
  double least = 1.0;
  std::size_t contacts = 0;
  constexpr double T = 1e-3;
  const int steps = static_cast<int>(scaled(10'000, 4000));  // to come to the far sides
  for (int k = 1; k <= steps; ++k) {
    g.set_time({.time_s = T * k, .period_s = T});
    // Towards the solid from outside, away from its middle from inside.
    const Vec<N> middle = world.template from_W<N>(Vec3(0.5, 0.03, 0.04));
    const Vec<N> far = 1e-3 * random.template in_box<N>(1.0) + (c.room ? -2e-3 : 2e-3) * (middle - q);
    q = g(1e6, random.chance(0.5) ? q : Vec<N>(q + far), q);
    contacts += g.contacts().size();
    if (k % 4 == 0) least = std::min(least, scenes::Clearances(scene).of_point(world.to_W(q), T * k));
    ASSERT_FALSE(g.squeezed()) << c.name << " in " << N << ", step " << k;
  }
  EXPECT_GE(least, -1e-12) << c.name << " in " << N;
  EXPECT_GT(contacts, static_cast<std::size_t>(steps / 100)) << c.name << " in " << N;
  for (const auto& report : scenes::check_scene(scene, {.states = scaled(2000, 300)})) {
    EXPECT_EQ(report.verdict(), scenes::CheckVerdict::fine)
        << c.name << " that moves, in " << N << ": " << report.text();
  }
}

TEST(Section, MovesAsTheSolidDoes) {
  for (const Case& c : cases()) {
    expect_held_by_the_moving_solid<1>(c);
    expect_held_by_the_moving_solid<2>(c);
  }
}

const std::string in_plane = "dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, 0]]}\n";

// Where all is symmetric about the plane, the space of three dimensions does the same to a proxy in it.
TEST(Section, OfASymmetricWorldIsThatWorldInThePlane) {
  const std::string motion = ", motion: {swing: {amplitude_m: [0.03, 0.05, 0], frequency_Hz: 3}}";
  const std::string turn = ", motion: {turn: {axis: [0, 0, 1], centre_m: [0.4, 0, 0], speed_rad_per_s: 2}}";
  const std::string layer = ", layer: {thickness_m: 0.02, stiffness_N_per_m: 2000}";
  const std::string ball = "objects:\n  - sphere: {centre_m: [0.5, 0, 0], radius_m: 0.15, friction: 0.3";
  const std::string bar =
      "objects:\n  - capsule: {from_m: [0.5, 0, 0], to_m: [0.6, 0.3, 0], radius_m: 0.1, friction: 0.3";
  const std::string post =
      "objects:\n  - cylinder: {from_m: [0.5, 0, -1], to_m: [0.5, 0, 1], radius_m: 0.15, friction: 0.3";
  const std::string wall = "objects:\n  - plane: {point_m: [0.5, 0, 0], normal: [-1, 0.3, 0], friction: 0.3";
  const std::string box =
      "objects:\n  - box: {centre_m: [0.5, 0, 0], size_m: [0.2, 0.3, 2], rpy_rad: [0, 0, 0.3], friction: 0.3";
  const std::string medium =
      "media:\n  - viscous: {damping_Ns_per_m: 50, within: {sphere: {centre_m: [0.3, 0, 0.05], radius_m: 0.2}}}\n";
  const std::string field = "coulomb_field: {force_N: 3}\n";
  const std::string rail = "guide: {polyline: {points_m: [[0, 0, 0], [0.9, 0.1, 0], [0.2, 0.5, 0]], friction: 0.2}}\n";
  const std::string sheet = "guide: {plane: {point_m: [0.2, 0, 0.3], normal: [0.3, 2, 0], friction: 0.1}}\n";
  for (const std::string& text :
       {ball + motion + "}\n", bar + motion + "}\n", post + turn + "}\n", wall + motion + "}\n", box + turn + "}\n",
        ball + layer + "}\n", bar + layer + motion + "}\n", wall + layer + "}\n", box + layer + "}\n",
        ball + "}\n" + medium, post + "}\n" + field, rail, ball + "}\n" + rail}) {
    const auto two = compile(parse_scene(in_plane + text, "two.yaml"));
    const auto three = compile(parse_scene(text, "three.yaml"));
    auto& g2 = two.algorithm<2>();
    auto& g3 = three.algorithm<3>();
    Random random(853);
    Vec<2> q(0.2, 0.0);
    double worst = 0.0;
    std::size_t contacts = 0;
    for (int k = 1; k <= 4000; ++k) {
      const models::StepTime time{.time_s = 1e-3 * k, .period_s = 1e-3};
      g2.set_time(time);
      g3.set_time(time);
      const Vec<2> p = q + random.log_uniform(1e-7, 5e-3) * random.direction<2>() + Vec<2>(1e-3, 0.0);
      const Vec<2> r = g2(1e4, p, q);
      const Vec3 r3 = g3(1e4, models::lift<2>(p), models::lift<2>(q));
      worst = std::max(worst, (models::lift<2>(r) - r3).norm());
      contacts += g2.contacts().size();
      ASSERT_EQ(g2.contacts().size(), g3.contacts().size()) << text << k;
      q = r.norm() > 1.0 ? Vec<2>(0.2, 0.0) : r;
    }
    EXPECT_LE(worst, 1e-12) << text;
    EXPECT_GT(contacts, 100u) << text;
  }
  // A guide on a plane is a line in the plane that it is cut by.
  const auto cut = compile(parse_scene(in_plane + sheet, "cut.yaml"));
  const Vec<2> e = Vec<2>(-2, 0.3).normalized(), n(-e.y(), e.x()), at(0.2, 0.0);
  EXPECT_LE((cut.algorithm<2>()(1.0, at + 0.5 * e + 2.0 * n, at) - (at + 0.3 * e)).norm(), 1e-14);
}

// All that a plane and a line may hold besides rigid objects keeps the contract.
TEST(Section, KeepsTheContractOfLayersMediaAndGuides) {
  const std::string on_line = "dimensions: 1\nspace: {origin_m: [0, 0.03, 0.04], axes: [[1, 0, 0]]}\n";
  const std::string layer = ", layer: {thickness_m: 0.01, stiffness_N_per_m: 2000}}\n";
  std::vector<std::string> texts;
  for (const std::string& space : {in_plane, on_line}) {
    for (const std::string object :
         {"plane: {point_m: [0.5, 0, 0], normal: [-1, 0.3, 0.2], friction: 0.3",
          "sphere: {centre_m: [0.5, 0, 0.03], radius_m: 0.15",
          "sphere: {centre_m: [0.5, 0, 0.03], radius_m: 0.15, inside_out: true",
          "box: {centre_m: [0.5, 0, 0], size_m: [0.2, 0.4, 0.3], friction: 0.3",
          "cylinder: {from_m: [0.5, 0, -1], to_m: [0.5, 0, 1], radius_m: 0.15, inside_out: true",
          "box: {centre_m: [0.5, 0, 0], size_m: [0.3, 0.2, 1], inside_out: true",
          "box: {centre_m: [0.5, 0, 0], size_m: [0.3, 0.2, 1], rpy_rad: [0.3, 0.2, 0], inside_out: true"}) {
      texts.push_back(space + "objects:\n  - " + object + layer);
    }
    const std::string ball = "objects:\n  - sphere: {centre_m: [0.5, 0, 0.03], radius_m: 0.15, friction: 0.3}\n";
    texts.push_back(space + ball +
                    "media:\n  - viscous: {damping_Ns_per_m: 50, within: {capsule: {from_m: [0.2, 0, 0], to_m: "
                    "[0.3, 0, 0.1], radius_m: 0.2}}}\n  - coulomb: {force_N: 2}\n");
    if (space == on_line) continue;
    for (const std::string guide :
         {"line: {point_m: [0.2, 0.05, 0], direction: [1, 0.2, 0], friction: 0.2}",
          "plane: {point_m: [0.2, 0, 0.3], normal: [0.3, 2, 0.5], friction: 0.1}",
          "polyline: {points_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], closed: true}"}) {
      texts.push_back(space + "guide: {" + guide + "}\n");
      texts.push_back(space + ball + "guide: {" + guide + "}\n");
      texts.push_back(space +
                      "objects:\n  - box: {centre_m: [0.5, 0, 0], size_m: [0.2, 0.4, 0.3], rpy_rad: [0.5, 0.3, 0]}\n" +
                      "guide: {" + guide + "}\n");
    }
  }
  for (const std::string& text : texts) {
    for (const auto& report : scenes::check_scene(parse_scene(text, "section.yaml"), {.states = 3000})) {
      EXPECT_EQ(report.verdict(), scenes::CheckVerdict::fine) << text << report.text();
      EXPECT_TRUE(report.in_contact > 100 || text.find("objects") == std::string::npos) << text;
    }
  }
}

// 10 N on a layer of 2000 N/m: 5 mm, in the plane and on the line; used up at 20 N.
TEST(Section, GivesWayUnderALayer) {
  const std::string wall =
      "objects:\n  - plane: {point_m: [0.5, 0, 0], normal: [-1, 0, 0], layer: {thickness_m: 0.01, "
      "stiffness_N_per_m: 2000}}\n";
  const auto two = compile(parse_scene(in_plane + wall, "two.yaml"));
  const auto one = compile(parse_scene("dimensions: 1\nspace: {axes: [[1, 0, 0]]}\n" + wall, "one.yaml"));
  EXPECT_NEAR(two.algorithm<2>()(1e4, Vec<2>(0.505 + 1e-3, 0.0), Vec<2>(0.5, 0.0)).x(), 0.505, 1e-14);
  EXPECT_NEAR(one.algorithm<1>()(1e4, Vec<1>(0.505 + 1e-3), Vec<1>(0.5))[0], 0.505, 1e-14);
  EXPECT_NEAR(two.algorithm<2>()(1e4, Vec<2>(0.6, 0.0), Vec<2>(0.5, 0.0)).x(), 0.51, 1e-14);
}

// Where a medium acts is decided in W: here in a circle of 0.3 m about (0.5, 0) in the plane at z = 0.4.
TEST(Section, HasMediaWithinShapesOfW) {
  const auto world = compile(
      parse_scene("dimensions: 2\nspace: {origin_m: [0.5, 0, 0.4], axes: [[1, 0, 0], [0, 1, 0]]}\nmedia:\n  - viscous: "
                  "{damping_Ns_per_m: 10, within: {sphere: {centre_m: [0.5, 0, 0], radius_m: 0.5}}}\n",
                  "honey.yaml"));
  auto& g = world.algorithm<2>();
  g.set_time({.time_s = 1e-3, .period_s = 1e-3});
  EXPECT_NEAR(g(1e4, Vec<2>(0.0, 0.3), Vec<2>(0.0, 0.29)).y(), 0.295, 1e-15);
  EXPECT_EQ(g(1e4, Vec<2>(0.0, 0.3), Vec<2>(0.0, 0.31)), Vec<2>(0.0, 0.3));
}

// Of a driven object's pose what leads along the space counts.
TEST(Section, IsDrivenWithinTheSpace) {
  auto world = compile(parse_scene(in_plane + "objects:\n  - sphere: {centre_m: [0.5, 0, 0], radius_m: 0.1, motion: "
                                              "{driven: true}}\n",
                                   "driven.yaml"));
  models::Pose X = models::Pose::Identity();
  X.translation() = Vec3(-0.02, 0.0, 5.0);
  world.drive(0, X);
  EXPECT_NEAR(world.algorithm<2>()(1e6, Vec<2>(0.4, 0.0), Vec<2>(0.39, 0.0)).x(), 0.38, 1e-15);
  // A quarter turn about the origin carries it to (0, 0.5).
  X = models::Pose(Eigen::AngleAxisd(1.570796326794896619, Vec3::UnitZ()));
  world.drive(0, X);
  world.drive(0, X);
  EXPECT_NEAR(world.algorithm<2>()(1e6, Vec<2>(0.0, 0.45), Vec<2>(0.0, 0.3)).y(), 0.4, 1e-15);
}

// (4) on a rectangle's side, with its friction.
TEST(Section, RubsInAPlane) {
  const auto world =
      compile(parse_scene("dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, 0]]}\nobjects:\n  - "
                          "box: {centre_m: [0.5, 0, 0], size_m: [0.2, 1, 1], friction: 0.3}\n",
                          "box.yaml"));
  auto& g = world.algorithm<2>();
  using Vec2 = Vec<2>;
  EXPECT_LE((g(1.0, Vec2(0.5, 0.2), Vec2(0.4, 0.0)) - Vec2(0.4, 0.17)).norm(), 1e-15);
  EXPECT_EQ(g(1.0, Vec2(0.5, 0.02), Vec2(0.4, 0.0)), Vec2(0.4, 0.0));
}

TEST(Section, RefusesWhatItCannotCut) {
  const auto refused = [](const std::string& text, int dimensions = 2) {
    try {
      compile(parse_scene(dimensions == 2 ? in_plane + text : "dimensions: 1\nspace: {axes: [[1, 0, 0]]}\n" + text,
                          "s.yaml"));
    } catch (const description::SetupError& error) {
      EXPECT_GT(error.line(), 0) << error.what();
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using testing::AllOf;
  using testing::HasSubstr;
  const std::string object = "objects:\n  - ", ball = object + "sphere: {centre_m: [0.5, 0, 0], radius_m: 0.1, ";
  EXPECT_EQ(refused(object + "box: {centre_m: [0, 0, 0], size_m: [1, 1, 1], rpy_rad: [0.3, 0.3, 0]}\n"), "accepted");
  EXPECT_THAT(refused(object + "box: {centre_m: [0, 0, 0], size_m: [1, 1, 1], rpy_rad: [0.3, 0.3, 0], layer: "
                               "{thickness_m: 0.01, stiffness_N_per_m: 100}}\n"),
              HasSubstr("a layer of 0.01 m on box 1"));
  EXPECT_THAT(refused(object + "cylinder: {from_m: [0, 0, 0], to_m: [1, 0, 1], radius_m: 0.1}\n"),
              AllOf(HasSubstr("askew"), HasSubstr("`guide: plane`")));
  EXPECT_THAT(refused(object + "cylinder: {from_m: [0, 0, 2], to_m: [1, 0, 2], radius_m: 0.1, inside_out: true}\n"),
              HasSubstr("lies inside"));
  EXPECT_EQ(refused(object + "cylinder: {from_m: [0, 0, 2], to_m: [1, 0, 2], radius_m: 0.1}\n"), "accepted");
  EXPECT_THAT(refused(object + "sphere: {centre_m: [0, 0, 0.3], radius_m: 0.5, layer: {thickness_m: 0.4, "
                               "stiffness_N_per_m: 100}}\n"),
              HasSubstr("its section is, 0.8 m"));
  const std::string out = "leads out of the proxy's space";
  EXPECT_THAT(refused(ball + "motion: {velocity_m_per_s: [1, 0, 0.1]}}\n"),
              AllOf(HasSubstr(out), HasSubstr("`guide: plane`")));
  EXPECT_THAT(refused(ball + "motion: {swing: {amplitude_m: [0, 0, 1], frequency_Hz: 1}}}\n"), HasSubstr(out));
  const std::string turn = "motion: {turn: {axis: [0, 0.1, 1], centre_m: [0, 0, 0], speed_rad_per_s: 1}}}\n";
  EXPECT_THAT(refused(ball + turn), HasSubstr(out));
  EXPECT_THAT(refused(ball + turn, 1), AllOf(HasSubstr(out), HasSubstr("`guide: line`")));
  EXPECT_THAT(refused("guide: {line: {point_m: [0, 0, 0], direction: [1, 0, 0]}}\n", 1), HasSubstr("leave it out"));
  EXPECT_THAT(refused("guide: {plane: {point_m: [0, 0, 0], normal: [0, 0, 1]}}\n"), HasSubstr("leave it out"));
  const std::string off = "leads out of the proxy's plane";
  EXPECT_THAT(refused("guide: {line: {point_m: [0, 0, 0.01], direction: [1, 0, 0]}}\n"), HasSubstr(off));
  EXPECT_THAT(refused("guide: {line: {point_m: [0, 0, 0], direction: [1, 0, 0.01]}}\n"), HasSubstr(off));
  EXPECT_THAT(refused("guide: {polyline: {points_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0.1]]}}\n"), HasSubstr(off));
}

// Three dimensions are all of W: `space` has nothing to say there.
TEST(Section, OfThreeDimensionsIsAll) {
  const std::string objects =
      "objects:\n  - sphere: {centre_m: [0.5, 0, 0], radius_m: 0.1}\n  - plane: {point_m: [0, 0, 0], "
      "normal: [0, 0, 1]}\n";
  const auto world = compile(parse_scene(
      "dimensions: 3\nspace: {origin_m: [1, 2, 3], axes: [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}\n" + objects, "s.yaml"));
  EXPECT_EQ(world.to_W<3>(Vec3(0.1, 0.2, 0.3)), Vec3(0.1, 0.2, 0.3));
  auto& g = world.algorithm<3>();
  EXPECT_NEAR(g(1e6, Vec3(0.5, 0, 0), Vec3(0.3, 0, 0)).x(), 0.4, 1e-15);
  EXPECT_NEAR(g(1e6, Vec3(-1, 0, -1), Vec3(-1, 0, 1)).z(), 0.0, 1e-15);
}

}  // namespace
}  // namespace proxarm::tests
