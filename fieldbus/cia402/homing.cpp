#include "fieldbus/cia402/homing.hpp"

#include <algorithm>
#include <cmath>

#include "models/base/setup_error.hpp"
#include "models/description/homing.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::uint8_t homing_mode = 6;
constexpr std::int64_t ms = 1'000'000, poll_ns = 10 * ms, state_patience_ns = 5'000 * ms;
constexpr std::uint16_t start_bit = 1U << 4, reached = 1U << 10, attained = 1U << 12, error = 1U << 13;

// SDO exchanges with one drive. Meanwhile the controller's heartbeat is sent.
class Conversation {
 public:
  Conversation(CanNetwork& network, const DriveSlot& slot, const FrameHandler& other)
      : network_(network), slot_(slot), other_(other) {}

  // Executes the steps and returns the last value read. Throws SetupError.
  std::uint32_t run(std::vector<SdoStep> steps) {
    const description::DriveDescription& drive = slot_.drive->description();
    SdoSequence sequence(network_.bus(slot_.bus), drive.node, drive.bus, "drive of " + drive.joint, std::move(steps),
                         slot_.drive->settings().sdo);
    sequence.start(network_.now_ns());
    pump(
        [&](std::size_t bus, const TimedFrame& f) { return bus == slot_.bus && sequence.on_frame(f.frame, f.time_ns); },
        [&](std::int64_t now_ns) {
          sequence.poll(now_ns);
          return sequence.finished() ? pump_done : sequence.wake_ns(now_ns);
        });
    if (sequence.problem()) throw SetupError(*sequence.problem());
    return sequence.values().empty() ? 0 : sequence.values().back().value;
  }

  void wait(std::int64_t time_ns) {
    const std::int64_t until_ns = network_.now_ns() + time_ns;
    pump([](std::size_t, const TimedFrame&) { return false; },
         [&](std::int64_t now_ns) { return now_ns >= until_ns ? pump_done : until_ns; });
  }

  void send(const CanFrame& frame) { (void)network_.bus(slot_.bus).send(frame); }
  void begin_heartbeat() { heartbeat_ns_ = network_.now_ns(); }
  [[nodiscard]] std::int64_t now_ns() const { return network_.now_ns(); }

 private:
  template <typename Takes, typename Work>
  void pump(const Takes& takes, const Work& work) {
    const FrameHandler on_frame = [&](std::size_t bus, const TimedFrame& received) {
      if (!takes(bus, received) && other_) other_(bus, received);
    };
    constexpr std::int64_t forever = INT64_MAX;
    pump_frames(network_, forever, on_frame, [&](std::int64_t now_ns) {
      const std::int64_t wake_ns = work(now_ns);
      if (wake_ns == pump_done || heartbeat_ns_ < 0) return wake_ns;
      if (now_ns >= heartbeat_ns_) {
        CanFrame frame;
        frame.id = heartbeat_id(slot_.drive->settings().master_node);
        frame.length = 1;
        frame.data[0] = static_cast<std::uint8_t>(NmtState::operational);
        send(frame);
        heartbeat_ns_ = now_ns + std::int64_t{slot_.drive->settings().master_heartbeat_ms} * ms;
      }
      return std::min(wake_ns, heartbeat_ns_);
    });
  }

  CanNetwork& network_;
  const DriveSlot& slot_;
  const FrameHandler& other_;
  std::int64_t heartbeat_ns_ = -1;  // time of the next heartbeat; < 0: no heartbeat is sent
};

std::uint32_t size(const ServoDrive& drive, double size_rad) {
  return std::max<std::uint32_t>(drive.scale().size_counts(size_rad).value_or(1), 1);
}

std::vector<SdoStep> homing_steps(const ServoDrive& drive) {
  const description::DriveDescription& d = drive.description();
  const description::HomingDescription& homing = *d.homing;
  const DriveSettings& settings = drive.settings();
  constexpr std::uint32_t can_home = 1U << (homing_mode - 1);
  const std::uint32_t watched =
      static_cast<std::uint32_t>(settings.master_node) << 16 | settings.master_heartbeat_timeout_ms;
  SdoStep display = sdo_expect(object_address(d.objects.mode_display), 1, homing_mode, "modes of operation display",
                               "the drive took mode 6 (homing) but didn't change to it");
  display.patience_ns = 500 * ms;
  return {sdo_expect(object_address(d.objects.supported_modes), 4, can_home, "supported drive modes",
                     "the drive can't home (mode 6): find its zero by its maker's tool", can_home),
          sdo_write({0x1016, 1}, 4, 0, "consumer heartbeat time (of the controller)"),
          sdo_write({0x1016, 1}, 4, watched, "consumer heartbeat time (of the controller)"),
          or_found(if_present(sdo_write({0x6007, 0}, 2, 3, "abort connection option code (quick stop)")), {3, 1, 2}),
          sdo_write(object_address(d.objects.mode), 1, homing_mode, "modes of operation"), display,
          sdo_write({0x6098, 0}, 1, static_cast<std::uint8_t>(homing.method), "homing method"),
          sdo_write({0x6099, 1}, 4, size(drive, homing.speed_rad_per_s), "speed towards the switch"),
          sdo_write({0x6099, 2}, 4, size(drive, homing.slow_speed_rad_per_s), "speed towards the zero"),
          if_present(sdo_write({0x609A, 0}, 4, size(drive, homing.acceleration_rad_per_s2), "homing acceleration")),
          sdo_write({0x607C, 0}, 4, 0, "home offset"),
          // Deletes the mark of an earlier homing, which is no longer valid.
          sdo_write({description::homed_index, description::homed_subindex}, 4, 0, "configuration date")};
}

[[noreturn]] void refuse(const ServoDrive& drive, std::string found, std::string expected) {
  throw SetupError({.bus = drive.description().bus,
                    .node = drive.node(),
                    .message = "homing of " + drive.description().joint,
                    .found = std::move(found),
                    .expected = std::move(expected)});
}

class Homing {
 public:
  Homing(Conversation& talk, const ServoDrive& drive, const std::function<bool()>& may_move)
      : talk_(talk), drive_(drive), may_move_(may_move) {}

  void run() {
    command(controlword::disable_voltage);
    if (decode_state(statusword()) == DriveState::fault) command(controlword::fault_reset);
    command(controlword::shutdown);
    wait_for(DriveState::ready_to_switch_on);
    command(controlword::switch_on);
    wait_for(DriveState::switched_on);
    command(controlword::enable_operation);
    wait_for(DriveState::operation_enabled);
    command(controlword::enable_operation | start_bit);
    wait_for_home();
  }

  void command(std::uint32_t word) {
    SdoStep step = sdo_write(object_address(drive_.description().objects.controlword), 2, word, "controlword");
    step.mask = 0;  // any value read back is accepted
    talk_.run({step});
  }

 private:
  std::uint16_t statusword() {
    const ObjectAddress object = object_address(drive_.description().objects.statusword);
    return static_cast<std::uint16_t>(talk_.run({sdo_read(object, 2, "statusword")}));
  }
  void require_permission() {
    if (!may_move_())
      refuse(drive_, "the enabling input let go, or an end from outside", "a switch that is kept pressed");
  }
  void wait_for(DriveState state) {
    const std::int64_t until_ns = talk_.now_ns() + state_patience_ns;
    for (;;) {
      require_permission();
      const std::uint16_t word = statusword();
      if (decode_state(word) == state) return;
      if (talk_.now_ns() > until_ns) {
        refuse(drive_, std::string(to_string(decode_state(word))) + " (statusword " + hex_text(word, 4) + ")",
               std::string(to_string(state)));
      }
      talk_.wait(poll_ns);
    }
  }
  void wait_for_home() {
    const double timeout_s = drive_.description().homing->timeout_s;
    const std::int64_t until_ns = talk_.now_ns() + std::llround(1e9 * timeout_s);
    for (;;) {
      talk_.wait(poll_ns);
      require_permission();
      const std::uint16_t word = statusword();
      if (decode_state(word) != DriveState::operation_enabled || (word & error) != 0) {
        refuse(drive_, "statusword " + hex_text(word, 4) + ((word & error) != 0 ? ", homing error" : ""),
               "homing attained; has the drive the method " + std::to_string(drive_.description().homing->method) +
                   " (6098h), and its switches?");
      }
      if ((word & attained) != 0 && (word & reached) != 0) return;
      if (talk_.now_ns() > until_ns) {
        refuse(drive_, "no home within " + description::number_text(timeout_s) + " s", "homing attained");
      }
    }
  }

  Conversation& talk_;
  const ServoDrive& drive_;
  const std::function<bool()>& may_move_;
};

}  // namespace

std::int32_t read_position(CanNetwork& network, const DriveSlot& drive, const FrameHandler& other) {
  Conversation talk(network, drive, other);
  const ObjectAddress object = object_address(drive.drive->description().objects.position);
  return static_cast<std::int32_t>(talk.run({sdo_read(object, 4, "position actual value")}));
}

void home(CanNetwork& network, const DriveSlot& slot, const std::function<bool()>& may_move,
          const FrameHandler& other) {
  const ServoDrive& drive = *slot.drive;
  Conversation talk(network, slot, other);
  talk.send(nmt_frame(NmtCommand::enter_pre_operational, drive.node()));
  talk.begin_heartbeat();
  talk.run(homing_steps(drive));
  talk.send(nmt_frame(NmtCommand::start, drive.node()));
  Homing homing(talk, drive, may_move);
  const auto leave = [&] {
    homing.command(controlword::disable_voltage);
    talk.run({sdo_write({0x1016, 1}, 4, 0, "consumer heartbeat time (of the controller)")});
    talk.send(nmt_frame(NmtCommand::enter_pre_operational, drive.node()));
  };
  try {
    homing.run();
  } catch (const SetupError&) {
    leave();  // if the drive doesn't answer, it stops when the heartbeat ends
    throw;
  }
  leave();
  talk.run({sdo_write({description::homed_index, description::homed_subindex}, 4,
                      description::homed_token(drive.description()), "configuration date")});
}

}  // namespace proxarm::fieldbus
