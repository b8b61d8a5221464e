#include "sim/devices/enabling_switch.hpp"

#include <algorithm>
#include <cmath>

#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::sim {
namespace {

constexpr std::int64_t end_of_session_ns = 1'000'000'000;
constexpr std::int64_t by_itself_ns = 100'000'000;
constexpr std::int64_t message_period_ns = 10'000'000;

}  // namespace

PressedSpan parse_pressed_span(std::string_view text) {
  constexpr std::string_view squeezed = "squeezed:";
  const bool is_squeezed = text.substr(0, squeezed.size()) == squeezed;
  if (is_squeezed) text.remove_prefix(squeezed.size());
  const std::size_t dots = text.find("..");
  const auto time_ns = [&](std::string_view part) -> std::int64_t {
    if (part == "0" || part == "0s") return 0;
    return std::llround(1e9 * description::parse_duration(part, "--enabling"));
  };
  // A single time is refused, because it could be a start, an end or a duration.
  if (dots == std::string_view::npos || dots == 0) {
    throw description::SetupError({.key = "--enabling",
                                   .found = description::in_quotes(text),
                                   .expected = "FROM..UNTIL, such as 0.5s..3s, or FROM.. for as long as there is"});
  }
  PressedSpan span;
  span.squeezed = is_squeezed;
  span.from_ns = time_ns(text.substr(0, dots));
  if (dots + 2 < text.size()) span.until_ns = time_ns(text.substr(dots + 2));
  if (span.from_ns < span.until_ns) return span;
  throw description::SetupError({.key = "--enabling",
                                 .found = description::in_quotes(text),
                                 .expected = "an end after the beginning, such as 0.5s..3s"});
}

EnablingSwitch::EnablingSwitch(const description::EnablingInputDescription& input, std::vector<PressedSpan> spans,
                               DevicePort* port)
    : input_(input), spans_(std::move(spans)), port_(port) {
  const bool ever_pressed = std::any_of(spans_.begin(), spans_.end(), [](const auto& span) { return !span.squeezed; });
  if (!ever_pressed) spans_.push_back({by_itself_ns, INT64_MAX});
}

void EnablingSwitch::on_sync(std::int64_t time_ns) noexcept {
  if (!begun_ || time_ns - last_sync_ns_ > end_of_session_ns) begin_ns_ = time_ns;
  begun_ = true;
  last_sync_ns_ = time_ns;
}

void EnablingSwitch::begin_without_sync(std::int64_t time_ns) noexcept {
  begin_ns_ = time_ns;
  begun_ = endless_ = true;
}

std::uint32_t EnablingSwitch::digital_inputs() const noexcept { return static_cast<std::uint32_t>(contacts()); }

std::uint64_t EnablingSwitch::contacts() const noexcept {
  const auto bit = [&](int byte, int bit_of_byte) {
    return std::uint64_t{1} << (bit_of_byte + (input_.drive.empty() ? 8 * byte : 0));
  };
  std::uint64_t made = pressed_ == input_.pressed_is ? bit(input_.byte, input_.bit) : 0;
  if (const auto& panic = input_.three_position) {
    if (squeezed_ == panic->squeezed_is) made |= bit(panic->byte, panic->bit);
  }
  return made;
}

void EnablingSwitch::power_on(std::int64_t time_ns) noexcept { next_ns_ = time_ns; }

void EnablingSwitch::on_frame(const fieldbus::CanFrame&, std::int64_t) noexcept {}

void EnablingSwitch::on_time(std::int64_t time_ns) noexcept {
  const bool session = endless_ || (begun_ && time_ns - last_sync_ns_ <= end_of_session_ns);
  const std::int64_t since_ns = time_ns - begin_ns_;
  const auto any = [&](bool squeezed) {
    return session && std::any_of(spans_.begin(), spans_.end(), [&](const PressedSpan& span) {
             return span.squeezed == squeezed && span.from_ns <= since_ns && since_ns < span.until_ns;
           });
  };
  squeezed_ = any(true);
  pressed_ = any(false) && !squeezed_;
  if (port_ == nullptr || time_ns < next_ns_) return;
  next_ns_ = std::max(next_ns_ + message_period_ns, time_ns);
  send(time_ns);
}

void EnablingSwitch::send(std::int64_t time_ns) noexcept {
  fieldbus::CanFrame frame;
  frame.id = input_.identifier;
  frame.extended = input_.extended;
  const int last = std::max(input_.byte, input_.three_position ? input_.three_position->byte : 0);
  frame.length = static_cast<std::uint8_t>(std::min(last, 7) + 1);
  const std::uint64_t made = contacts();
  for (std::size_t byte = 0; byte < frame.length; ++byte)
    frame.data[byte] = static_cast<std::uint8_t>(made >> 8 * byte);
  port_->send(frame, time_ns);
}

}  // namespace proxarm::sim
