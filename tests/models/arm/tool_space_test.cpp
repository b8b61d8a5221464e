#include "models/arm/tool_space.hpp"

#include <gtest/gtest.h>

#include "models/arm/inverse_kinematics.hpp"
#include "models/base/setup_error.hpp"
#include "tests/models/arm/few_axes.hpp"

namespace proxarm::models {
namespace {

using tests::chain;
using tests::shipped;

TEST(ToolSpace, IsALineAPlaneOrAllOfW) {
  EXPECT_EQ(tool_space(shipped("default")).dimensions, 3);
  EXPECT_EQ(tool_space(shipped("gantry")).dimensions, 3);
  const ToolSpace line = tool_space(shipped("linear"));
  EXPECT_EQ(line.dimensions, 1);
  EXPECT_EQ(line.axes.col(0), Vec3::UnitX());
  const ToolSpace plane = tool_space(shipped("bench"));
  EXPECT_EQ(plane.dimensions, 2);
  EXPECT_EQ(plane.axes.col(0), Vec3::UnitX());
  EXPECT_EQ(plane.axes.col(1), Vec3::UnitZ());
}

TEST(ToolSpace, HasOrthonormalAxesInAnyAttitude) {
  for (const char* turned : {"0.3 0.2 0.1", "1.2 -0.7 2", "0 1.5707963267948966 0"}) {
    const Arm arm = chain({{"revolute", "0 0 1"}, {"revolute", "0 0 1"}}, turned);
    const ToolSpace space = tool_space(arm);
    EXPECT_EQ(space.dimensions, 2) << turned;
    EXPECT_LT((space.axes.transpose() * space.axes - Mat3::Identity()).cwiseAbs().maxCoeff(), 1e-14) << turned;
    ToolKinematics tool;
    arm.kinematics(arm.start_rad(), tool);
    const auto J = tool.J_W.topRows<3>();
    EXPECT_LT((J - space.projection() * J).cwiseAbs().maxCoeff(), 1e-14) << turned;
  }
}

TEST(ToolSpace, TakesAQuarterTurnWrittenWithFourDigitsForOne) {
  // 1.5708 is off by 4e-6: the second axis isn't quite parallel to the first.
  const Arm arm = chain({{"revolute", "0 0 1"}, {"revolute", "0 1 0", "1.5708 0 0"}});
  EXPECT_EQ(tool_space(arm).dimensions, 2);
  EXPECT_EQ(tool_space(arm).projection(), Mat3(Vec3(1, 1, 0).asDiagonal()));
}

TEST(ToolSpace, OfAnArmThatOnlyTurnsItsToolIsNone) {
  const Arm arm = chain({{"revolute", "1 0 0"}});  // T lies on that axis
  EXPECT_EQ(tool_space(arm).dimensions, 0);
  EXPECT_THROW(InverseKinematics{arm}, description::SetupError);
}

TEST(ToolSpace, AToolThatKeepsToACurveIsRefusedWithWords) {
  const auto refusal = [](const Arm& arm) -> std::string {
    try {
      const InverseKinematics inverse(arm);
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal(chain({{"revolute", "0 0 1"}})).find("1 axis, which leads the tool along a curve"),
            std::string::npos);
  EXPECT_NE(refusal(chain({{"revolute", "0 0 1"}, {"revolute", "0 1 0"}}))
                .find("2 axes, which lead the tool over a curved surface"),
            std::string::npos);
  EXPECT_EQ(refusal(chain({{"prismatic", "1 1 0"}})), "");
}

}  // namespace
}  // namespace proxarm::models
