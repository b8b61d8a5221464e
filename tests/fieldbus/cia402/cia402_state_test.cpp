// The state machine of CiA 402-2: statuswords to states, states and goals to controlwords.
#include <gtest/gtest.h>

#include <array>

#include "fieldbus/cia402/cia402_state.hpp"

namespace proxarm::fieldbus {
namespace {

using enum DriveState;

TEST(Cia402State, StatuswordsAreReadByTheStandardsTable) {
  // The second word of each has the bits set that the table leaves open (voltage, warning, remote, target reached,
  // ...).
  const std::pair<std::uint16_t, DriveState> table[] = {
      {0x0000, not_ready_to_switch_on},
      {0xFFB0, not_ready_to_switch_on},
      {0x0040, switch_on_disabled},
      {0x0270, switch_on_disabled},
      {0x0021, ready_to_switch_on},
      {0x0231, ready_to_switch_on},
      {0x0023, switched_on},
      {0x0233, switched_on},
      {0x0027, operation_enabled},
      {0x1237, operation_enabled},
      {0x0007, quick_stop_active},
      {0x0217, quick_stop_active},
      {0x000F, fault_reaction_active},
      {0x023F, fault_reaction_active},
      {0x0008, fault},
      {0x0638, fault},
  };
  for (const auto& [word, state] : table) EXPECT_EQ(decode_state(word), state) << std::hex << word;
}

TEST(Cia402State, AWordThatNoRowFitsIsUnknown) {
  EXPECT_EQ(decode_state(0x0048), unknown);
  EXPECT_EQ(decode_state(0x0001), unknown);
}

TEST(Cia402State, EnablingTakesTransitions2And3And4) {
  const auto step = [](DriveState state) { return next_controlword(state, DriveGoal::operation_enabled, 0); };
  EXPECT_EQ(step(not_ready_to_switch_on).controlword, 0x0000);
  EXPECT_EQ(step(switch_on_disabled).controlword, 0x0006);
  EXPECT_EQ(step(switch_on_disabled).transition, 2);
  EXPECT_EQ(step(ready_to_switch_on).controlword, 0x0007);
  EXPECT_EQ(step(ready_to_switch_on).transition, 3);
  EXPECT_EQ(step(switched_on).controlword, 0x000F);
  EXPECT_EQ(step(switched_on).transition, 4);
  EXPECT_EQ(step(operation_enabled).controlword, 0x000F);
  EXPECT_EQ(step(operation_enabled).transition, -1);
}

TEST(Cia402State, AFaultIsNotResetByWantingOperation) {
  EXPECT_EQ(next_controlword(fault, DriveGoal::operation_enabled, 0).controlword, 0x0000);
  EXPECT_EQ(next_controlword(fault_reaction_active, DriveGoal::operation_enabled, 0).controlword, 0x0000);
}

TEST(Cia402State, AFaultIsResetByARisingEdgeOfBit7) {
  const ControlStep first = next_controlword(fault, DriveGoal::fault_reset, 0x0000);
  EXPECT_EQ(first.controlword, 0x0080);
  EXPECT_EQ(first.transition, 15);
  EXPECT_EQ(next_controlword(fault, DriveGoal::fault_reset, 0x0080).controlword, 0x0000) << "first let it fall";
  EXPECT_EQ(next_controlword(switch_on_disabled, DriveGoal::fault_reset, 0x0080).controlword, 0x0000);
}

TEST(Cia402State, SwitchingOffTakesTransitions8And7) {
  EXPECT_EQ(next_controlword(operation_enabled, DriveGoal::switched_off, 0x0F).controlword, 0x0006);
  EXPECT_EQ(next_controlword(operation_enabled, DriveGoal::switched_off, 0x0F).transition, 8);
  EXPECT_EQ(next_controlword(ready_to_switch_on, DriveGoal::switched_off, 0x06).controlword, 0x0000);
  EXPECT_EQ(next_controlword(ready_to_switch_on, DriveGoal::switched_off, 0x06).transition, 7);
}

TEST(Cia402State, QuickStopIsHeldUntilItsEnd) {
  EXPECT_EQ(next_controlword(operation_enabled, DriveGoal::quick_stop, 0x0F).controlword, 0x0002);
  EXPECT_EQ(next_controlword(operation_enabled, DriveGoal::quick_stop, 0x0F).transition, 11);
  EXPECT_EQ(next_controlword(quick_stop_active, DriveGoal::quick_stop, 0x02).controlword, 0x0002);
  EXPECT_EQ(next_controlword(switch_on_disabled, DriveGoal::quick_stop, 0x02).controlword, 0x0000);
}

// The drive's side of the standard's table, written down apart from ours: which state a controlword leads to.
DriveState obey(DriveState state, std::uint16_t word, std::uint16_t before) {
  const bool rising = (word & 0x80) != 0 && (before & 0x80) == 0;
  const bool disable_voltage = (word & 0x82) == 0x00;
  const bool quick_stop = (word & 0x86) == 0x02;
  const bool shutdown = (word & 0x87) == 0x06;
  const bool switch_on = (word & 0x8F) == 0x07;
  const bool enable = (word & 0x8F) == 0x0F;
  switch (state) {
    case not_ready_to_switch_on:
      return switch_on_disabled;
    case switch_on_disabled:
      return shutdown ? ready_to_switch_on : state;
    case ready_to_switch_on:
      return switch_on || enable ? switched_on : disable_voltage || quick_stop ? switch_on_disabled : state;
    case switched_on:
      return enable                          ? operation_enabled
             : shutdown                      ? ready_to_switch_on
             : disable_voltage || quick_stop ? switch_on_disabled
                                             : state;
    case operation_enabled:
      return switch_on         ? switched_on
             : shutdown        ? ready_to_switch_on
             : quick_stop      ? quick_stop_active
             : disable_voltage ? switch_on_disabled
                               : state;
    case quick_stop_active:
      return disable_voltage ? switch_on_disabled : state;
    case fault_reaction_active:
      return fault;
    case fault:
      return rising ? switch_on_disabled : state;
    case unknown:
      break;
  }
  return state;
}

TEST(Cia402State, EveryGoalIsReachedFromEveryStateAndHeld) {
  const std::array<std::pair<DriveGoal, DriveState>, 4> goals = {{{DriveGoal::operation_enabled, operation_enabled},
                                                                  {DriveGoal::switched_off, switch_on_disabled},
                                                                  {DriveGoal::fault_reset, switch_on_disabled},
                                                                  {DriveGoal::none, switch_on_disabled}}};
  for (const auto& [goal, wanted] : goals) {
    for (const DriveState from : {not_ready_to_switch_on, switch_on_disabled, ready_to_switch_on, switched_on,
                                  operation_enabled, quick_stop_active, fault_reaction_active, fault}) {
      const bool faulty = from == fault || from == fault_reaction_active;
      if (faulty && goal != DriveGoal::fault_reset) continue;
      DriveState state = from;
      std::uint16_t word = 0;
      for (int cycle = 0; cycle < 10; ++cycle) {
        const std::uint16_t next = next_controlword(state, goal, word).controlword;
        state = obey(state, next, word);
        word = next;
        // A quick stop ends by itself (605Ah = 2).
        if (state == quick_stop_active && goal == DriveGoal::switched_off) state = switch_on_disabled;
        if (state == quick_stop_active && goal == DriveGoal::fault_reset) state = switch_on_disabled;
      }
      EXPECT_EQ(state, wanted) << to_string(from) << " with goal " << static_cast<int>(goal);
    }
  }
}

TEST(Cia402State, NoGoalButOperationEverEnables) {
  for (unsigned word = 0; word <= 0xFFFF; word += 1) {
    const DriveState state = decode_state(static_cast<std::uint16_t>(word));
    for (const DriveGoal goal :
         {DriveGoal::none, DriveGoal::switched_off, DriveGoal::quick_stop, DriveGoal::fault_reset}) {
      EXPECT_NE(next_controlword(state, goal, 0).controlword & 0x0F, 0x0F);
    }
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
