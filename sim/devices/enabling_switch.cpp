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
  const std::size_t dots = text.find("..");
  const auto time_ns = [&](std::string_view part) -> std::int64_t {
    if (part == "0" || part == "0s") return 0;
    return std::llround(1e9 * description::parse_duration(part, "--enabling"));
  };
  PressedSpan span;
  span.from_ns = time_ns(text.substr(0, dots));
  if (dots != std::string_view::npos && dots + 2 < text.size()) span.until_ns = time_ns(text.substr(dots + 2));
  if (span.from_ns < span.until_ns) return span;
  throw description::SetupError({.key = "--enabling",
                                 .found = description::in_quotes(text),
                                 .expected = "an end after the beginning, such as 0.5s..3s"});
}

EnablingSwitch::EnablingSwitch(const description::EnablingInputDescription& input, std::vector<PressedSpan> spans,
                               DevicePort* port)
    : input_(input), spans_(std::move(spans)), port_(port) {
  if (spans_.empty()) spans_.push_back({by_itself_ns, INT64_MAX});
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

std::uint32_t EnablingSwitch::digital_inputs() const noexcept {
  return pressed_ == input_.pressed_is ? 1u << input_.bit : 0u;
}

void EnablingSwitch::power_on(std::int64_t time_ns) noexcept { next_ns_ = time_ns; }

void EnablingSwitch::on_frame(const fieldbus::CanFrame&, std::int64_t) noexcept {}

void EnablingSwitch::on_time(std::int64_t time_ns) noexcept {
  const bool session = endless_ || (begun_ && time_ns - last_sync_ns_ <= end_of_session_ns);
  const std::int64_t since_ns = time_ns - begin_ns_;
  pressed_ = session && std::any_of(spans_.begin(), spans_.end(), [&](const PressedSpan& span) {
               return span.from_ns <= since_ns && since_ns < span.until_ns;
             });
  if (port_ == nullptr || time_ns < next_ns_) return;
  next_ns_ = std::max(next_ns_ + message_period_ns, time_ns);
  send(time_ns);
}

void EnablingSwitch::send(std::int64_t time_ns) noexcept {
  fieldbus::CanFrame frame;
  frame.id = input_.identifier;
  frame.extended = input_.extended;
  frame.length = static_cast<std::uint8_t>(std::min(input_.byte, 7) + 1);
  const auto byte = static_cast<std::size_t>(frame.length - 1);
  if (pressed_ == input_.pressed_is) frame.data[byte] = static_cast<std::uint8_t>(1u << input_.bit);
  port_->send(frame, time_ns);
}

}  // namespace proxarm::sim
