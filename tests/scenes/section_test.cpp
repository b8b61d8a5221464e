// Solids in spaces of one and two dimensions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "models/description/setup_error.hpp"
#include "scenes/check.hpp"
#include "scenes/compile.hpp"
#include "scenes/scene_file.hpp"
#include "tests/models/random_states.hpp"
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
    const double clearance = scenes::clearance_m(scene, world.to_W(q));
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
      for (const auto& report : scenes::check_scene(scene, {.states = 3000})) {
        EXPECT_TRUE(report.passed()) << c.name << " in " << dimensions << ": " << report.text();
      }
    }
  }
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
  const auto refused = [](const std::string& object) {
    try {
      compile(
          parse_scene("dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, "
                      "0]]}\nobjects:\n  - " +
                          object + "\n",
                      "s.yaml"));
    } catch (const description::SetupError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused("box: {centre_m: [0, 0, 0], size_m: [1, 1, 1], rpy_rad: "
                      "[0.3, 0.3, 0]}"),
              testing::HasSubstr("askew"));
  EXPECT_THAT(refused("cylinder: {from_m: [0, 0, 0], to_m: [1, 0, 1], radius_m: 0.1}"), testing::HasSubstr("askew"));
  EXPECT_THAT(refused("cylinder: {from_m: [0, 0, 2], to_m: [1, 0, 2], "
                      "radius_m: 0.1, inside_out: true}"),
              testing::HasSubstr("lies inside"));
  EXPECT_EQ(refused("cylinder: {from_m: [0, 0, 2], to_m: [1, 0, 2], radius_m: 0.1}"), "accepted");
  EXPECT_THAT(refused("capsule: {from_m: [0, 0, 0], to_m: [1, 0, 0], radius_m: "
                      "0.1, motion: {driven: true}}"),
              testing::HasSubstr("that moves"));
}

}  // namespace
}  // namespace proxarm::tests
