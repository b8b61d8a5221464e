// Assumption 1 as a tool: it passes what is right, and finds what is wrong.
#include "scenes/compiler/check.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <vector>

#include "models/obstacles/box_obstacle.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/models/world/worlds.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;
using scenes::CheckVerdict;

const std::filesystem::path scenes_folder = source_file("scenes");

TEST(Check, PassesEveryShippedScene) {
  for (const auto& entry : std::filesystem::directory_iterator(scenes_folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const scenes::Scene scene = scenes::load_scene(entry.path());
    for (const auto& report : check_scene(scene, {.states = scaled(20'000, 1000)})) {
      EXPECT_NE(report.verdict(), CheckVerdict::wrong) << entry.path() << "\n" << report.text();
      // A tool's things may be as small as a point's pushes are deep, with a solution on either side; a session with
      // that tool renders another 𝒢.
      if (scene.tool) continue;
      EXPECT_EQ(report.verdict(), CheckVerdict::fine) << entry.path() << "\n" << report.text();
    }
  }
}

// Ten lines of one's own.
class MyWall : public models::GeometricAlgorithm<3> {
 public:
  explicit MyWall(double offset = 0.0, double sticky = 0.0) : offset_(offset), sticky_(sticky) {}
  Vec3 operator()(double K, const Vec3& p, const Vec3& /*q*/) noexcept override {
    Vec3 r = p;
    if (p.z() < sticky_ / K) r.z() = offset_ / K;
    return r;
  }

 private:
  double offset_, sticky_;
};

TEST(Check, PassesAWallOfOnesOwn) {
  MyWall g;
  const auto report = scenes::check_algorithm<3>(g, {.size_m = 0.1, .acts_without_contact = true}, {.states = 2000});
  EXPECT_EQ(report.verdict(), CheckVerdict::fine) << report.text();
}

TEST(Check, FindsWhatDependsOnTheStiffness) {
  // A surface that is held off by a force: the point then depends on K, and the force at it doesn't.
  MyWall g(1.0, 1.0);
  const auto report = scenes::check_algorithm<3>(g, {.size_m = 0.1, .acts_without_contact = true}, {.states = 2000});
  EXPECT_EQ(report.verdict(), CheckVerdict::wrong);
  EXPECT_NE(report.text().find("independent of K"), std::string::npos);
}

TEST(Check, FindsAForceWithoutAContact) {
  MyWall g;  // presses, but reports nothing
  const auto report = scenes::check_algorithm<3>(g, {.size_m = 0.1}, {.states = 2000});
  EXPECT_EQ(report.verdict(), CheckVerdict::wrong);
}

TEST(Check, FindsAWrongFriction) {
  models::FrictionPlane<3> g(Vec3::Zero(), Vec3::UnitZ(), 0.4);
  scenes::CheckRegion<3> region{.size_m = 0.1, .friction = std::vector<double>{0.3}};
  EXPECT_EQ(scenes::check_algorithm<3>(g, region, {.states = 2000}).verdict(), CheckVerdict::wrong);
  region.friction = std::vector<double>{0.4};
  EXPECT_EQ(scenes::check_algorithm<3>(g, region, {.states = 2000}).verdict(), CheckVerdict::fine);
}

TEST(Check, TellsSeveralSolutionsApartFromMistakes) {
  // At a block's edge friction may hold a proxy on either face.
  models::Pose X = models::Pose::Identity();
  const std::unique_ptr<models::World> g =
      single(std::make_unique<models::BoxObstacle>(X, Vec3(0.01, 0.01, 0.01), 1.2));
  const scenes::CheckRegion<3> region{.size_m = 0.015, .friction = std::vector<double>{1.2}};
  const auto report = scenes::check_algorithm<3>(*g, region, {.states = 20'000, .several_allowed = 0.0});
  EXPECT_EQ(report.verdict(), CheckVerdict::several_solutions) << report.text();
  EXPECT_NE(report.text().find("the first at K = "), std::string::npos) << report.text();
  EXPECT_EQ(scenes::check_algorithm<3>(*g, region, {.states = 20'000}).verdict(), CheckVerdict::fine);
}

// A wall that says it sticks, while it lets the proxy creep by a ten-millionth of the way to p.
class CreepingWall : public models::GeometricAlgorithm<3> {
 public:
  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override {
    Vec3 r = wall_(K, p, q);
    if (!wall_.contacts().empty() && !wall_.contacts()[0].slips) r.head<2>() += 1e-7 * (p - q).head<2>();
    return r;
  }
  [[nodiscard]] std::span<const models::Contact<3>> contacts() const noexcept override { return wall_.contacts(); }

 private:
  models::FrictionPlane<3> wall_{Vec3::Zero(), Vec3::UnitZ(), 0.4};
};

TEST(Check, FindsAWallThatCreepsWhereItSaysThatItSticks) {
  CreepingWall g;
  const scenes::CheckRegion<3> region{.size_m = 0.1, .friction = std::vector<double>{0.4}};
  const auto report = scenes::check_algorithm<3>(g, region, {.states = 2000});
  EXPECT_EQ(report.verdict(), CheckVerdict::wrong);
  EXPECT_GT(report.figures[3].failures, 0) << report.text();
}

}  // namespace
}  // namespace proxarm::tests
