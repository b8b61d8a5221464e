#include "fieldbus/budget/bus_budget.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>

#include "fieldbus/budget/response_time.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

// Returns the number as text with at most `digits` decimals, without trailing zeros.
std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  std::string out = text;
  if (out.find('.') != std::string::npos) {
    while (out.back() == '0') out.pop_back();
    if (out.back() == '.') out.pop_back();
  }
  return out;
}
std::string microseconds(std::int64_t ns) { return number(static_cast<double>(ns) * 1e-3, 1) + " us"; }
std::string milliseconds(std::int64_t ns) { return number(static_cast<double>(ns) * 1e-6, 3) + " ms"; }
std::string megabits(std::int64_t rate) { return number(static_cast<double>(rate) * 1e-6, 3); }

std::string identifier_text(const PlannedFrame& frame) {
  char text[16];
  std::snprintf(text, sizeof text, frame.shape.extended ? "%08X" : "%03X", frame.id);
  return text;
}

[[noreturn]] void refuse(const PlannedBus& bus, const PlannedFrame& frame, const std::string& message) {
  throw SetupError(
      {.bus = bus.name, .message = "frame \"" + frame.name + "\" (" + identifier_text(frame) + "): " + message});
}

void check_frame(const PlannedBus& bus, const PlannedFrame& frame) {
  if (frame.id > (frame.shape.extended ? 0x1fffffffu : 0x7ffu)) refuse(bus, frame, "identifier out of range");
  if (!is_valid_length(frame.shape.bytes, frame.shape.fd)) {
    refuse(bus, frame,
           std::to_string(frame.shape.bytes) + " bytes is no length of a " +
               (frame.shape.fd ? "CAN FD frame" : "classic CAN frame (at most 8)"));
  }
  if (frame.shape.fd && bus.data_bitrate == 0) refuse(bus, frame, "CAN FD on a classic bus");
  if (frame.every_ns < 0) refuse(bus, frame, "every_ns must be 0 or more");
  if (frame.every_cycles < 1) refuse(bus, frame, "every_cycles must be 1 or more");
  if (!(frame.release >= 0.0 && frame.release <= 1.0)) refuse(bus, frame, "release must be from 0 to 1");
  if (!(frame.deadline > 0.0)) refuse(bus, frame, "deadline must be above 0");
}

std::vector<int> find_triggers(const PlannedBus& bus) {
  std::vector<int> triggers;
  for (const PlannedFrame& frame : bus.frames) {
    int found = -1;
    for (std::size_t k = 0; k < bus.frames.size() && !frame.after.empty(); ++k) {
      if (bus.frames[k].name == frame.after) found = static_cast<int>(k);
    }
    if (!frame.after.empty() && found < 0) refuse(bus, frame, "comes after \"" + frame.after + "\", which isn't there");
    triggers.push_back(found);
  }
  for (std::size_t i = 0; i < triggers.size(); ++i) {
    std::size_t steps = 0;
    for (int at = triggers[i]; at >= 0; at = triggers[static_cast<std::size_t>(at)]) {
      if (++steps > triggers.size()) refuse(bus, bus.frames[i], "comes after itself, by way of others");
    }
  }
  return triggers;
}

void check_pairs(const PlannedBus& bus) {
  for (std::size_t i = 0; i < bus.frames.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const PlannedFrame &one = bus.frames[k], &two = bus.frames[i];
      if (one.name == two.name) refuse(bus, two, "two frames have this name");
      if (one.id != two.id || one.shape.extended != two.shape.extended) continue;
      if (two.after == one.name || one.after == two.name) continue;  // an answer may use its question's identifier
      // One sender, and the frames are never pending at the same time.
      if (!two.sender.empty() && two.sender == one.sender && !two.after.empty()) continue;
      refuse(bus, two, "has the same identifier as \"" + one.name + "\"; give one of them another");
    }
  }
}

void check(const PlannedBus& bus, std::int64_t period_ns) {
  if (period_ns <= 0) {
    throw SetupError(
        {.bus = bus.name, .key = "timestep", .found = std::to_string(period_ns) + " ns", .expected = "above 0"});
  }
  if (bus.bitrate <= 0 || bus.data_bitrate < 0) {
    throw SetupError(
        {.bus = bus.name, .key = "bitrate", .found = std::to_string(bus.bitrate), .expected = "above 0 bit/s"});
  }
  for (const PlannedFrame& frame : bus.frames) check_frame(bus, frame);
  check_pairs(bus);
}

// Return how often the frame is sent in one cycle: at most, and on average.
int most_in_a_cycle(const PlannedFrame& frame, std::int64_t period_ns) {
  return frame.every_ns > 0 ? static_cast<int>((period_ns + frame.every_ns - 1) / frame.every_ns) : 1;
}

double mean_in_a_cycle(const PlannedFrame& frame, std::int64_t period_ns) {
  if (frame.every_ns > 0) return static_cast<double>(period_ns) / static_cast<double>(frame.every_ns);
  return 1.0 / frame.every_cycles;
}

void add_up(const PlannedBus& bus, BusPlan& plan) {
  const BitRates rates{bus.bitrate, bus.data_bitrate};
  double mean_ns = 0.0;
  for (const PlannedFrame& frame : bus.frames) {
    const WireBits worst = worst_wire_bits(frame.shape), least = minimum_wire_bits(frame.shape);
    const int most = most_in_a_cycle(frame, plan.period_ns);
    plan.worst_bits += most * worst.total();
    plan.least_bits += most * least.total();
    plan.worst_ns += most * wire_time_ns(worst, rates);
    plan.least_ns += most * wire_time_ns(least, rates);
    mean_ns += static_cast<double>(wire_time_ns(worst, rates)) * mean_in_a_cycle(frame, plan.period_ns);
  }
  const auto period_ns = static_cast<double>(plan.period_ns);
  plan.worst_load = static_cast<double>(plan.worst_ns) / period_ns;
  plan.least_load = static_cast<double>(plan.least_ns) / period_ns;
  plan.mean_worst_load = mean_ns / period_ns;
}

// Returns the mean wire time of a frame with its usual data, in ns.
double typical_ns(const PlannedFrame& frame, const BitRates& rates, std::mt19937& random) {
  std::vector<CanFrame> frames = frame.typical;
  for (int i = 0; frame.typical.empty() && i < 64; ++i) {
    CanFrame& made = frames.emplace_back();
    made.id = frame.id;
    made.extended = frame.shape.extended;
    made.fd = frame.shape.fd;
    made.bit_rate_switch = frame.shape.bit_rate_switch;
    made.length = static_cast<std::uint8_t>(frame.shape.bytes);
    std::generate_n(made.data.begin(), made.length, [&] { return static_cast<std::uint8_t>(random()); });
  }
  double sum_ns = 0.0;
  for (const CanFrame& each : frames) sum_ns += static_cast<double>(wire_time_ns(each, rates));
  return sum_ns / static_cast<double>(frames.size());
}

void add_up_typical(const PlannedBus& bus, BusPlan& plan) {
  std::mt19937 random(1);
  double sum_ns = 0.0;
  for (const PlannedFrame& frame : bus.frames) {
    sum_ns += typical_ns(frame, {bus.bitrate, bus.data_bitrate}, random) * mean_in_a_cycle(frame, plan.period_ns);
  }
  plan.typical_load = sum_ns / static_cast<double>(plan.period_ns);
}

void order_by_sync(const PlannedBus& bus, BusPlan& plan) {
  const auto sync = std::find_if(bus.frames.begin(), bus.frames.end(), [](const PlannedFrame& f) { return f.sync; });
  if (sync == bus.frames.end()) return;
  const BitRates rates{bus.bitrate, bus.data_bitrate};
  for (const PlannedFrame& frame : bus.frames) {
    if (&frame == &*sync) continue;
    plan.sync_jitter_ns = std::max(plan.sync_jitter_ns, wire_time_ns(worst_wire_bits(frame.shape), rates));
    if (planned_priority(frame) < planned_priority(*sync)) plan.outranking_sync.push_back(frame.name);
  }
}

void bound_responses(const PlannedBus& bus, BusPlan& plan) {
  const std::vector<FrameWindow> windows = response_windows(bus, find_triggers(bus), plan.period_ns);
  const BitRates rates{bus.bitrate, bus.data_bitrate};
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const PlannedFrame& frame = bus.frames[i];
    FramePlan out;
    out.name = frame.name;
    out.id = frame.id;
    out.extended = frame.shape.extended;
    out.wire_ns = wire_time_ns(worst_wire_bits(frame.shape), rates);
    out.response_ns = windows[i].response_ns;
    out.finish_ns = windows[i].any_time ? windows[i].response_ns : windows[i].finish_ns;
    const std::int64_t every_ns =
        frame.every_ns > 0 ? frame.every_ns : plan.period_ns * (windows[i].any_time ? frame.every_cycles : 1);
    out.deadline_ns = std::llround(frame.deadline * static_cast<double>(every_ns));
    out.bounded = windows[i].bounded;
    plan.frames.push_back(std::move(out));
  }
}

// Returns the complete plan except for the alternatives.
BusPlan analyse(const PlannedBus& bus, std::int64_t period_ns) {
  BusPlan plan;
  plan.name = bus.name;
  plan.period_ns = period_ns;
  plan.bitrate = bus.bitrate;
  plan.data_bitrate = bus.data_bitrate;
  add_up(bus, plan);
  order_by_sync(bus, plan);
  bound_responses(bus, plan);
  plan.fits = plan.worst_ns <= period_ns &&
              std::all_of(plan.frames.begin(), plan.frames.end(), [](const FramePlan& f) { return f.in_time(); });
  return plan;
}

void give_reasons(BusPlan& plan) {
  if (plan.worst_ns > plan.period_ns) {
    std::string need = microseconds(plan.worst_ns);
    if (plan.data_bitrate == 0) {
      need = std::to_string(plan.worst_bits) + " bits at worst at " + megabits(plan.bitrate) + " Mbit/s are " + need;
    } else {
      need = "the frames take " + need + " at worst";
    }
    plan.reasons.push_back(need + ", a cycle has " + microseconds(plan.period_ns));
    return;  // one reason is enough: a list of all late frames wouldn't help
  }
  for (const FramePlan& frame : plan.frames) {
    if (!frame.bounded) {
      plan.reasons.push_back(frame.name + " can wait for longer than it may");
    } else if (!frame.in_time()) {
      plan.reasons.push_back(frame.name + " arrives after " + microseconds(frame.finish_ns) + " at worst, due after " +
                             microseconds(frame.deadline_ns));
    }
  }
}

// Returns the shortest timestep above `above_ns` with which the bus fits, in steps of 0.25 ms.
std::optional<std::int64_t> shortest_period(const PlannedBus& bus, std::int64_t above_ns) {
  constexpr std::int64_t quarter = 250'000, longest = 20'000'000;
  for (std::int64_t period_ns = (above_ns / quarter + 1) * quarter; period_ns <= longest; period_ns += quarter) {
    BusPlan sums;
    sums.period_ns = period_ns;
    add_up(bus, sums);
    if (sums.worst_ns <= period_ns && analyse(bus, period_ns).fits) return period_ns;
  }
  return std::nullopt;
}

// Returns the number of buses among which the frames could be divided evenly. Each of these buses needs the SYNC.
std::optional<int> enough_buses(const PlannedBus& bus, const BusPlan& plan) {
  const BitRates rates{bus.bitrate, bus.data_bitrate};
  std::int64_t sync_ns = 0;
  for (const PlannedFrame& frame : bus.frames) {
    if (frame.sync) sync_ns += wire_time_ns(worst_wire_bits(frame.shape), rates);
  }
  for (int count = 2; count <= 8; ++count) {
    if (sync_ns + (plan.worst_ns - sync_ns + count - 1) / count <= plan.period_ns) return count;
  }
  return std::nullopt;
}

// Returns the bus with its frames as CAN FD frames. Frames without data, such as the SYNC, stay classic.
PlannedBus as_fd(const PlannedBus& bus, std::int64_t data_bitrate) {
  PlannedBus fd = bus;
  fd.data_bitrate = data_bitrate;
  for (PlannedFrame& frame : fd.frames) frame.shape.fd = frame.shape.bit_rate_switch = frame.shape.bytes > 0;
  return fd;
}

void find_alternatives(const PlannedBus& bus, BusPlan& plan) {
  if (const auto period_ns = shortest_period(bus, plan.period_ns)) {
    plan.alternatives.push_back(
        "a timestep of " + milliseconds(*period_ns) + " (load " +
        number(100.0 * static_cast<double>(plan.worst_ns) / static_cast<double>(*period_ns), 1) + " %)");
  }
  if (plan.worst_ns > plan.period_ns) {
    if (const auto count = enough_buses(bus, plan)) {
      plan.alternatives.push_back("these frames on " + std::to_string(*count) + " buses or more");
    }
  }
  if (bus.data_bitrate != 0) return;
  for (const std::int64_t rate : {2'000'000, 5'000'000}) {
    if (rate <= bus.bitrate) continue;
    const BusPlan fd = analyse(as_fd(bus, rate), plan.period_ns);
    if (!fd.fits) continue;
    plan.alternatives.push_back("CAN FD at " + megabits(bus.bitrate) + "/" + megabits(rate) + " Mbit/s (" +
                                microseconds(fd.worst_ns) + ")");
    break;
  }
}

}  // namespace

BusPlan plan_bus(const PlannedBus& bus, std::int64_t period_ns) {
  check(bus, period_ns);
  BusPlan plan = analyse(bus, period_ns);
  add_up_typical(bus, plan);
  if (!plan.fits) {
    give_reasons(plan);
    find_alternatives(bus, plan);
  }
  return plan;
}

namespace {

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : between) + part;
  return out;
}

std::string frame_row(const FramePlan& frame) {
  char id[16], row[160];
  std::snprintf(id, sizeof id, frame.extended ? "%08X" : "%03X", frame.id);
  std::snprintf(row, sizeof row, "  %-24s %8s %9.1f %11.1f %11.1f %11.1f  %s\n", frame.name.c_str(), id,
                static_cast<double>(frame.wire_ns) * 1e-3, static_cast<double>(frame.response_ns) * 1e-3,
                static_cast<double>(frame.finish_ns) * 1e-3, static_cast<double>(frame.deadline_ns) * 1e-3,
                !frame.bounded    ? "no bound"
                : frame.in_time() ? "in time"
                                  : "LATE");
  return row;
}

}  // namespace

std::string plan_text(const BusPlan& plan) {
  const std::string rate = megabits(plan.bitrate) + (plan.data_bitrate != 0 ? "/" + megabits(plan.data_bitrate) : "");
  std::string text = plan.name + ": " + rate + " Mbit/s, timestep " + milliseconds(plan.period_ns) + "\n";
  text += "  load where every frame is due: " + number(100.0 * plan.least_load, 1) + " to " +
          number(100.0 * plan.worst_load, 1) + " % (" + std::to_string(plan.worst_bits) + " bits, " +
          microseconds(plan.worst_ns) + " of " + microseconds(plan.period_ns) + "); over many cycles typically " +
          number(100.0 * plan.typical_load, 1) + " %, at most " + number(100.0 * plan.mean_worst_load, 1) + " %\n";
  if (plan.sync_jitter_ns > 0) {
    text += "  SYNC can be held back by " + microseconds(plan.sync_jitter_ns) + " (the longest other frame)\n";
  }
  if (!plan.outranking_sync.empty()) text += "  outrank SYNC: " + joined(plan.outranking_sync, ", ") + "\n";
  text += "  frame                          id   wire us response us      end us      due us\n";
  for (const FramePlan& frame : plan.frames) text += frame_row(frame);
  if (plan.fits) return text + "  fits\n";
  text += "  does not fit: " + joined(plan.reasons, "; ") + "\n";
  if (!plan.alternatives.empty()) text += "  would fit: " + joined(plan.alternatives, "; or ") + "\n";
  return text;
}

std::string refusal_text(const std::vector<BusPlan>& plans) {
  std::vector<std::string> parts;
  for (const BusPlan& plan : plans) {
    if (plan.fits) continue;
    std::string part = "bus " + plan.name + " can't carry a timestep of " + milliseconds(plan.period_ns) + ": " +
                       joined(plan.reasons, "; ");
    if (!plan.alternatives.empty()) part += "; would fit: " + joined(plan.alternatives, ", or ");
    parts.push_back(std::move(part));
  }
  return joined(parts, "; ");
}

}  // namespace proxarm::fieldbus
