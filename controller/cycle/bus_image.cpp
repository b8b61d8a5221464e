#include "controller/cycle/bus_image.hpp"

#include <algorithm>

#include "fieldbus/canopen/canopen_pdo.hpp"

namespace proxarm::controller {
namespace {

constexpr std::uint32_t nmt_id = 0x000;

bool is_off(const DriveOnBus& axis) noexcept {
  return axis.drive.state() != fieldbus::DriveState::operation_enabled &&
         axis.drive.state() != fieldbus::DriveState::quick_stop_active;
}

Fault fault_of(fieldbus::SendResult result) noexcept {
  switch (result) {
    case fieldbus::SendResult::bus_off:
      return Fault::bus_off;
    case fieldbus::SendResult::down:
      return Fault::interface_down;
    default:
      return Fault::send_failed;
  }
}

}  // namespace

BusImage::BusImage(CycleParts& parts, CycleRecorder& recorder, Alarm& alarm)
    : parts_(parts),
      recorder_(recorder),
      alarm_(alarm),
      outboxes_(parts.network.bus_count()),
      status_(parts.network.bus_count()),
      goodbye_(parts.can_drives) {}

void BusImage::begin(std::int64_t t_k_ns) noexcept {
  begun_ns_ = t_k_ns;
  fieldbus::CanFrame frame;
  for (DriveBus& bus : parts_.drive_buses) send(bus.bus, bus.sync.next());
  if (parts_.sensor->poll(t_k_ns, frame)) send(parts_.sensor_bus, frame);
  hand_over();
  for (DriveOnBus& axis : parts_.drives) axis.drive.on_sync(t_k_ns);
}

// Receives the frames that arrived before t_k together with the frames of this cycle.
void BusImage::receive_until(std::int64_t deadline_ns, FrameListener& listener) noexcept {
  if (everything_received()) receive_all(listener);
  while (!everything_received() && parts_.network.wait_for_frame(deadline_ns)) receive_all(listener);
}

void BusImage::receive_all(FrameListener& listener) noexcept {
  fieldbus::TimedFrame received;
  for (std::size_t bus = 0; bus < parts_.network.bus_count(); ++bus) {
    while (parts_.network.bus(bus).receive(received)) deliver(bus, received, listener);
  }
}

void BusImage::deliver(std::size_t bus, const fieldbus::TimedFrame& received, FrameListener& listener) noexcept {
  recorder_.add_received(bus, received);
  const fieldbus::CanFrame& frame = received.frame;
  if (bus == parts_.sensor_bus && parts_.sensor->on_frame(frame, received.time_ns)) return;
  for (DriveOnBus& axis : parts_.drives) {
    if (axis.bus == bus && axis.drive.on_frame(frame, received.time_ns)) return;
  }
  if (listener.on_frame(bus, frame)) return;
  if (parts_.enabling && parts_.enabling->on_frame(bus, frame, received.time_ns)) return;
  // A bus doesn't return the controller's frames, so another node has sent this frame.
  if (is_masters_own(bus, frame)) alarm_.raise(Fault::second_master, static_cast<std::int32_t>(bus), frame.id);
}

// Whether only the controller may send this frame: NMT commands, SYNC, the controller's heartbeat, and setpoints for
// its drives.
bool BusImage::is_masters_own(std::size_t bus, const fieldbus::CanFrame& frame) const noexcept {
  if (frame.extended || frame.remote || frame.error) return false;
  const bool drives_here = std::any_of(parts_.drive_buses.begin(), parts_.drive_buses.end(),
                                       [&](const DriveBus& b) { return b.bus == bus; });
  if (!drives_here) return false;
  if (frame.id == nmt_id || frame.id == fieldbus::sync_id) return true;
  if (frame.id == fieldbus::heartbeat_id(fieldbus::DriveSettings{}.master_node)) return true;
  return std::any_of(parts_.can_drives.begin(), parts_.can_drives.end(), [&](const fieldbus::DriveSlot& slot) {
    return slot.bus == bus && frame.id == fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, slot.drive->node());
  });
}

bool BusImage::everything_received() const noexcept {
  return parts_.sensor->answered() &&
         std::all_of(parts_.drives.begin(), parts_.drives.end(), [](const DriveOnBus& a) { return a.drive.fresh(); });
}

std::span<const fieldbus::BusStatus> BusImage::read_status() noexcept {
  for (std::size_t bus = 0; bus < status_.size(); ++bus) {
    status_[bus] = parts_.network.bus(bus).status();
    recorder_.add_status(bus, status_[bus]);
  }
  return status_;
}

void BusImage::send_setpoints(const Setpoints& setpoints, std::int64_t t_k_ns, std::uint64_t cycle) noexcept {
  sends_torques_ = setpoints.kind == Setpoints::Kind::torques_Nm;
  cycle_ = cycle;
  fieldbus::CanFrame frame;
  for (std::size_t i = 0; i < parts_.drives.size(); ++i) {
    const double value = setpoints.values[static_cast<Eigen::Index>(i)];
    if (sends_torques_) {
      parts_.can_drives[i].drive->set_target_torque_Nm(value);
    } else {
      parts_.drives[i].drive.set_target_rad(value);
    }
    if (parts_.drives[i].drive.encode_rpdo(frame)) send(parts_.drives[i].bus, frame);
  }
  for (DriveBus& bus : parts_.drive_buses) {
    if (!bus.heartbeat.due(t_k_ns, cycle, frame)) continue;
    send(bus.bus, frame);
    for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
      if (slot.bus == bus.bus && slot.drive->guard_request(frame)) send(bus.bus, frame);
    }
  }
}

void BusImage::send(std::size_t bus, const fieldbus::CanFrame& frame) noexcept {
  Outbox& outbox = outboxes_[bus];
  if (outbox.count == outbox.frames.size()) hand_over(bus, bus + 1);
  outbox.frames[outbox.count++] = frame;
}

void BusImage::hand_over() noexcept { hand_over(0, outboxes_.size()); }

// Passes the queued frames of these buses to the interfaces. Reads the clock only twice for all buses, since each
// reading is a system call if there is no vDSO.
void BusImage::hand_over(std::size_t first_bus, std::size_t end_bus) noexcept {
  const std::int64_t now_ns = parts_.network.now_ns();
  for (std::size_t bus = first_bus; bus < end_bus; ++bus) {
    Outbox& outbox = outboxes_[bus];
    if (outbox.count == 0) continue;
    parts_.network.bus(bus).send_all({outbox.frames.data(), outbox.count}, now_ns, outbox.results.data());
  }
  const std::int64_t handed_over_ns = parts_.network.now_ns();
  for (std::size_t bus = first_bus; bus < end_bus; ++bus) note_sent(bus, handed_over_ns);
}

void BusImage::note_sent(std::size_t bus, std::int64_t handed_over_ns) noexcept {
  Outbox& outbox = outboxes_[bus];
  for (std::size_t i = 0; i < outbox.count; ++i) {
    recorder_.add_sent(bus, outbox.frames[i], handed_over_ns, outbox.results[i]);
    if (outbox.results[i] == fieldbus::SendResult::sent) continue;
    alarm_.raise(fault_of(outbox.results[i]), static_cast<std::int32_t>(bus));
  }
  outbox.count = 0;
}

void BusImage::request(fieldbus::DriveGoal goal) noexcept {
  for (DriveOnBus& axis : parts_.drives) axis.drive.request(goal);
}

bool BusImage::drives_off() const noexcept { return first_drive_on() < 0; }

std::int32_t BusImage::first_drive_on() const noexcept {
  const auto on = std::find_if_not(parts_.drives.begin(), parts_.drives.end(), is_off);
  return on == parts_.drives.end() ? -1 : static_cast<std::int32_t>(on - parts_.drives.begin());
}

void BusImage::forget_faults() noexcept {
  for (DriveOnBus& axis : parts_.drives) axis.drive.forget_fault();
}

void BusImage::shut_down(std::int64_t period_ns) noexcept {
  if (begun_ns_ >= 0 && !parts_.can_drives.empty()) say_goodbye(period_ns);
  fieldbus::leave_operational(parts_.network, parts_.can_drives);
}

void BusImage::say_goodbye(std::int64_t period_ns) noexcept {
  goodbye_.begin(begun_ns_);
  for (std::int64_t t_ns = begun_ns_ + period_ns; !goodbye_.done(t_ns); t_ns += period_ns) {
    parts_.network.sleep_until(t_ns);
    for (DriveBus& bus : parts_.drive_buses) (void)parts_.network.bus(bus.bus).send(bus.sync.next());
    for (const fieldbus::DriveSlot& slot : parts_.can_drives) slot.drive->on_sync(t_ns);
    listen_until(t_ns + period_ns / 2);
    send_last_words(t_ns);
  }
}

void BusImage::send_last_words(std::int64_t t_ns) noexcept {
  ++cycle_;
  fieldbus::CanFrame frame;
  for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
    if (slot.drive->encode_rpdo(frame)) (void)parts_.network.bus(slot.bus).send(frame);
  }
  for (DriveBus& bus : parts_.drive_buses) {
    if (!bus.heartbeat.due(t_ns, cycle_, frame)) continue;
    (void)parts_.network.bus(bus.bus).send(frame);
    for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
      if (slot.bus == bus.bus && slot.drive->guard_request(frame)) (void)parts_.network.bus(bus.bus).send(frame);
    }
  }
  for (std::size_t bus = 0; goodbye_.next_request(t_ns, bus, frame);) (void)parts_.network.bus(bus).send(frame);
}

void BusImage::listen_until(std::int64_t deadline_ns) noexcept {
  fieldbus::TimedFrame received;
  do {
    for (std::size_t bus = 0; bus < parts_.network.bus_count(); ++bus) {
      while (parts_.network.bus(bus).receive(received)) {
        if (goodbye_.on_frame(bus, received.frame)) continue;
        for (const fieldbus::DriveSlot& slot : parts_.can_drives) {
          if (slot.bus == bus && slot.drive->on_frame(received.frame, received.time_ns)) break;
        }
      }
    }
  } while (parts_.network.wait_for_frame(deadline_ns));
}

void BusImage::write_record(CycleRecord& record) const noexcept {
  record.axes = static_cast<std::uint8_t>(parts_.drives.size());
  for (std::size_t i = 0; i < parts_.drives.size(); ++i) {
    const fieldbus::CyclicDrive& drive = parts_.drives[i].drive;
    record.target_counts[i] = sends_torques_ ? parts_.can_drives[i].drive->target_torque() : drive.target_counts();
    record.actual_counts[i] = drive.actual_counts();
    if (!drive.fresh()) record.set(RecordFlag::feedback_missing);
  }
}

void BusImage::write_inputs(BoxCycle& entry) noexcept {
  fieldbus::StateArchive inputs = fieldbus::StateArchive::writer(entry.inputs);
  for (DriveOnBus& axis : parts_.drives) axis.drive.archive_input(inputs);
  parts_.sensor->archive_input(inputs);
  entry.input_bytes = static_cast<std::uint16_t>(inputs.bytes());
}

void BusImage::archive(fieldbus::StateArchive& state) noexcept {
  for (DriveOnBus& axis : parts_.drives) axis.drive.archive(state);
  for (DriveBus& bus : parts_.drive_buses) state(bus.sync, bus.heartbeat);
  parts_.sensor->archive(state);
}

}  // namespace proxarm::controller
