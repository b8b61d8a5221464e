#include "models/arm/tool_inertia.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "models/arm/held_orientation.hpp"
#include "tests/models/arm/few_axes.hpp"

namespace proxarm::models {
namespace {

// A rod of mass m and length l, held at one end: m l²/3 across, whatever the handle's frame.
TEST(ToolInertia, IsTakenAboutTheRenderedPoint) {
  constexpr double m = 1.2, l = 0.3, across = m * l * l / 12.0;
  description::ToolDescription rod{.mass_kg = m,
                                   .centre_of_mass_S_m = {0.0, 0.0, 0.5 * l},
                                   .inertia_kg_m2 = {across, across, 0.0, 0.0, 0.0, 0.0},
                                   .handle_S = {},
                                   .shape = {}};
  const ToolInertia straight = tool_inertia(rod);
  EXPECT_NEAR(straight.largest_kg_m2, m * l * l / 3.0, 1e-15);
  EXPECT_NEAR(straight.about_T_kg_m2(2, 2), 0.0, 1e-15);
  EXPECT_LT((straight.centre_T_m - Vec3(0.0, 0.0, 0.5 * l)).norm(), 1e-15);

  rod.handle_S = {{0.0, 0.0, l}, {0.0, std::numbers::pi / 2.0, 0.0}};  // at the other end; T's x is −z of S
  const ToolInertia turned = tool_inertia(rod);
  EXPECT_NEAR(turned.largest_kg_m2, m * l * l / 3.0, 1e-15);
  EXPECT_NEAR(turned.about_T_kg_m2(0, 0), 0.0, 1e-15);
  EXPECT_LT((turned.centre_T_m - Vec3(0.5 * l, 0.0, 0.0)).norm(), 1e-15);
}

// A radian by joints_per_rad() turns the tool by that, and leaves it in its place.
TEST(HeldPlace, TurnsTheToolAboutItself) {
  for (const char* name : {"default", "seven"}) {
    const Arm arm = tests::shipped(name);
    ToolKinematics tool;
    arm.kinematics(arm.start_rad(), tool);
    const SmallColumns3 G = joints_per_rad(tool.J_W);
    // The damping of 1e-3 m/rad takes (λ/σ)²: 1e-4 for the σ of 0.1 m/rad and more that these poses have.
    EXPECT_LT((tool.J_W.bottomRows<3>() * G - Mat3::Identity()).cwiseAbs().maxCoeff(), 2e-3) << name;
    EXPECT_LT((tool.J_W.topRows<3>() * G).cwiseAbs().maxCoeff(), 2e-3) << name;
  }
}

}  // namespace
}  // namespace proxarm::models
