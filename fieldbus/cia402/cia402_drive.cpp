#include "fieldbus/cia402/cia402_drive.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/cia402/drive_identifiers.hpp"

namespace proxarm::fieldbus {
namespace {

// How many SYNCs must have latched a target equal to the actual position before controlword 0F is sent.
constexpr int syncs_before_enable = 3;
// After this many consecutive cycles with two TPDOs, two drives must have one node number. A bad line also delays and
// doubles frames, but not at each SYNC.
constexpr std::uint32_t most_doubled_cycles = 10;

}  // namespace

std::array<std::uint32_t, 4> ServoDrive::wanted_ids() const noexcept {
  return {pdo_id(PdoDirection::transmit, 1, node()), emcy_id(node()), SdoClient::answer_id(node()),
          heartbeat_id(node())};
}

std::array<std::uint32_t, 6> ServoDrive::used_ids() const noexcept { return drive_identifiers(node()); }

void ServoDrive::start_cycle(std::int64_t now_ns) noexcept {
  cycling_ = true;
  if (settings_.heartbeat_in_operation) {
    heartbeat_.restart(now_ns);
  } else {
    heartbeat_.stop_watching();
  }
  boot_ups_at_start_ = heartbeat_.boot_ups();
  tpdos_in_cycle_ = doubled_cycles_ = 0;
  cycles_without_tpdo_ = 0;
  fresh_ = true;  // before the first SYNC no TPDO is missing
}

void ServoDrive::raise(DriveFault fault) noexcept {
  if (fault_ == DriveFault::none) fault_ = fault;
}

void ServoDrive::request(DriveGoal goal) noexcept {
  const bool wanted = goal_ == DriveGoal::operation_enabled, wants = goal == DriveGoal::operation_enabled;
  if (wanted && !wants && heard_ && !following_ && fault_ == DriveFault::none) stuck_ = 1U << 16 | statusword_;
  if (wants) stuck_ = 0;
  goal_ = goal;
}

void ServoDrive::judge_doubled() noexcept {
  doubled_cycles_ = tpdos_in_cycle_ > 1 ? doubled_cycles_ + 1 : 0;
  tpdos_in_cycle_ = 0;
  if (doubled_cycles_ >= most_doubled_cycles) raise(DriveFault::two_nodes);
}

void ServoDrive::on_sync(std::int64_t now_ns) noexcept {
  judge_doubled();
  // This SYNC makes the drive latch the RPDO that was sent before it.
  if (held_pending_) ++held_;
  held_pending_ = false;
  if (!fresh_ && cycles_without_tpdo_ < UINT32_MAX) ++cycles_without_tpdo_;
  fresh_ = false;
  if (cycling_ && heartbeat_.lost(now_ns)) raise(DriveFault::heartbeat_lost);
}

bool ServoDrive::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.extended || frame.remote || frame.error) return false;
  if (frame.id == pdo_id(PdoDirection::transmit, 1, node())) return decode_tpdo(frame);
  if (Emergency emergency; decode_emcy(frame, time_ns, node(), emergency)) {
    if (emergency.code == 0) return true;  // this EMCY reports the end of an error; emergency_ keeps the latest error
    emergency_ = emergency;
    ++emergencies_;
    if (frame.length > 2 && is_warning(emergency)) {  // only a frame with an error register can be a warning
      ++warnings_;
      return true;
    }
    if (cycling_ && goal_ == DriveGoal::operation_enabled && !old_fault_) raise(DriveFault::emergency);
    return true;
  }
  if (heartbeat_.on_frame(frame, time_ns)) {
    if (!cycling_) return true;
    if (heartbeat_.boot_ups() != boot_ups_at_start_) {
      raise(DriveFault::restarted);
    } else if (heartbeat_.state() != NmtState::operational) {
      raise(DriveFault::not_operational);
    }
    return true;
  }
  return false;
}

bool ServoDrive::decode_tpdo(const CanFrame& frame) noexcept {
  if (frame.length < tpdo_bytes_) {
    raise(DriveFault::pdo_short);
    return true;
  }
  if (fresh_) ++repeated_tpdos_;
  ++tpdos_in_cycle_;
  statusword_ = read_u16_le(&frame.data[0]);
  actual_counts_ = read_i32_le(&frame.data[2]);
  if (torque_feedback_) actual_torque_ = static_cast<std::int16_t>(read_u16_le(&frame.data[6]));
  if (mode_byte_) shown_mode_ = static_cast<std::int8_t>(frame.data[*mode_byte_]);
  if (torque_byte_) extra_torque_ = static_cast<std::int16_t>(read_u16_le(&frame.data[*torque_byte_]));
  if (gear_torque_byte_) {
    const std::uint8_t* at = &frame.data[*gear_torque_byte_];
    gear_torque_ = description_.gear_torque->bits == 16 ? static_cast<std::int16_t>(read_u16_le(at)) : read_i32_le(at);
  }
  cycles_without_tpdo_ = 0;
  fresh_ = heard_ = true;

  const bool was_enabled = state_ == DriveState::operation_enabled;
  state_ = decode_state(statusword_);
  const bool enabled = state_ == DriveState::operation_enabled;
  if (state_ != DriveState::switched_on) held_ = 0;
  // A drive that follows targets counts as following until it leaves operation enabled, because bit 12 may drop at a
  // limit.
  following_ = enabled && (following_ || (follows_command() && shows_mode()));
  if (goal_ == DriveGoal::operation_enabled) judge_state(was_enabled);
  return true;
}

void ServoDrive::judge_state(bool was_enabled) noexcept {
  const bool enabled = state_ == DriveState::operation_enabled;
  const bool faulty = state_ == DriveState::fault || state_ == DriveState::fault_reaction_active;
  if (!faulty) old_fault_ = false;
  if (faulty && !old_fault_) {
    raise(DriveFault::state_fault);
  } else if (was_enabled && !enabled) {
    raise(DriveFault::left_operation);
  } else if (enabled && (statusword_ & statusword::remote) == 0) {
    raise(DriveFault::not_remote);
  } else if (following_ && !shows_mode()) {
    raise(DriveFault::mode_changed);
  }
}

std::optional<double> ServoDrive::torque_share() const noexcept {
  if (!torque_feedback_ && !torque_byte_) return std::nullopt;
  return 1e-3 * description_.direction * (torque_feedback_ ? actual_torque_ : extra_torque_);
}

std::optional<double> ServoDrive::gear_torque_Nm() const noexcept {
  if (!gear_torque_byte_) return std::nullopt;
  const description::GearTorque& torque = *description_.gear_torque;
  if (torque.Nm_per_count != 0.0) return torque.Nm_per_count * gear_torque_;
  const double link_rad = 2.0 * std::numbers::pi * gear_torque_ / torque.counts_per_revolution;
  return description_.gear_stiffness_Nm_per_rad * (actual_rad() - link_rad);
}

bool ServoDrive::set_target_rad(double angle_rad) noexcept {
  if (!following_) return false;
  const auto counts = scale_.counts(angle_rad);
  if (!counts) {
    raise(DriveFault::target_out_of_range);
    return false;
  }
  target_counts_ = *counts;
  return true;
}

bool ServoDrive::set_target_torque_Nm(double torque_Nm) noexcept {
  const double exact = std::round(torque_Nm * torque_per_Nm_);
  constexpr double most = std::numeric_limits<std::int16_t>::max();
  if (!(std::abs(exact) <= most)) {
    raise(DriveFault::target_out_of_range);
    return false;
  }
  target_torque_ = static_cast<std::int16_t>(exact);
  return true;
}

bool ServoDrive::guard_request(CanFrame& frame) const noexcept {
  if (description_.bring_up.stops_by != description::StopsBy::life_guarding) return false;
  frame = CanFrame{};
  frame.id = heartbeat_id(node());
  frame.remote = true;
  frame.length = 1;  // length of the requested answer
  return true;
}

bool ServoDrive::encode_rpdo(CanFrame& frame) noexcept {
  if (!heard_) return false;
  if (!following_) target_counts_ = actual_counts_;
  const bool reset_first = goal_ == DriveGoal::operation_enabled && old_fault_ && state_ == DriveState::fault;
  ControlStep step = next_controlword(state_, reset_first ? DriveGoal::fault_reset : goal_, controlword_);
  if (step.transition == 4 && held_ < syncs_before_enable) step = {controlword::switch_on, -1};
  controlword_ = step.controlword;
  held_pending_ = state_ == DriveState::switched_on;

  frame = CanFrame{};
  frame.id = pdo_id(PdoDirection::receive, 1, node());
  frame.fd = frame.bit_rate_switch = description_.fd;
  frame.length = rpdo_bytes_;  // 4 or 6 bytes, which are valid lengths of CAN FD too
  const unsigned bits = mode_.controlword_bits | description_.bring_up.controlword_bits;
  const bool enables = controlword_ == controlword::enable_operation;
  write_u16_le(&frame.data[0], static_cast<std::uint16_t>(controlword_ | (enables ? bits : 0U)));
  if (mode_.torque) {
    write_u16_le(&frame.data[2], static_cast<std::uint16_t>(target_torque_));
  } else {
    write_u32_le(&frame.data[2], static_cast<std::uint32_t>(target_counts_));
  }
  return true;
}

}  // namespace proxarm::fieldbus
