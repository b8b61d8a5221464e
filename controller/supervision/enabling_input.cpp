#include "controller/supervision/enabling_input.hpp"

#include <algorithm>
#include <cmath>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::controller {
namespace {

std::uint8_t node_of(const description::Cell& cell, const std::string& joint) {
  const auto found = std::find_if(cell.drives.begin(), cell.drives.end(),
                                  [&](const description::DriveDescription& drive) { return drive.joint == joint; });
  return found != cell.drives.end() ? found->node : std::uint8_t{0};
}

}  // namespace

EnablingInput::EnablingInput(const description::EnablingInputDescription& input, const description::Cell& cell,
                             std::size_t bus)
    : bus_(bus),
      id_(input.drive.empty() ? input.identifier
                              : fieldbus::pdo_id(fieldbus::PdoDirection::transmit, 2, node_of(cell, input.drive))),
      extended_(input.drive.empty() && input.extended),
      timeout_ns_(std::llround(1e9 * input.timeout_s)) {
  const auto contact = [&](int byte, int bit, bool made_is) {
    return Contact{static_cast<std::size_t>(input.drive.empty() ? byte : bit / 8),
                   static_cast<std::uint8_t>(1u << (bit % 8)), made_is};
  };
  middle_ = contact(input.byte, input.bit, input.pressed_is);
  if (!input.three_position) return;
  const description::PanicContact& panic = *input.three_position;
  panic_ = contact(panic.byte, panic.bit, panic.squeezed_is);
}

std::uint32_t EnablingInput::wanted_id() const noexcept { return extended_ ? id_ | fieldbus::extended_id_flag : id_; }

bool EnablingInput::on_frame(std::size_t bus, const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  if (bus != bus_ || frame.id != id_ || frame.extended != extended_ || frame.remote || frame.error) return false;
  on_cycle(time_ns);
  const Position position = position_by(frame);
  if (position == Position::squeezed) squeezed_ = true;
  if (position == Position::released) squeezed_ = false;
  // With three positions, the middle position counts only after the released position.
  const bool says = position == Position::middle && (!panic_ || pressed_ || released_before_);
  if (says && released_before_) pressed_anew_ = true;
  released_before_ = position == Position::released;
  if (!says) pressed_anew_ = false;
  pressed_ = says;
  heard_ = true;
  last_ns_ = time_ns;
  return true;
}

EnablingInput::Position EnablingInput::position_by(const fieldbus::CanFrame& frame) const noexcept {
  const auto is_there = [&](const Contact& contact) { return contact.byte < frame.length; };
  const auto is_made = [&](const Contact& contact) {
    return ((frame.data[contact.byte] & contact.mask) != 0) == contact.made_is;
  };
  if (!is_there(middle_) || (panic_ && !is_there(*panic_))) return Position::unknown;
  if (panic_ && is_made(*panic_)) return Position::squeezed;
  return is_made(middle_) ? Position::middle : Position::released;
}

void EnablingInput::on_cycle(std::int64_t t_k_ns) noexcept {
  if (heard_ && t_k_ns - last_ns_ <= timeout_ns_) return;
  pressed_ = released_before_ = pressed_anew_ = false;
}

bool EnablingInput::take_press() noexcept {
  const bool anew = pressed_ && pressed_anew_;
  pressed_anew_ = false;
  return anew;
}

}  // namespace proxarm::controller
