#include "fieldbus/canopen/canopen_heartbeat.hpp"

namespace proxarm::fieldbus {

bool HeartbeatProducer::due(std::int64_t now_ns, std::uint64_t cycle, CanFrame& frame) noexcept {
  if (ever_ && (now_ns < next_ns_ || cycle == last_cycle_)) return false;
  // The next heartbeat is due one period after the last one was due. After a gap of more than a period, it is due one
  // period after now.
  next_ns_ = ever_ && now_ns - next_ns_ < period_ns_ ? next_ns_ + period_ns_ : now_ns + period_ns_;
  last_cycle_ = cycle;
  ever_ = true;
  frame = CanFrame{};
  frame.id = heartbeat_id(node_);
  frame.length = 1;
  frame.data[0] = static_cast<std::uint8_t>(NmtState::operational);
  return true;
}

bool HeartbeatConsumer::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.id != heartbeat_id(node_) || frame.extended || frame.remote || frame.error || frame.length < 1)
    return false;
  state_ = nmt_state_from_byte(frame.data[0]);
  if (state_ == NmtState::boot_up) ++boot_ups_;
  heard_ = true;
  last_ns_ = time_ns;
  return true;
}

}  // namespace proxarm::fieldbus
