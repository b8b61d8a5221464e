// The timestep changed in a running session: the arm comes to rest, the drives are told, rendering goes on; whatever
// comes between, nothing moves beyond a limit, nothing jumps, and drives and cycle have one period.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "fieldbus/cia402/cia402_units.hpp"
#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/controller/closed_loop/joint_limits.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::expect_within_joint_limits;
using testing::RigOptions;

constexpr std::int64_t ms = 1'000'000;

Timestep timestep(double period_ms) {
  return {.period_s = 1e-3 * period_ms, .max_missed_samples = 3, .max_repeated_samples = 20};
}

// Each cycle begins where the one before said, but for those that were late.
void expect_times_right(const ClosedLoopRig& rig) {
  for (std::size_t k = 1; k < rig.records.size(); ++k) {
    ASSERT_EQ(rig.records[k].time_ns - rig.records[k - 1].time_ns, rig.records[k - 1].period_ns) << k;
  }
}

std::int64_t period_of_drive(ClosedLoopRig& rig, std::size_t axis) {
  const sim::ObjectDictionary& od = rig.far_end.drive(axis).canopen().dictionary();
  const double period_s =
      static_cast<double>(od.number(0x60C2, 1)) * std::pow(10.0, static_cast<double>(od.number(0x60C2, 2)));
  return std::llround(1e9 * period_s);
}

// Keeps 1006h of all drives as it was in the session: the goodbye sets it to 0.
class TimestepRig : public ClosedLoopRig {
 public:
  explicit TimestepRig(const RigOptions& rig) : ClosedLoopRig(rig) {
    options.before_goodbye = [this](sim::SimulatedCell& simulated) {
      for (std::size_t axis = 0; axis < 6; ++axis) {
        sync_period_us[axis] = simulated.drive(axis).canopen().dictionary().number(0x1006);
      }
    };
  }
  TimestepRig(const TimestepRig&) = delete;
  TimestepRig& operator=(const TimestepRig&) = delete;

  std::array<std::int64_t, 6> sync_period_us{};
};

// 60C2h, 1006h and the RPDO's timer of all drives.
void expect_drives_at(TimestepRig& rig, std::int64_t period_ns) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const sim::ObjectDictionary& od = rig.far_end.drive(axis).canopen().dictionary();
    EXPECT_EQ(period_of_drive(rig, axis), period_ns) << axis;
    EXPECT_EQ(rig.sync_period_us[axis], period_ns / 1000) << axis;
    EXPECT_EQ(od.number(0x1400, 5), (5 * period_ns + 999'999) / ms) << axis;
  }
}

std::size_t first(const ClosedLoopRig& rig, std::size_t from, const std::function<bool(const CycleRecord&)>& is) {
  std::size_t k = from;
  while (k < rig.records.size() && !is(rig.records[k])) ++k;
  return k;
}
bool changing(const CycleRecord& r) { return r.has(RecordFlag::timestep); }
bool steady(const CycleRecord& r) { return !changing(r); }
bool rendering(const CycleRecord& r) { return r.phase == Phase::rendering; }

// Setpoints' steps, speeds and accelerations from the order to a fifth of a second after rendering goes on, as shares
// of their limits; the step of the cycle in which it goes on, in counts.
struct Measured {
  double pause_ms = 0.0, speed = 0.0, acceleration = 0.0;
  std::int64_t first_step = 0;
};
Measured measure(const ClosedLoopRig& rig, std::size_t asked, std::size_t resumed) {
  Measured m;
  m.pause_ms = 1e-6 * static_cast<double>(rig.records[resumed].time_ns - rig.records[asked].time_ns);
  const std::int64_t end_ns = rig.records[resumed].time_ns + 200 * ms;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const description::DriveDescription& drive = rig.cell.drives[axis];
    const double per_rad = std::abs(drive.counts_per_rad());
    const auto speed = [&](std::size_t k) {
      return (rig.records[k].target_counts[axis] - rig.records[k - 1].target_counts[axis]) /
             (1e-9 * static_cast<double>(rig.records[k].period_ns) * per_rad);
    };
    m.first_step = std::max<std::int64_t>(m.first_step, std::abs(rig.records[resumed].target_counts[axis] -
                                                                 rig.records[resumed - 1].target_counts[axis]));
    for (std::size_t k = asked; k < rig.records.size() && rig.records[k].time_ns <= end_ns; ++k) {
      const double T = 1e-9 * static_cast<double>(rig.records[k].period_ns);
      m.speed = std::max(m.speed, std::abs(speed(k)) / drive.max_speed_rad_per_s);
      m.acceleration =
          std::max(m.acceleration, std::abs(speed(k) - speed(k - 1)) / T / drive.max_acceleration_rad_per_s2);
    }
  }
  return m;
}

struct Course {
  const char* name;
  RigOptions options;
};
std::vector<Course> courses() {
  RigOptions moving{.duration_s = 6.0, .scene = "scenes/free.yaml", .hand = "sim/hands/sweep.yaml"};
  RigOptions contact{.duration_s = 8.0};
  RigOptions limits = moving;
  limits.edit_cell = [](description::Cell& cell) {
    cell.limits.max_tool_speed_m_per_s = 0.05;
    for (description::DriveDescription& drive : cell.drives) {
      drive.max_speed_rad_per_s *= 0.2;
      drive.max_acceleration_rad_per_s2 *= 0.3;
    }
  };
  RigOptions unfiltered = moving;
  unfiltered.edit_cell = [](description::Cell& cell) { cell.limits.setpoint_bandwidth_Hz = 0.0; };
  unfiltered.settings.mass_kg = 12.0;
  RigOptions second = contact;
  second.settings.order = 2;
  second.settings.passivity = Passivity::on;
  second.settings.orientation = OrientationMode::free;
  return {{"moving", moving}, {"contact", contact}, {"limits", limits}, {"no filter", unfiltered}, {"order 2", second}};
}

TEST(TimestepChange, IsFeltByNobodyFromOneToTwoToOneToFourMilliseconds) {
  for (Course& course : courses()) {
    SCOPED_TRACE(course.name);
    course.options.settings.mass_kg = std::max(course.options.settings.mass_kg, 6.0);
    const std::int64_t last_ns = std::llround(1e9 * course.options.duration_s) - 500 * ms;
    course.options.timesteps = {{1000 * ms, timestep(2)}, {2300 * ms, timestep(1)}, {last_ns, timestep(4)}};
    TimestepRig rig(course.options);
    rig.run();
    ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
    expect_within_joint_limits(rig);
    expect_times_right(rig);
    expect_drives_at(rig, 4 * ms);
    EXPECT_EQ(rig.cycle->rendered_ns(), std::llround(1e9 * course.options.duration_s));
    std::size_t k = 0;
    for (const std::int64_t period_ns : {2 * ms, 1 * ms, 4 * ms}) {
      const std::size_t asked = first(rig, k, changing), told = first(rig, asked, steady);
      const std::size_t resumed = first(rig, told, rendering);
      ASSERT_LT(resumed, rig.records.size());
      EXPECT_EQ(rig.records[told].period_ns, period_ns);
      EXPECT_EQ(resumed, told) << "at once: nobody is asked";
      EXPECT_TRUE(rig.records[resumed].has(RecordFlag::ramp_in));
      const Measured m = measure(rig, asked, resumed);
      std::printf(
          "%-10s to %lld ms: %3.0f ms, speed %.3f and acceleration %.3f of the limits, first step %lld counts\n",
          course.name, static_cast<long long>(period_ns / ms), m.pause_ms, m.speed, m.acceleration,
          static_cast<long long>(m.first_step));
      // The joints' stop, three cycles of rest, four objects of three drives written and read at a cycle each.
      EXPECT_LT(m.pause_ms, 250.0);
      // Rounding of two angles to counts, and the first step under h · T/ramp_in_s, at 0.2 m or more from any axis.
      const double T = 1e-9 * static_cast<double>(period_ns),
                   M = course.options.settings.mass_kg - rig.cell.tool.mass_kg;
      const double step_m =
          T * T * vec3(rig.records[resumed].force_W_N).norm() / M * T / rig.cell.supervision.ramp_in_s;
      double per_rad = 0.0;
      for (const auto& drive : rig.cell.drives) per_rad = std::max(per_rad, std::abs(drive.counts_per_rad()));
      EXPECT_LE(static_cast<double>(m.first_step), 3.0 + per_rad * step_m / 0.2);
      // Drives are told while the setpoints don't move at all, and the arm doesn't either.
      const std::size_t rest = told - 3;
      EXPECT_EQ(rig.records[rest].target_counts, rig.records[told - 1].target_counts);
      EXPECT_LT((rig.truths[rest].X_WT.translation() - rig.truths[told].X_WT.translation()).norm(), 1e-3);
      k = resumed;
    }
  }
}

// Of six drives one refuses 60C2h while it is enabled. The others have taken it, some of them, and are told back.
TEST(TimestepChange, IsTakenBackWhereADriveRefuses) {
  for (const char* drive : {"axis_1:period", "axis_3:period", "axis_5:period"}) {
    for (const double period_ms : {2.0, 4.0, 0.5}) {
      SCOPED_TRACE(std::string(drive) + " to " + std::to_string(period_ms));
      RigOptions options{.device_faults = {drive}};
      options.settings.period_s = period_ms < 1.0 ? 2e-3 : 1e-3;
      if (period_ms < 1.0) options.settings.mass_kg = 6.0;
      const double wanted_ms = period_ms < 1.0 ? 1.0 : period_ms;
      options.timesteps = {{1000 * ms, timestep(wanted_ms)}};
      TimestepRig rig(options);
      rig.run();
      ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
      expect_within_joint_limits(rig);
      expect_times_right(rig);
      expect_drives_at(rig, std::llround(1e9 * options.settings.period_s));
      const std::size_t refused = first(rig, 0, [](const CycleRecord& r) { return r.refused_period_ns > 0; });
      ASSERT_LT(refused, rig.records.size());
      EXPECT_EQ(rig.records[refused].timestep_refusal.drive, drive[5] - '1');
      EXPECT_EQ(rig.records[refused].timestep_refusal.index, 0x60C2);
      EXPECT_EQ(rig.records[refused].timestep_refusal.code, 0x08000022u);
      const std::size_t told = first(rig, refused, steady);
      EXPECT_EQ(rig.records[told].phase, Phase::rendering);
      EXPECT_EQ(rig.records[told].period_ns, std::llround(1e9 * options.settings.period_s));
      EXPECT_EQ(rig.cycle->rendered_ns(), 2500 * ms);
    }
  }
}

// An SDO answer that is lost is asked for again; a drive that answers none of them for a while has the change taken
// back, and confirms that once it answers again.
TEST(TimestepChange, OutlivesLostAnswers) {
  for (const std::uint64_t lost : {1, 2}) {
    SCOPED_TRACE(lost);
    RigOptions options;
    options.timesteps = {{1000 * ms, timestep(2)}};
    options.script = {{{.action = fieldbus::FaultAction::drop,
                        .bus = "axes_4_6",
                        .id = 0x585,
                        .mask = 0x7FF,
                        .from_ns = 1200 * ms,
                        .count = lost,
                        .receiver = "controller"}}};
    TimestepRig rig(options);
    rig.run();
    ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
    expect_within_joint_limits(rig);
    expect_drives_at(rig, lost == 1 ? 2 * ms : 1 * ms);
    const std::size_t refused = first(rig, 0, [](const CycleRecord& r) { return r.refused_period_ns > 0; });
    ASSERT_EQ(refused < rig.records.size(), lost == 2);
    if (lost == 2) {
      EXPECT_EQ(rig.records[refused].timestep_refusal.code, 0x05040000u);
    }
    EXPECT_EQ(rig.records.back().period_ns, lost == 1 ? 2 * ms : 1 * ms);
  }
}

// A fault at any moment of a change, in either direction. After the reset cycle and drives have one period, whichever.
TEST(TimestepChange, EndsInOnePeriodWhateverFailsInItsMiddle) {
  for (const double from_ms : {1.0, 2.0}) {
    for (int moment = 0; moment <= 100; moment += 5) {
      const char* const device = moment % 2 == 0 ? "sensor:silent" : "axis_4:fault=0x4210";
      RigOptions options{.duration_s = 2.5};
      options.settings.mass_kg = 6.0;
      options.settings.period_s = 1e-3 * from_ms;
      options.settings.wait_after_fault_s = 5.0;
      // Rendering begins some 0.24 s after the first cycle, that 0.2 s after power on.
      const std::string from_s = std::to_string(1.44 + 1e-3 * moment), until_s = std::to_string(1.74 + 1e-3 * moment);
      options.device_faults = {std::string(device) + "@" + from_s + "s.." + until_s + "s"};
      options.timesteps = {{1000 * ms, timestep(3.0 - from_ms)}};
      options.commands = {{2500 * ms, {Order::reset}}, {3500 * ms, {Order::resume}}};
      SCOPED_TRACE(options.device_faults.front() + " from " + std::to_string(from_ms) + " ms");
      TimestepRig rig(options);
      rig.run();
      ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
      EXPECT_EQ(rig.cycle->past_fault_count(), 1u);
      expect_within_joint_limits(rig);
      if (HasFatalFailure()) return;
      EXPECT_EQ(rig.cycle->rendered_ns(), 2500 * ms) << "it goes on after the reset";
      EXPECT_FALSE(changing(rig.records.back()));
      expect_drives_at(rig, rig.records.back().period_ns);
    }
  }
}

// A drive that is gone in the middle stops the arm; what it was told nobody knows, so a reset is refused.
TEST(TimestepChange, StopsWhereADriveDiesInItsMiddle) {
  for (int moment = 40; moment <= 70; moment += 10) {
    SCOPED_TRACE(moment);
    RigOptions options{.device_faults = {"axis_5:power@" + std::to_string(1.44 + 1e-3 * moment) + "s"}};
    options.settings.wait_after_fault_s = 2.0;
    options.timesteps = {{1000 * ms, timestep(2)}};
    options.commands = {{3000 * ms, {Order::reset}}};
    TimestepRig rig(options);
    rig.run();
    EXPECT_TRUE(rig.fault().fault == Fault::drive_silent || rig.fault().fault == Fault::drive_not_disabled ||
                rig.fault().fault == Fault::drive_fault)
        << describe(rig.fault(), "");
    expect_within_joint_limits(rig);
  }
}

struct Ordered {
  Order order;
  Phase after;
};

// At any moment of a change: a hold keeps the arm where it is, a resume is what it does anyhow, the others are refused.
TEST(TimestepChange, ObeysOrdersInItsMiddle) {
  for (const Ordered& ordered : {Ordered{Order::hold, Phase::holding}, Ordered{Order::resume, Phase::rendering},
                                 Ordered{Order::release, Phase::rendering}, Ordered{Order::back_off, Phase::rendering},
                                 Ordered{Order::reset, Phase::rendering}}) {
    for (int moment = 2; moment <= 22; moment += 4) {
      SCOPED_TRACE("order " + std::to_string(static_cast<int>(ordered.order)) + " after " + std::to_string(moment));
      RigOptions options{.duration_s = 2.0};
      options.timesteps = {{1000 * ms, timestep(2)}};
      const std::int64_t at_ns = (1236 + moment) * ms;
      options.commands = {{at_ns, {ordered.order, 0.02}}};
      if (ordered.order == Order::hold) options.commands.push_back({at_ns + 1500 * ms, {Order::resume}});
      TimestepRig rig(options);
      rig.run();
      ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
      expect_within_joint_limits(rig);
      expect_drives_at(rig, 2 * ms);
      const std::size_t asked = first(rig, 0, changing), told = first(rig, asked, steady);
      ASSERT_LT(rig.records[asked].time_ns, at_ns);
      ASSERT_GT(rig.records[told].time_ns, at_ns) << "it was to be in the middle";
      EXPECT_EQ(rig.records[told].phase, ordered.after);
      EXPECT_EQ(rig.cycle->rendered_ns(), 2000 * ms);
    }
  }
}

TEST(TimestepChange, EndsWithTheSession) {
  for (int moment = 0; moment <= 30; moment += 3) {
    SCOPED_TRACE(moment);
    RigOptions options;
    options.timesteps = {{1000 * ms, timestep(2)}};
    ClosedLoopRig* session = nullptr;
    int left = moment;
    options.after_cycle = [&](fieldbus::SimulatedCanNetwork&) {
      if (!session->records.empty() && changing(session->records.back()) && left-- == 0) session->cycle->request_stop();
    };
    TimestepRig rig(options);
    session = &rig;
    rig.run();
    EXPECT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
    EXPECT_TRUE(rig.cycle->drives_off());
    expect_within_joint_limits(rig);
  }
}

// In a hold it stays a hold. The same timestep again is no change; two of them come one after the other.
TEST(TimestepChange, LeavesAHoldAHoldAndTakesOneAfterTheOther) {
  RigOptions options{.duration_s = 2.0};
  options.commands = {{1000 * ms, {Order::hold}}, {3000 * ms, {Order::resume}}};
  ClosedLoopRig* session = nullptr;
  options.after_cycle = [&](fieldbus::SimulatedCanNetwork&) {
    if (session->records.size() != 1500) return;
    for (const double period_ms : {1.0, 2.0, 2.0, 4.0})
      ASSERT_TRUE(session->cycle->timesteps().push(timestep(period_ms)));
  };
  TimestepRig rig(options);
  session = &rig;
  rig.run();
  ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
  expect_drives_at(rig, 4 * ms);
  std::vector<std::int64_t> periods;
  for (const CycleRecord& r : rig.records) {
    if (periods.empty() || periods.back() != r.period_ns) periods.push_back(r.period_ns);
  }
  EXPECT_EQ(periods, (std::vector<std::int64_t>{1 * ms, 2 * ms, 4 * ms}));
  const std::size_t resumed = first(rig, first(rig, 0, changing), rendering);
  EXPECT_NEAR(1e-6 * static_cast<double>(rig.records[resumed].time_ns), 3000.0, 5.0);
  expect_within_joint_limits(rig);
}

// Let go in the middle of the change, it stays in the hold until it is pressed anew.
TEST(TimestepChange, WaitsForTheEnablingInput) {
  RigOptions options{.duration_s = 3.0};
  options.edit_cell = [](description::Cell& cell) {
    description::EnablingInputDescription input;
    input.drive = "axis_2";
    input.bus = "axes_1_3";
    input.bit = 19;
    cell.enabling_input = input;
  };
  options.enabling = {{100 * ms, 1365 * ms}, {2700 * ms, INT64_MAX}};
  options.timesteps = {{1000 * ms, timestep(2)}};
  TimestepRig rig(options);
  rig.run();
  ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), "");
  const std::size_t asked = first(rig, 0, changing), told = first(rig, asked, steady);
  ASSERT_LT(rig.records[asked].time_ns, 1365 * ms);
  ASSERT_GT(rig.records[told].time_ns, 1365 * ms) << "it was to be let go in the middle";
  EXPECT_EQ(rig.records[told].phase, Phase::holding);
  EXPECT_EQ(rig.records[told].period_ns, 2 * ms);
  const std::size_t resumed = first(rig, told, rendering);
  EXPECT_GE(rig.records[resumed].time_ns, 2700 * ms);
  EXPECT_LE(rig.records[resumed].time_ns, 2830 * ms);
  expect_within_joint_limits(rig);
}

}  // namespace
}  // namespace proxarm::controller
