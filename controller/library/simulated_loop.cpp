#include "controller/library/simulated_loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "controller/preparation/cell_buses.hpp"
#include "controller/session/bring_up.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

using description::SetupError;
using models::Vec3;

// Faster than any tool by far; what explodes is there within some steps.
constexpr double impossible_m_per_s = 1000.0;

// Time that the last frames have to reach the drives. The longest queue of a cycle takes a millisecond.
constexpr std::int64_t last_words_ns = 5'000'000;

constexpr std::size_t drained_after_every_cycle = 64;

// Somebody's own 𝒢, which the compiled scene would like to own.
class BorrowedWorld final : public models::GeometricAlgorithm<3> {
 public:
  explicit BorrowedWorld(models::GeometricAlgorithm<3>& world) : world_(world) {}

  Vec3 operator()(double K, const Vec3& p, const Vec3& q) noexcept override { return world_(K, p, q); }
  void set_time(const models::StepTime& time) noexcept override { world_.set_time(time); }
  [[nodiscard]] bool wants_time() const noexcept override { return world_.wants_time(); }
  [[nodiscard]] std::span<const models::Contact<3>> contacts() const noexcept override { return world_.contacts(); }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return world_.unresolved_steps(); }
  [[nodiscard]] bool squeezed() const noexcept override { return world_.squeezed(); }
  [[nodiscard]] std::uint32_t media_at(const Vec3& q) const noexcept override { return world_.media_at(q); }
  [[nodiscard]] bool has_media() const noexcept override { return world_.has_media(); }

 private:
  models::GeometricAlgorithm<3>& world_;
};

void require_joints(const OwnParts& own, const description::Cell& cell) {
  for (const auto& own_drive : own.drives) {
    const std::string& joint = own_drive.first;
    const bool known = std::any_of(cell.drives.begin(), cell.drives.end(),
                                   [&](const description::DriveDescription& drive) { return drive.joint == joint; });
    if (known) continue;
    throw SetupError({.file = cell.file.string(),
                      .key = "drives",
                      .found = "no joint " + description::in_quotes(joint) + ", which a drive of one's own is for",
                      .expected = "one of the cell's joints"});
  }
}

void require_replaceable(const PreparedSession& session, std::size_t axis) {
  const description::DriveDescription& drive = session.cell.drives[axis];
  if (drive.on_can() && !session.impedance()) return;
  throw SetupError({.file = session.cell.file.string(),
                    .key = "drives[" + std::to_string(axis) + "]",
                    .found = "a drive on Modbus, or one that takes torques, for " + drive.joint,
                    .expected = "one on CAN that takes positions, where one's own takes its place"});
}

}  // namespace

void require_own_world_fits(const PreparedSession& session) {
  if (session.settings.looks_ahead) {
    throw SetupError({.key = "--lookahead", .found = "a world of one's own", .expected = "off with it"});
  }
  if (session.scene.tool) {
    throw SetupError({.key = "--tool",
                      .found = "a tool with a shape, and a world of one's own",
                      .expected = "point: such a world moves a point"});
  }
  if (session.scene.space.dimensions == 3) return;
  throw SetupError({.file = session.cell.file.string(),
                    .found = "an arm whose tool can't move in all directions, and a world of one's own in space",
                    .expected = "an arm whose tool moves in space"});
}

PreparedSession simulated_arm(const PreparedSession& session, const RunOptions& options) {
  if (options.arm.empty()) return session;
  RunOptions of_arm = options;
  of_arm.cell = options.arm;
  PreparedSession arm = prepare(of_arm);
  const auto names = [](const description::Cell& cell) {
    std::string all;
    for (const auto& bus : cell.buses) all += bus.name + " ";
    for (const auto& drive : cell.drives) all += drive.joint + "/" + drive.bus + " ";
    return all;
  };
  if (names(arm.cell) == names(session.cell)) return arm;
  throw SetupError({.file = arm.cell.file.string(),
                    .key = "--arm",
                    .found = "other buses or joints than those of " + session.cell.file.string(),
                    .expected = "the same: a wrong direction, gear, link or sensor is what it is for"});
}

namespace {

const PreparedSession& arm_of(const SimulatedFarEnd& far_end, const PreparedSession& session) {
  return far_end.arm != nullptr ? *far_end.arm : session;
}

// Whether an arm can move so.
bool is_possible(const sim::Truth& truth) noexcept {
  return truth.X_WT.matrix().allFinite() && truth.acceleration_W.allFinite() &&
         truth.velocity_W.norm() < impossible_m_per_s;
}

}  // namespace

SimulatedLoop::SimulatedLoop(const PreparedSession& session, const OwnParts& own, const SimulatedFarEnd& far_end)
    : session_(session),
      own_(own),
      network_(sim::simulated_buses(arm_of(far_end, session).cell)),
      far_end_(arm_of(far_end, session).cell, arm_of(far_end, session).sensor, session.hand, network_.events(),
               {.plant = {}, .faults = far_end.faults, .enabling = far_end.enabling}),
      scene_(scenes::compile(session.scene)) {
  if (own.world != nullptr) {
    require_own_world_fits(session);
    scene_.any_algorithm = std::make_unique<BorrowedWorld>(*own.world);
  }
  if (own.hand) far_end_.plant().set_hand(own.hand);
}

void SimulatedLoop::start() {
  const ModbusOpener open_line = [this](const description::ModbusLineDescription& line, double) {
    return far_end_.modbus_client(line.name);
  };
  CycleParts parts =
      build_parts(session_.cell, session_.sensor, scene_, session_.settings, network_, buses_in_order(session_.cell),
                  open_line, [this](const auto&) { return far_end_.datagram_port(); });
  put_in(parts);
  far_end_.attach_to(network_);
  far_end_.power_on();
  power_on_ns_ = network_.now_ns();
  bring_up(parts, [this](fieldbus::ModbusLine& line) { pump(network_, line, network_.now_ns()); });
  cycle_.emplace(std::move(parts), session_.settings, session_.cell.limits, drained_after_every_cycle);
}

void SimulatedLoop::put_in(CycleParts& parts) {
  FarEnd far_end{far_end_, network_};
  if (own_.sensor) parts.sensor = own_.sensor(far_end);
  require_joints(own_, session_.cell);
  std::vector<DriveOnBus> drives;
  for (std::size_t axis = 0; axis < parts.drives.size(); ++axis) {
    const description::DriveDescription& there = session_.cell.drives[axis];
    const auto made = own_.drives.find(there.joint);
    if (made == own_.drives.end()) {
      drives.push_back(std::move(parts.drives[axis]));
      continue;
    }
    require_replaceable(session_, axis);
    std::erase_if(parts.can_drives,
                  [&](const fieldbus::DriveSlot& slot) { return slot.drive->description().joint == there.joint; });
    std::unique_ptr<fieldbus::CyclicDrive> drive = made->second(far_end, axis, there);
    fieldbus::CyclicDrive& same = *drive;
    drives.push_back({std::move(drive), same, DriveOnBus::no_bus});
  }
  parts.drives = std::move(drives);
}

void SimulatedLoop::look_at_truth(std::int64_t t_k_ns) {
  if (!first_cycle_ns_) first_cycle_ns_ = t_k_ns - power_on_ns_;
  truth_ = far_end_.truth();
  if (!exploded_after_s_ && !is_possible(truth_)) exploded_after_s_ = 1e-9 * static_cast<double>(t_k_ns - power_on_ns_);
}

SessionTally SimulatedLoop::run(const LookAtCycle& look, const SessionLength& length,
                                const std::function<void(std::int64_t t_k_ns)>& before) {
  for (std::size_t i = 0; i < network_.bus_count(); ++i) {
    network_.simulated_bus(i).statistics().reset(network_.now_ns());
  }
  const SessionHooks hooks{[&](std::int64_t t_k_ns) {
                             look_at_truth(t_k_ns);
                             if (before) before(t_k_ns);
                           },
                           [&] {
                             CycleRecord record;
                             while (cycle_->records().pop(record)) look(record, truth_);
                           }};
  const SessionTally tally = run_session(*cycle_, network_, length, hooks);
  for (std::size_t i = 0; i < network_.bus_count(); ++i) {
    bus_load_[network_.bus(i).name()] = network_.simulated_bus(i).load();
  }
  cycle_->shut_down();
  network_.sleep_until(network_.now_ns() + last_words_ns);
  return tally;
}

QuietEnd run_quietly(const PreparedSession& session, const LookAtCycle& look) {
  SimulatedLoop loop(session);
  QuietEnd out;
  loop.start();
  out.end = loop.run(look, {session.duration_s}).end;
  const Cycle& cycle = loop.cycle();
  if (cycle.supervisor().faulted()) out.fault = fault_name(cycle.supervisor().report().fault);
  if (cycle.work() != nullptr) out.work = *cycle.work();
  return out;
}

void add_truth(CycleRecord& record, const sim::Truth& truth) {
  record.set(RecordFlag::truth);
  record.true_tool_W_m = triple(truth.X_WT.translation());
  record.hand_force_W_N = triple(truth.hand_force_W);
  record.hand_torque_W_Nm = triple(truth.hand_torque_W);
  const Eigen::Quaterniond q(truth.X_WT.linear());
  record.true_tool_q_W = {q.x(), q.y(), q.z(), q.w()};
  record.true_acceleration_W_m_per_s2 = triple(truth.acceleration_W);
}

void pump(fieldbus::SimulatedCanNetwork& network, fieldbus::ModbusLine& line, std::int64_t time_ns) {
  const std::int64_t earliest_ns = time_ns + std::llround(1e9 * line.exchange_s());
  const std::int64_t next_ns = std::max<std::int64_t>(line.step(time_ns), earliest_ns);
  network.events().schedule(next_ns, [&network, &line](std::int64_t t_ns) { pump(network, line, t_ns); });
}

void refuse_explosion(double since_power_on_s) {
  char found[80];
  std::snprintf(found, sizeof found, "a motion that is no longer finite, %.3f s after power-on", since_power_on_s);
  throw SetupError(
      {.key = "simulation",
       .message = "the simulated arm has exploded: its integration was unstable; nothing that this session says counts",
       .found = found,
       .expected = "gears, rotors and hand that the simulation's step can follow",
       .advice = "raise servo_rate_Hz (the step is a servo period), lower simulation.gear_damping_Nms_per_rad or "
                 "velocity_bandwidth_Hz, or a hand's stiffness and damping"});
}

}  // namespace proxarm::controller
