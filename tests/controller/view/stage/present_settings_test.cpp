#include "controller/stage/present_settings.hpp"

#include <gtest/gtest.h>

#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::view {
namespace {

using controller::Change;
using controller::Parameter;

constexpr double period_s = 1e-3;

Stage stage() {
  return {description::load_cell(source_file("models/cells/default.yaml")),
          scenes::load_scene(source_file("scenes/moving_plate.yaml")),
          {.period_s = period_s, .mass_kg = 4.0, .damping_Ns_per_m = 2.0, .spring_N_per_m = 10.0}};
}

TEST(PresentSettings, AreThoseOfTheStartUntilSomethingChanges) {
  const Stage shown = stage();
  PresentSettings settings(shown);
  EXPECT_EQ(settings.mass_kg, 4.0);
  EXPECT_EQ(settings.spring_N_per_m, 10.0);
  ASSERT_EQ(settings.friction.size(), shown.scene().objects.size());
  EXPECT_EQ(settings.friction[0], shown.scene().objects[0].friction);
  EXPECT_FALSE(settings.follow({}, period_s));
}

TEST(PresentSettings, FollowWhatTheCycleTookAndTellItOnce) {
  const Stage shown = stage();
  PresentSettings settings(shown);
  const Change spring{.parameter = Parameter::spring, .value = 55.0, .period_s = period_s};
  EXPECT_TRUE(settings.follow(spring, period_s));
  EXPECT_FALSE(settings.follow(spring, period_s));
  EXPECT_TRUE(settings.follow({.parameter = Parameter::mass, .value = 5.0}, period_s));
  EXPECT_TRUE(settings.follow({.parameter = Parameter::friction, .value = 0.7, .object = 0}, period_s));
  EXPECT_TRUE(
      settings.follow({.parameter = Parameter::position, .object = 0, .position_m = {0.1, 0.0, 0.0}}, period_s));
  EXPECT_EQ(settings.spring_N_per_m, 55.0);
  EXPECT_EQ(settings.mass_kg, 5.0 + shown.handle_mass_kg());  // a change has the proxy's
  EXPECT_EQ(settings.friction[0], 0.7);
  EXPECT_EQ(settings.position_m[0], models::Vec3(0.1, 0.0, 0.0));
}

TEST(PresentSettings, AreWithoutWhatWasCheckedForAnotherTimestep) {
  const Stage shown = stage();
  PresentSettings settings(shown);
  EXPECT_TRUE(settings.follow({.parameter = Parameter::damping, .value = 9.0, .period_s = period_s}, 2e-3));
  EXPECT_EQ(settings.period_s, 2e-3);
  EXPECT_EQ(settings.damping_Ns_per_m, 2.0);
}

TEST(PresentSettings, OfNoSuchObjectChangeNothing) {
  const Stage shown = stage();
  PresentSettings settings(shown);
  EXPECT_FALSE(settings.follow({.parameter = Parameter::friction, .value = 0.7, .object = 99}, period_s));
  EXPECT_FALSE(settings.follow({.parameter = Parameter::friction, .value = 0.7, .object = -1}, period_s));
}

}  // namespace
}  // namespace proxarm::view
