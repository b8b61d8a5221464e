#include "controller/cycle/cycle_status.hpp"

#include <gtest/gtest.h>

namespace proxarm::controller {
namespace {

constexpr Phase all_phases[]{Phase::idle,    Phase::enabling, Phase::taring,    Phase::rendering, Phase::holding,
                             Phase::freeing, Phase::stopping, Phase::disabling, Phase::faulted,   Phase::done};

bool takes(const ShownCycle& shown, Order order) {
  CycleStatus status(1e-3, nullptr);
  status.show(shown);
  return status.refusal(order) == nullptr;
}

TEST(CycleStatus, TakesEachOrderInItsPhasesAlone) {
  for (const Phase phase : all_phases) {
    const ShownCycle shown{.phase = phase, .period_s = 1e-3};
    EXPECT_EQ(takes(shown, Order::hold), phase == Phase::rendering || phase == Phase::freeing) << phase_name(phase);
    EXPECT_EQ(takes(shown, Order::reset), phase == Phase::faulted) << phase_name(phase);
    for (const Order order : {Order::resume, Order::release, Order::back_off}) {
      EXPECT_EQ(takes(shown, order), phase == Phase::holding) << phase_name(phase);
    }
  }
}

TEST(CycleStatus, RefusesToGoOnWhileTheEnablingInputIsReleased) {
  EXPECT_FALSE(takes({.phase = Phase::holding, .pressed = false}, Order::resume));
  EXPECT_FALSE(takes({.phase = Phase::faulted, .pressed = false}, Order::reset));
  EXPECT_TRUE(takes({.phase = Phase::rendering, .pressed = false}, Order::hold)) << "a hold needs no permission";
}

TEST(CycleStatus, RefusesToGoOnWhileTheCauseLasts) {
  for (const Order order : {Order::resume, Order::release, Order::back_off}) {
    EXPECT_FALSE(takes({.phase = Phase::holding, .cause_lasts = true}, order));
  }
}

TEST(CycleStatus, LeavesHoldAndResumeOpenInAChangeOfTheTimestep) {
  const ShownCycle changing{.phase = Phase::holding, .changes_timestep = true};
  EXPECT_TRUE(takes(changing, Order::hold)) << "so that it doesn't go on by itself";
  EXPECT_TRUE(takes(changing, Order::resume));
  EXPECT_FALSE(takes(changing, Order::release));
  EXPECT_FALSE(takes(changing, Order::back_off));
  EXPECT_FALSE(takes({.phase = Phase::faulted, .changes_timestep = true}, Order::reset));
}

TEST(CycleStatus, LetsTheTimestepBeChangedInRenderingAndInAHold) {
  for (const Phase phase : all_phases) {
    CycleStatus status(1e-3, nullptr);
    status.show({.phase = phase, .period_s = 1e-3});
    EXPECT_EQ(status.timestep_refusal() == nullptr, phase == Phase::rendering || phase == Phase::holding);
    status.show({.phase = phase, .period_s = 1e-3, .changes_timestep = true});
    EXPECT_NE(status.timestep_refusal(), nullptr);
  }
  CycleStatus fixed(1e-3, "a reason");
  fixed.show({.phase = Phase::rendering, .period_s = 1e-3});
  EXPECT_STREQ(fixed.timestep_refusal(), "a reason");
}

TEST(CycleStatus, CountsATimestepAsAnsweredWhenItIsOver) {
  CycleStatus status(1e-3, nullptr);
  EXPECT_EQ(status.period_s(), 1e-3) << "before the first cycle";
  status.show({.period_s = 1e-3, .changes_timestep = true, .timesteps_answered = false, .asked_timesteps = 1});
  EXPECT_EQ(status.answered_timesteps(), 0u);
  status.show({.period_s = 2e-3, .asked_timesteps = 1});
  EXPECT_EQ(status.answered_timesteps(), 1u);
  EXPECT_EQ(status.period_s(), 2e-3);
}

TEST(CycleStatus, KeepsARequestToStop) {
  CycleStatus status(1e-3, nullptr);
  EXPECT_FALSE(status.stop_requested());
  status.request_stop();
  status.show({});
  EXPECT_TRUE(status.stop_requested());
}

}  // namespace
}  // namespace proxarm::controller
