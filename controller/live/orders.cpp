#include "controller/live/orders.hpp"

#include <algorithm>
#include <cmath>

#include "controller/motion/release.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {
namespace {

using description::SetupError;

struct Name {
  const char* name;
  Order order;
};
constexpr Name names[] = {{"hold", Order::hold},
                          {"resume", Order::resume},
                          {"release", Order::release},
                          {"back-off", Order::back_off},
                          {"reset", Order::reset}};

}  // namespace

const char* order_name(Order order) noexcept {
  for (const Name& known : names) {
    if (known.order == order) return known.name;
  }
  return "none";
}

std::optional<Command> parse_order(const std::string& text) {
  const std::size_t space = text.find(' ');
  const std::string name = text.substr(0, space), value = space == std::string::npos ? "" : text.substr(space + 1);
  for (const Name& known : names) {
    if (name != known.name) continue;
    Command command{known.order, 0.0};
    if (command.order == Order::back_off) {
      command.value = description::parse_length(value, "back-off");
      if (command.value <= Release::longest_back_off_m) return command;
      throw SetupError({.key = "back-off", .found = description::in_quotes(value), .expected = "at most 200mm"});
    }
    if (value.empty()) return command;
    throw SetupError({.key = name, .found = description::in_quotes(value), .expected = "nothing behind it"});
  }
  return std::nullopt;
}

std::vector<ScheduledCommand> scheduled_orders(const std::vector<std::string>& texts) {
  std::vector<ScheduledCommand> scheduled;
  for (const std::string& text : texts) {
    const std::size_t at = text.rfind('@');
    const auto command = parse_order(text.substr(0, at));
    if (!command || at == std::string::npos) {
      throw SetupError({.key = "--do",
                        .found = description::in_quotes(text),
                        .expected = "hold, resume, release, back-off DISTANCE or reset, and @TIME",
                        .advice = "such as release@4s: four seconds after the first cycle"});
    }
    const double time_s = description::parse_duration(text.substr(at + 1), "--do");
    scheduled.push_back({std::llround(1e9 * time_s), *command});
  }
  std::stable_sort(scheduled.begin(), scheduled.end(), [](const auto& a, const auto& b) { return a.at_ns < b.at_ns; });
  return scheduled;
}

}  // namespace proxarm::controller
