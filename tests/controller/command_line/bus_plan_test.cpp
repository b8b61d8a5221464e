#include "controller/preparation/bus_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"
#include "models/base/setup_error.hpp"
#include "tests/source_file.hpp"

namespace proxarm::command_line {
namespace {

// The default cell at 0.25 ms, which none of its buses can carry.
struct OverloadedTest : ::testing::Test {
  OverloadedTest() {
    options.cell = source_file("models/cells/default.yaml");
    session = controller::prepare(options);
    session.settings.period_s = 0.25e-3;
  }
  void require(const std::vector<std::string>& real) {
    controller::require_carried_on({"a", "b", "c"}, session, options, [&](const std::string& interface) {
      return std::find(real.begin(), real.end(), interface) == real.end();
    });
  }
  controller::RunOptions options;
  controller::PreparedSession session;
};

TEST_F(OverloadedTest, ARealBusThatCantCarryTheTimestepIsRefused) {
  for (const char* const bus : {"a", "b", "c"}) {
    try {
      require({bus});
      ADD_FAILURE() << bus;
    } catch (const description::SetupError& error) {
      EXPECT_NE(std::string(error.what()).find("proxarm plan"), std::string::npos) << error.what();
    }
  }
}

TEST_F(OverloadedTest, AVirtualOneIsWarnedOf) {
  ::testing::internal::CaptureStderr();
  EXPECT_NO_THROW(require({}));
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("on a real bus this would be refused"), std::string::npos);
}

TEST_F(OverloadedTest, WhatIsCarriedIsPassedInSilence) {
  session.settings.period_s = 1e-3;
  ::testing::internal::CaptureStderr();
  EXPECT_NO_THROW(require({"a", "b", "c"}));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// Alone, each of them fits.
TEST_F(OverloadedTest, BusesThatShareAnInterfaceAreOneWire) {
  session.settings.period_s = 1e-3;
  const auto real = [](const std::string&) { return false; };
  EXPECT_NO_THROW(controller::require_carried_on({"a", "b", "c"}, session, options, real));
  EXPECT_THROW(controller::require_carried_on({"a", "a", "a"}, session, options, real), description::SetupError);
}

}  // namespace
}  // namespace proxarm::command_line
