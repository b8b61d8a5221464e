// Sessions that end well, by a fault, or because their controller dies in motion, one after the other on the same arm,
// whose drives stay on: with each kind of CANopen stack (sim/canopen/stack_behaviour.hpp).
//
// Judged on the wire and by the drives themselves: no EMCY after a clean end, the next session always starts, and a
// drive whose controller died has stopped within what `proxarm prove --bus-loss` measured of it before.
// Three of each end; PROXARM_TEST_SCALE=17 makes them 51.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/extras/proof/bus_loss.hpp"
#include "fieldbus/cia402/silence_watch.hpp"
#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RigOptions;

constexpr std::int64_t ms = 1'000'000, period_ns = ms;
// A drive looks at its timers every millisecond; the last frames take half of one.
constexpr std::int64_t drives_clock_ns = 2 * ms;

struct Sent {
  std::int64_t time_ns;
  std::uint32_t id;
  std::uint16_t code;
};

class Endings : public ::testing::TestWithParam<const char*> {
 protected:
  Endings() : rig(options()) {
    rig.network.set_observer([this](const fieldbus::WireFrame& wire) {
      if (wire.frame.id <= 0x080 || wire.frame.id > 0x0FF || wire.sender == "controller") return;
      const auto code = static_cast<std::uint16_t>(wire.frame.data[0] | wire.frame.data[1] << 8);
      if (code != 0) emergencies.push_back({wire.end_ns, wire.frame.id, code});
    });
  }

  static RigOptions options() {
    RigOptions options;
    options.scene = "scenes/free.yaml";
    options.edit_cell = [](description::Cell& cell) {
      for (description::DriveDescription& drive : cell.drives) drive.simulation.stack = GetParam();
    };
    // Sways by some newtons, so that the arm moves and the handle may be tared.
    options.edit_hand = [](description::HandDescription& hand) {
      for (description::Waypoint& waypoint : hand.waypoints) waypoint.offset_m = {};
      hand.multisine = {{.frequency_Hz = 0.7, .amplitude_m = 0.004}, {.frequency_Hz = 1.1, .amplitude_m = 0.003}};
    };
    return options;
  }

  // Begins a session, as a new process would, and lets it render for 0.2 s.
  void begin() {
    cycle = std::make_unique<Cycle>(rig.prepared_parts(rig.network), rig.options.settings, rig.cell.limits, 64);
    t_k_ns = rig.network.now_ns() + period_ns;
    const bool rendered = run_until([&] { return cycle->rendered_ns() >= 200 * ms; }, 3'000);
    ASSERT_TRUE(rendered) << "the session doesn't start: " << describe(cycle->supervisor().report(), "");
    ASSERT_EQ(cycle->supervisor().report().fault, Fault::none);
  }

  template <typename Done>
  bool run_until(const Done& done, int cycles) {
    for (int i = 0; i < cycles && cycle->supervisor().phase() != Phase::done; ++i) {
      rig.network.sleep_until(t_k_ns);
      cycle->run_cycle(t_k_ns);
      CycleRecord record;
      while (cycle->records().pop(record)) {
      }
      t_k_ns += period_ns;
      if (done()) return true;
    }
    return done();
  }

  void end() {
    ASSERT_TRUE(run_until([&] { return cycle->supervisor().phase() == Phase::done; }, 5'000));
    cycle->shut_down();
    rig.network.sleep_until(rig.network.now_ns() + 300 * ms);
    cycle.reset();
  }

  // Of the drives themselves: none moves its axis any more.
  [[nodiscard]] bool all_stopped() {
    for (std::size_t i = 0; i < rig.cell.drives.size(); ++i) {
      if (rig.far_end.drive(i).state() == sim::DriveState::operation_enabled) return false;
    }
    return true;
  }

  // The controller is gone from now on; until no drive is enabled any more.
  std::int64_t time_to_stop() {
    const std::int64_t last_word_ns = t_k_ns - period_ns;
    cycle.reset();
    while (!all_stopped() && rig.network.now_ns() < last_word_ns + 2'000 * ms) {
      rig.network.sleep_until(rig.network.now_ns() + ms / 4);
    }
    const std::int64_t took_ns = rig.network.now_ns() - last_word_ns;
    rig.network.sleep_until(rig.network.now_ns() + 300 * ms);
    return took_ns;
  }

  // The slowest drive, as `proxarm prove --bus-loss` finds it.
  std::int64_t proven_stop() {
    CycleParts parts = rig.prepared_parts(rig.network);
    fieldbus::ask_for_words(rig.network, parts.can_drives);
    proof::BusLossSession silence(std::move(parts), rig.options.settings, rig.cell);
    for (std::int64_t t_ns = rig.network.now_ns() + period_ns; !silence.done(); t_ns += period_ns) {
      rig.network.sleep_until(t_ns);
      silence.run_cycle(t_ns);
    }
    silence.ask_the_others();
    silence.shut_down();
    rig.network.sleep_until(rig.network.now_ns() + 300 * ms);
    double slowest_s = 0.0;
    for (const proof::OwnStop& stop : silence.own_stops()) {
      EXPECT_GE(stop.reacts_s, 0.0) << stop.joint;
      EXPECT_TRUE(stop.off_at_last) << stop.joint;
      slowest_s = std::max(slowest_s, stop.reacts_s);
    }
    EXPECT_EQ(silence.own_stops().size(), rig.cell.drives.size());
    return std::llround(1e9 * slowest_s);
  }

  ClosedLoopRig rig;
  std::unique_ptr<Cycle> cycle;
  std::int64_t t_k_ns = 0;
  std::vector<Sent> emergencies;
};

TEST_P(Endings, LeaveNoEmcyWhenTheyAreCleanAndAlwaysLetTheNextSessionBegin) {
  const int times = sim::scaled(3);
  const std::int64_t proven_ns = proven_stop();
  EXPECT_LE(proven_ns, std::llround(1e9 * rig.cell.supervision.bus_loss_stop_s) + drives_clock_ns);
  std::int64_t slowest_ns = 0;
  std::size_t after_faults = 0;
  for (int i = 0; i < times; ++i) {
    SCOPED_TRACE("round " + std::to_string(i));
    begin();
    if (HasFatalFailure()) return;
    emergencies.clear();
    cycle->request_stop();
    end();
    if (HasFatalFailure()) return;
    EXPECT_TRUE(emergencies.empty()) << "after a clean end: EMCY " << std::hex << emergencies.front().code;

    begin();
    if (HasFatalFailure()) return;
    // A stack that watches SYNC in pre-operational, too, misses it from 1006h's set-up to the first one (8100h).
    emergencies.clear();
    const auto axis = static_cast<std::size_t>(i) % rig.cell.drives.size();
    rig.far_end.drive(axis).inject_fault(0x4210, rig.network.now_ns());
    end();
    if (HasFatalFailure()) return;
    EXPECT_TRUE(all_stopped());
    after_faults += static_cast<std::size_t>(
        std::count_if(emergencies.begin(), emergencies.end(), [](const Sent& sent) { return sent.code != 0x4210; }));

    begin();
    if (HasFatalFailure()) return;
    // Somewhere between two heartbeats, another place each time.
    (void)run_until([] { return false; }, i * 7 % 20);
    const std::int64_t took_ns = time_to_stop();
    slowest_ns = std::max(slowest_ns, took_ns);
    EXPECT_TRUE(all_stopped());
    EXPECT_LE(took_ns, proven_ns + drives_clock_ns);
    EXPECT_LE(took_ns, std::llround(1e9 * rig.cell.supervision.bus_loss_stop_s) + drives_clock_ns);
  }
  EXPECT_EQ(after_faults, 0u) << "a fault's own EMCY is the only one";
  begin();
  if (HasFatalFailure()) return;
  cycle->request_stop();
  end();
  std::printf("%s: %d of each end; stop proven %.2f ms, slowest after a kill %.2f ms\n", GetParam(), times,
              1e-6 * static_cast<double>(proven_ns), 1e-6 * static_cast<double>(slowest_ns));
}

INSTANTIATE_TEST_SUITE_P(OfEachStack, Endings, ::testing::Values("strict", "latching", "lazy", "holding", "insisting"),
                         [](const auto& stack) { return std::string(stack.param); });

}  // namespace
}  // namespace proxarm::controller
