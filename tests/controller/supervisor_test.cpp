#include "controller/supervisor.hpp"

#include <gtest/gtest.h>

#include <array>

namespace {

using proxarm::controller::describe;
using proxarm::controller::Event;
using proxarm::controller::Fault;
using proxarm::controller::FaultReport;
using proxarm::controller::Phase;
using proxarm::controller::Supervisor;

constexpr std::array all_events{Event::begin,   Event::enabled,  Event::tared, Event::stop,
                                Event::at_rest, Event::disabled, Event::fault};

Supervisor in_rendering() {
  Supervisor supervisor;
  for (const Event event : {Event::begin, Event::enabled, Event::tared}) supervisor.handle(event);
  return supervisor;
}

TEST(Supervisor, WalksTheWholeSession) {
  Supervisor supervisor = in_rendering();
  EXPECT_EQ(supervisor.phase(), Phase::rendering);
  for (const Event event : {Event::stop, Event::at_rest, Event::disabled}) supervisor.handle(event);
  EXPECT_EQ(supervisor.phase(), Phase::done);
  EXPECT_FALSE(supervisor.faulted());
}

// Whatever follows a stop or a fault, rendering is never entered again.
TEST(Supervisor, NeverRendersAgainOnceItHasStopped) {
  for (const Event first : {Event::stop, Event::fault}) {
    for (const Event second : all_events) {
      for (const Event third : all_events) {
        for (const Event fourth : all_events) {
          Supervisor supervisor = in_rendering();
          for (const Event event : {first, second, third, fourth}) {
            supervisor.handle(event);
            EXPECT_NE(supervisor.phase(), Phase::rendering);
          }
        }
      }
    }
  }
}

TEST(Supervisor, NeverRendersWithoutEnablingAndTaring) {
  Supervisor supervisor;
  for (const Event event : {Event::tared, Event::enabled, Event::at_rest, Event::disabled}) supervisor.handle(event);
  EXPECT_EQ(supervisor.phase(), Phase::idle);
}

TEST(Supervisor, KeepsTheFirstFault) {
  Supervisor supervisor = in_rendering();
  supervisor.raise({Fault::sensor_lost, -1, 17, 4.0, 3.0});
  supervisor.raise({Fault::drive_fault, 2, 18});
  EXPECT_EQ(supervisor.phase(), Phase::stopping);
  EXPECT_EQ(supervisor.report().fault, Fault::sensor_lost);
  EXPECT_EQ(supervisor.report().cycle, 17U);
}

TEST(Supervisor, AFaultBeforeAnythingMovesDisablesAtOnce) {
  Supervisor supervisor;
  supervisor.handle(Event::begin);
  supervisor.raise({Fault::drive_not_enabled, 3, 100});
  EXPECT_EQ(supervisor.phase(), Phase::disabling);
}

TEST(FaultText, EveryFaultHasANameOfItsOwn) {
  for (int i = 1; i <= static_cast<int>(Fault::interface_down); ++i) {
    EXPECT_STRNE(proxarm::controller::fault_name(static_cast<Fault>(i)), "none") << i;
  }
}

TEST(FaultText, OfAFaultAtTheStartSaysThatNothingHasMoved) {
  for (const Fault fault : {Fault::force_at_start, Fault::drive_not_enabled}) {
    const std::string text = describe({fault, 0, 100, 6.0, 5.0}, "");
    EXPECT_NE(text.find("had not begun to move"), std::string::npos) << text;
    EXPECT_EQ(text.find("controlled stop"), std::string::npos) << text;
  }
}

TEST(FaultText, EveryFaultSaysCauseReactionAndAdvice) {
  for (int i = 1; i <= static_cast<int>(Fault::interface_down); ++i) {
    const std::string text = describe({static_cast<Fault>(i), 0, 100, 6.0, 5.0}, "somewhere");
    const std::size_t cause = text.find(": "), did = text.find("; "), advice = text.rfind("; ");
    EXPECT_TRUE(cause < did && did < advice && advice + 10 < text.size()) << text;
  }
}

TEST(FaultText, DoesNotClaimDrivesToBeOffThatHaveNotSaidSo) {
  const FaultReport report{Fault::drive_silent, 2, 100, 5.0, 4.0};
  const std::string confirmed = describe(report, "drive of axis_3"), not_confirmed = describe(report, "", false);
  EXPECT_NE(confirmed.find("the drives were switched off"), std::string::npos) << confirmed;
  EXPECT_EQ(not_confirmed.find("the drives were switched off"), std::string::npos) << not_confirmed;
  EXPECT_NE(not_confirmed.find("not every drive has confirmed it"), std::string::npos) << not_confirmed;
  EXPECT_NE(describe({Fault::drive_not_disabled, 2, 100}, "", false).find("drive_not_disabled: a drive didn't confirm"),
            std::string::npos);
}

}  // namespace
