#include "controller/extras/commissioning/calibrate_run.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "controller/command_line/sessions/interface_network.hpp"
#include "controller/extras/commissioning/arm_at_hand.hpp"
#include "controller/extras/commissioning/offsets.hpp"
#include "controller/live/hardware_consent.hpp"
#include "controller/live/signal_watch.hpp"
#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/start_check.hpp"
#include "controller/supervision/enabling_input.hpp"
#include "fieldbus/cia402/homing.hpp"
#include "models/arm/arm.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/homing.hpp"

namespace proxarm::command_line {
namespace {

using description::SetupError;
using Slots = std::vector<fieldbus::DriveSlot>;

constexpr std::int64_t listen_ns = 100'000'000, boot_ns = 200'000'000;

// The cell's drives, used for requests only. No drive is configured.
class Drives {
 public:
  Drives(const description::Cell& cell, const controller::BusIndices& indices) {
    fieldbus::DriveSettings settings;
    settings.stop_without_controller(cell.supervision.bus_loss_stop_s);
    drives_.reserve(cell.drives.size());
    for (const description::DriveDescription& drive : cell.drives) {
      if (!drive.on_can()) {
        throw SetupError({.file = cell.file.string(),
                          .key = "calibrate",
                          .found = "the drive of " + drive.joint + " on a Modbus line",
                          .expected = "drives on CAN"});
      }
      drives_.emplace_back(drive, settings);
      std::size_t bus = 0;
      while (cell.buses[bus].name != drive.bus) ++bus;
      slots_.push_back({&drives_.back(), indices[bus]});
    }
  }
  [[nodiscard]] const Slots& slots() const noexcept { return slots_; }

 private:
  std::vector<fieldbus::ServoDrive> drives_;
  Slots slots_;
};

void listen(fieldbus::CanNetwork& network, std::int64_t time_ns, const fieldbus::FrameHandler& on_frame) {
  const std::int64_t until_ns = network.now_ns() + time_ns;
  fieldbus::pump_frames(network, until_ns, on_frame, [until_ns](std::int64_t now_ns) {
    return now_ns >= until_ns ? fieldbus::pump_done : until_ns;
  });
}

// Makes the kernel pass the drives' answers, and the messages of an enabling input that is on a bus.
void pass_answers(fieldbus::SocketCanNetwork& network, const Slots& slots,
                  const std::optional<controller::EnablingInput>& enabling) {
  for (std::size_t bus = 0; bus < network.bus_count(); ++bus) {
    std::vector<std::uint32_t> ids;
    for (const fieldbus::DriveSlot& slot : slots) {
      const auto wanted = slot.drive->wanted_ids();
      if (slot.bus == bus) ids.insert(ids.end(), wanted.begin(), wanted.end());
    }
    if (enabling && enabling->bus() == bus) ids.push_back(enabling->wanted_id());
    pass_only(network, bus, ids);
  }
}

std::vector<std::int32_t> read_counts(fieldbus::CanNetwork& network, const Slots& slots) {
  std::vector<std::int32_t> counts;
  for (const fieldbus::DriveSlot& slot : slots) counts.push_back(fieldbus::read_position(network, slot));
  return counts;
}

// Returns the motor angles for marked angles. The marks are on the links, and the encoders on the motors. Gravity
// twists the gears between them, so motor angles and marks differ.
std::vector<double> motor_angles(const description::Cell& cell, const std::vector<double>& link_rad) {
  const models::Arm arm(cell);
  const models::JointVector link = Eigen::Map<const Eigen::VectorXd>(link_rad.data(), arm.axes());
  const models::JointVector motor = arm.motor_from_link(link);
  return {motor.data(), motor.data() + motor.size()};
}

MarkedPose pose_of_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                             const std::vector<double>& angle_rad) {
  description::Cell cell = arm.cell;
  cell.start_rad = angle_rad;
  fieldbus::SimulatedCanNetwork network(sim::simulated_buses(cell));
  description::HandDescription nobody;
  nobody.mass_kg = nobody.stiffness_N_per_m = nobody.damping_Ns_per_m = 0.0;
  sim::SimulatedCell far_end(cell, arm.sensor, nobody, network.events());
  far_end.attach_to(network);
  far_end.power_on();
  network.sleep_until(network.now_ns() + boot_ns);
  const Drives drives(session.cell, controller::buses_in_order(session.cell));
  return {motor_angles(session.cell, angle_rad), read_counts(network, drives.slots())};
}

void ask_for_pose(const description::Cell& cell, const std::vector<double>& angle_rad) {
  std::fprintf(stderr, "bring the arm to these marks, drives off, and press Enter:");
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    std::fprintf(stderr, "%s %s %.5g", i == 0 ? "" : ",", cell.drives[i].joint.c_str(), angle_rad[i]);
  }
  std::fprintf(stderr, "\n");
  std::string line;
  if (!std::getline(std::cin, line)) {
    throw SetupError({.message = "calibrate", .found = "no Enter on standard input", .expected = "one for each pose"});
  }
}

// Returns the enabling input if the switch sends its own messages on a bus; otherwise nullopt.
std::optional<controller::EnablingInput> enabling_message(const controller::PreparedSession& session,
                                                          const controller::BusIndices& indices) {
  const auto& input = session.cell.enabling_input;
  if (!input || session.settings.without_enabling_input || !input->drive.empty()) return std::nullopt;
  std::size_t bus = 0;
  while (session.cell.buses[bus].name != input->bus) ++bus;
  return controller::EnablingInput(*input, session.cell, indices[bus]);
}

class Interfaces {
 public:
  Interfaces(const controller::PreparedSession& session, const controller::RunOptions& options)
      : names_(options.bus.interfaces(controller::bus_names(session.cell))),
        network_(open_network(names_)),
        drives_(session.cell, indices_in(network_, names_.size())) {
    controller::require_nodes_apart(session, names_);
    listen(session);
  }
  // Listens for another controller, and sets the filters. Called after each wait for the person, before drives are
  // asked, because another session may have begun during the wait.
  void listen(const controller::PreparedSession& session) {
    listen_before_speaking(network_, drives_.slots());
    pass_answers(network_, drives_.slots(), enabling_message(session, indices_in(network_, names_.size())));
  }
  [[nodiscard]] const std::vector<std::string>& names() const noexcept { return names_; }
  [[nodiscard]] fieldbus::SocketCanNetwork& network() noexcept { return network_; }
  [[nodiscard]] const Slots& slots() const noexcept { return drives_.slots(); }

 private:
  std::vector<std::string> names_;
  fieldbus::SocketCanNetwork network_;
  Drives drives_;
};

std::vector<MarkedPose> marked_poses(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                                     const CalibrateOptions& options, Interfaces* interfaces) {
  std::vector<std::vector<double>> at = options.at;
  if (at.empty()) at.push_back(session.cell.start_rad);
  std::vector<MarkedPose> poses;
  for (const std::vector<double>& angle_rad : at) {
    if (angle_rad.size() != session.cell.drives.size()) {
      throw SetupError({.key = "--at",
                        .found = std::to_string(angle_rad.size()) + " angles",
                        .expected = std::to_string(session.cell.drives.size()) + ", one for each joint"});
    }
    if (interfaces == nullptr) {
      poses.push_back(pose_of_simulated(session, arm, angle_rad));
      continue;
    }
    ask_for_pose(session.cell, angle_rad);
    interfaces->listen(session);
    poses.push_back({motor_angles(session.cell, angle_rad), read_counts(interfaces->network(), interfaces->slots())});
  }
  return poses;
}

// Returns whether all poses after the first agree with the offsets from the first. Prints each joint that doesn't
// agree.
bool poses_agree(const description::Cell& cell, const std::vector<MarkedPose>& poses,
                 const std::vector<std::int32_t>& offsets, double tolerance_rad) {
  bool agree = true;
  for (std::size_t pose = 1; pose < poses.size(); ++pose) {
    for (std::size_t i = 0; i < cell.drives.size(); ++i) {
      if (cell.drives[i].homing) continue;
      const double off_rad = off_by(cell.drives[i], offsets[i], poses[pose].angle_rad[i], poses[pose].counts[i]);
      if (std::abs(off_rad) <= tolerance_rad) continue;
      std::printf(
          "%s is %.3g rad off its marks in pose %zu: are direction, gear_ratio and "
          "counts_per_motor_revolution right, and was it at its marks?\n",
          cell.drives[i].joint.c_str(), off_rad, pose + 1);
      agree = false;
    }
  }
  return agree;
}

int keep(const description::Cell& cell, const std::vector<std::int32_t>& offsets) {
  bool changed = false;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::int32_t before = cell.drives[i].offset_counts;
    changed = changed || before != offsets[i];
    std::printf("%s: offset_counts %d%s\n", cell.drives[i].joint.c_str(), offsets[i],
                before == offsets[i] ? ", as it is" : (" (was " + std::to_string(before) + ")").c_str());
  }
  if (!changed) {
    std::printf("%s stays as it is\n", cell.file.c_str());
    return 0;
  }
  const std::filesystem::path backup = write_offsets(cell, offsets);
  std::printf("written to %s; before: %s\n", cell.file.c_str(), backup.c_str());
  return 0;
}

class Permission {
 public:
  Permission(const controller::PreparedSession& session, const controller::BusIndices& indices) {
    const auto& input = session.cell.enabling_input;
    if (!input || session.settings.without_enabling_input) return;
    if (!input->drive.empty()) {
      throw SetupError({.file = session.cell.file.string(),
                        .key = "enabling_input",
                        .found = "an input of the drive of " + input->drive,
                        .expected = "a message on a bus: while drives are homed none sends its inputs",
                        .advice = "or --without-enabling-input, on your own responsibility"});
    }
    input_ = enabling_message(session, indices);
  }
  void on_frame(std::size_t bus, const fieldbus::TimedFrame& received) {
    if (input_) input_->on_frame(bus, received.frame, received.time_ns);
  }
  [[nodiscard]] bool given(std::int64_t now_ns) {
    if (stopped_.load()) return false;
    if (!input_) return true;
    input_->on_cycle(now_ns);
    return input_->pressed() && !input_->squeezed();
  }
  void withdraw() noexcept { stopped_.store(true); }

 private:
  std::optional<controller::EnablingInput> input_;
  std::atomic<bool> stopped_{false};
};

// Moves the joints to their homes one after the other, so that with a mistake in the cell only one joint moves.
void home_all(fieldbus::CanNetwork& network, const Slots& slots, Permission& permission) {
  const fieldbus::FrameHandler on_frame = [&](std::size_t bus, const fieldbus::TimedFrame& received) {
    permission.on_frame(bus, received);
  };
  listen(network, listen_ns, on_frame);
  for (const fieldbus::DriveSlot& slot : slots) {
    const description::DriveDescription& drive = slot.drive->description();
    if (!drive.homing) continue;
    fieldbus::home(
        network, slot, [&] { return permission.given(network.now_ns()); }, on_frame);
    std::printf("%s: homed, at %.5g rad it reads %d counts\n", drive.joint.c_str(), drive.homing->angle_rad,
                fieldbus::read_position(network, slot, on_frame));
  }
}

void home_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                    const controller::RunOptions& options) {
  SimulatedArm simulated(arm, options);
  simulated.power_on();
  fieldbus::SimulatedCanNetwork& network = simulated.network;
  network.sleep_until(network.now_ns() + boot_ns);
  const Drives drives(session.cell, controller::buses_in_order(session.cell));
  controller::PreparedSession alone = session;
  alone.settings.without_enabling_input = true;
  Permission permission(alone, controller::buses_in_order(session.cell));
  home_all(network, drives.slots(), permission);
}

int home(const controller::PreparedSession& session, const controller::PreparedSession& arm,
         const CalibrateOptions& options) {
  std::vector<std::int32_t> offsets;
  bool any = false;
  for (const description::DriveDescription& drive : session.cell.drives) {
    any = any || drive.homing.has_value();
    offsets.push_back(drive.homing ? description::homed_offset_counts(drive) : drive.offset_counts);
  }
  if (!any) {
    throw SetupError({.file = session.cell.file.string(),
                      .key = "--home",
                      .found = "absolute encoders alone",
                      .expected = "a drive with `encoder: incremental` and `homing`"});
  }
  if (options.run.bus.simulated()) {
    home_simulated(session, arm, options.run);
  } else {
    Interfaces interfaces(session, options.run);
    controller::require_hardware_consent(session, options.run, interfaces.names());
    interfaces.listen(session);
    Permission permission(session, indices_in(interfaces.network(), interfaces.names().size()));
    controller::SignalWatch signals([&] { permission.withdraw(); });
    home_all(interfaces.network(), interfaces.slots(), permission);
  }
  return keep(session.cell, offsets);
}

}  // namespace

int calibrate(const controller::PreparedSession& session, const controller::PreparedSession& arm,
              const CalibrateOptions& options) {
  if (options.home) return home(session, arm, options);
  const auto& drives = session.cell.drives;
  if (std::all_of(drives.begin(), drives.end(), [](const auto& drive) { return drive.homing.has_value(); })) {
    throw SetupError({.file = session.cell.file.string(),
                      .key = "calibrate",
                      .found = "incremental encoders alone",
                      .expected = "--home: they have no zero until they are homed"});
  }
  std::optional<Interfaces> interfaces;
  if (!options.run.bus.simulated()) interfaces.emplace(session, options.run);
  const std::vector<MarkedPose> poses = marked_poses(session, arm, options, interfaces ? &*interfaces : nullptr);
  std::vector<std::int32_t> offsets;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const bool homes = drives[i].homing.has_value();
    offsets.push_back(homes ? drives[i].offset_counts
                            : offset_by(drives[i], poses[0].angle_rad[i], poses[0].counts[i]));
    if (homes) std::printf("%s: its encoder is incremental: calibrate --home\n", drives[i].joint.c_str());
  }
  if (!poses_agree(session.cell, poses, offsets, options.tolerance_rad)) {
    std::printf("%s stays as it is\n", session.cell.file.c_str());
    return 1;
  }
  if (poses.size() == 1)
    std::printf("one pose finds no wrong direction or ratio: --at a second one, far from the first\n");
  return keep(session.cell, offsets);
}

}  // namespace proxarm::command_line
