// The cycle takes nothing from the heap and waits for no page of memory, whatever it goes through: a session is
// recorded, and then played to a controller that runs alone, so that what is counted is its own.
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>

#include "tests/allocation_count.hpp"
#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/controller/closed_loop/replay_network.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RecordingNetwork;
using testing::ReplayNetwork;
using testing::RigOptions;

static_assert(noexcept(std::declval<Cycle&>().run_cycle(0)), "no exception leaves the cycle");
static_assert(noexcept(std::declval<Cycle&>().request_stop()));
static_assert(noexcept(std::declval<Cycle&>().shut_down()));
static_assert(noexcept(std::declval<RenderedWorld&>().step(std::declval<const models::Vec3&>(),
                                                           std::declval<const StepLimits&>())));
static_assert(noexcept(std::declval<fieldbus::ServoDrive&>().encode_rpdo(std::declval<fieldbus::CanFrame&>())));

struct Played {
  std::vector<CycleRecord> records;
  std::uint64_t allocations = 0;
  std::uint64_t first_cycle_with_one = 0;
  PageFaults page_faults;  // from the first cycle on
  Fault fault = Fault::none;
  std::uint64_t contact_cycles = 0, slip_cycles = 0;
};

Played play(const RigOptions& options, std::vector<CycleRecord>* recorded) {
  ClosedLoopRig rig(options);
  RecordingNetwork recorder(rig.network);
  rig.run(recorder);
  if (recorded != nullptr) *recorded = rig.records;

  ClosedLoopRig parts_of(options);  // for its descriptions and its scene; its far end stays alone
  std::vector<std::string> buses;
  for (const auto& bus : rig.cell.buses) buses.push_back(bus.name);
  ReplayNetwork network(recorder.recording(), buses);
  Cycle cycle(parts_of.prepared_parts(network), options.settings, parts_of.cell.limits, 64);
  BlackBox box(options.settings.period_s, 40);
  cycle.write_to(box);
  cycle.timesteps().schedule(options.timesteps);
  Played played;
  played.records.reserve(rig.records.size() + 10);
  const std::int64_t wanted_ns = std::llround(1e9 * options.duration_s);
  for (std::int64_t t_k_ns = rig.first_cycle_ns; cycle.supervisor().phase() != Phase::done;
       t_k_ns += cycle.period_ns()) {
    network.sleep_until(t_k_ns);
    const std::uint64_t before = tests::allocation_count();
    const PageFaults faults_before = thread_page_faults();
    cycle.run_cycle(t_k_ns);
    if (cycle.rendered_ns() >= wanted_ns) cycle.request_stop();
    const PageFaults faults = thread_page_faults().since(faults_before);
    played.page_faults.minor += faults.minor;
    played.page_faults.major += faults.major;
    const std::uint64_t taken = tests::allocation_count() - before;
    if (taken > 0 && played.allocations == 0) played.first_cycle_with_one = played.records.size();
    played.allocations += taken;
    CycleRecord record;
    while (cycle.records().pop(record)) {
      played.contact_cycles += record.contact_count > 0 ? 1 : 0;
      played.slip_cycles += record.contact == ContactPhase::slip ? 1 : 0;
      played.records.push_back(record);
    }
    if (played.records.size() > rig.records.size() + 5) break;  // it isn't the same session
  }
  played.fault = cycle.supervisor().report().fault;
  return played;
}

void expect_no_allocation(const RigOptions& options, Fault fault, Played* out = nullptr) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  std::vector<CycleRecord> recorded;
  const Played played = play(options, &recorded);
  EXPECT_EQ(played.allocations, 0u) << "the first in cycle " << played.first_cycle_with_one;
  EXPECT_EQ(fault_name(played.fault), std::string(fault_name(fault)));
  // What was counted is what ran in the closed loop, setpoint by setpoint.
  ASSERT_EQ(played.records.size(), recorded.size());
  for (std::size_t k = 0; k < recorded.size(); ++k) {
    ASSERT_EQ(played.records[k].target_counts, recorded[k].target_counts) << "cycle " << k;
  }
  if (out != nullptr) *out = played;
}

TEST(CycleAllocation, IsNoneFromTheFirstCycleThroughContactToTheStop) {
  Played played;
  expect_no_allocation({.duration_s = 9.0}, Fault::none, &played);
  if (IsSkipped()) return;
  EXPECT_GT(played.records.size(), 9000u);
  EXPECT_GT(played.contact_cycles, 3000u);
  EXPECT_GT(played.slip_cycles, 1000u);
}

TEST(CycleAllocation, IsNoneInTwoContactsAtOnce) {
  expect_no_allocation({.duration_s = 3.0, .scene = "scenes/groove.yaml"}, Fault::none);
}

TEST(CycleAllocation, IsNoneWithATurningTool) {
  RigOptions options{.duration_s = 2.0};
  options.settings.orientation = OrientationMode::free;
  options.settings.passivity = Passivity::on;
  expect_no_allocation(options, Fault::none);
}

TEST(CycleAllocation, IsNoneWithTheSecondOrderProxy) {
  RigOptions options{.duration_s = 6.0};
  options.settings.order = 2;
  options.settings.damping_Ns_per_m = 20.0;
  options.settings.spring_N_per_m = 50.0;
  expect_no_allocation(options, Fault::none);
}

TEST(CycleAllocation, IsNoneInTheImpedanceType) {
  RigOptions options{.duration_s = 6.0, .cell = "models/cells/light.yaml"};
  options.settings.scheme = Scheme::impedance;
  Played played;
  expect_no_allocation(options, Fault::none, &played);
  if (IsSkipped()) return;
  EXPECT_GT(played.slip_cycles, 100u);
}

TEST(CycleAllocation, IsNoneWithTwoAxesNorWithSeven) {
  RigOptions bench{.duration_s = 6.0,
                   .cell = "models/cells/bench.yaml",
                   .scene = "scenes/bench.yaml",
                   .hand = "sim/hands/bench.yaml"};
  bench.settings.receive_window = 0.55;
  Played played;
  expect_no_allocation(bench, Fault::none, &played);
  if (IsSkipped()) return;
  EXPECT_GT(played.slip_cycles, 100u);
  for (const char* cell : {"models/cells/linear.yaml", "models/cells/scara.yaml", "models/cells/seven.yaml"}) {
    RigOptions options{.duration_s = 4.0, .cell = cell, .scene = "scenes/free.yaml"};
    options.settings.receive_window = 0.55;
    expect_no_allocation(options, Fault::none);
  }
}

TEST(CycleAllocation, IsNoneInAFaultAndTheStopAfterIt) {
  expect_no_allocation({.device_faults = {"sensor:silent@1.9s"}}, Fault::sensor_lost);
  expect_no_allocation({.device_faults = {"axis_3:fault=0x4210@1.9s"}}, Fault::drive_fault);
  expect_no_allocation({.device_faults = {"axis_2:silent@1.9s"}}, Fault::drive_silent);
  expect_no_allocation({.device_faults = {"sensor:frozen@1.9s"}}, Fault::sensor_frozen);
  expect_no_allocation({.device_faults = {"axis_2:runaway=0.5@1.9s"}}, Fault::drive_deviates);
}

TEST(CycleAllocation, IsNoneInAChangeOfTheTimestep) {
  RigOptions options{.duration_s = 2.0};
  options.settings.passivity = Passivity::on;
  const Timestep to{.period_s = 2e-3, .max_missed_samples = 3, .max_repeated_samples = 20};
  options.timesteps = {{1'000'000'000, to}};
  expect_no_allocation(options, Fault::none);
  options.device_faults = {"axis_5:period"};
  expect_no_allocation(options, Fault::none);
}

// As a session on interfaces does (realtime.cpp): with locked memory there is none, from the first cycle to the stop.
// Needs RLIMIT_MEMLOCK of some 200 MB, or root.
TEST(CycleAllocation, WaitsForNoPageOfLockedMemory) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's memory can't be locked";
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) GTEST_SKIP() << "mlockall: " << std::strerror(errno);
  const Played moved = play({.duration_s = 6.0}, nullptr);
  const Played stopped = play({.device_faults = {"sensor:silent@1.9s"}}, nullptr);
  munlockall();
  EXPECT_GT(moved.slip_cycles, 100u);
  EXPECT_EQ(stopped.fault, Fault::sensor_lost);
  for (const Played* played : {&moved, &stopped}) {
    EXPECT_EQ(played->page_faults.minor, 0);
    EXPECT_EQ(played->page_faults.major, 0);
  }
}

TEST(CycleAllocation, PageFaultsOfThisThreadAreCounted) {
  constexpr std::size_t bytes = 16 * 4096;
  void* fresh = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(fresh, MAP_FAILED);
  const PageFaults before = thread_page_faults();
  for (std::size_t i = 0; i < bytes; i += 4096) static_cast<volatile char*>(fresh)[i] = 1;
  EXPECT_GE(thread_page_faults().since(before).minor, 1);
  munmap(fresh, bytes);
}

}  // namespace
}  // namespace proxarm::controller
