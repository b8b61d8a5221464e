// Assumption 1 as a tool: it passes what is right, and finds what is wrong.
#include "scenes/compiler/check.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "models/surfaces/friction_plane.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;

const std::filesystem::path scenes_folder = source_file("scenes");

TEST(Check, PassesEveryShippedScene) {
  for (const auto& entry : std::filesystem::directory_iterator(scenes_folder)) {
    if (entry.path().extension() != ".yaml") continue;
    for (const auto& report : check_scene(scenes::load_scene(entry.path()), {.states = scaled(20'000, 1000)})) {
      EXPECT_TRUE(report.passed()) << entry.path() << "\n" << report.text();
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
  EXPECT_TRUE(report.passed()) << report.text();
}

TEST(Check, FindsWhatDependsOnTheStiffness) {
  // A surface that is held off by a force: the point then depends on K, and the force at it doesn't.
  MyWall g(1.0, 1.0);
  const auto report = scenes::check_algorithm<3>(g, {.size_m = 0.1, .acts_without_contact = true}, {.states = 2000});
  EXPECT_FALSE(report.passed());
  EXPECT_NE(report.text().find("independent of K"), std::string::npos);
}

TEST(Check, FindsAForceWithoutAContact) {
  MyWall g;  // presses, but reports nothing
  const auto report = scenes::check_algorithm<3>(g, {.size_m = 0.1}, {.states = 2000});
  EXPECT_FALSE(report.passed());
}

TEST(Check, FindsAWrongFriction) {
  models::FrictionPlane<3> g(Vec3::Zero(), Vec3::UnitZ(), 0.4);
  scenes::CheckRegion<3> region{.size_m = 0.1, .friction = std::vector<double>{0.3}};
  EXPECT_FALSE(scenes::check_algorithm<3>(g, region, {.states = 2000}).passed());
  region.friction = std::vector<double>{0.4};
  EXPECT_TRUE(scenes::check_algorithm<3>(g, region, {.states = 2000}).passed());
}

}  // namespace
}  // namespace proxarm::tests
