// What the tests of the simulated devices share: a port that writes down what was sent, frames from bytes, an axis that
// is ideal.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <vector>

#include "sim/bus/device_port.hpp"
#include "sim/devices/servo_axis.hpp"

namespace proxarm::sim::testing {

constexpr std::int64_t ms = 1'000'000;

// "181#3712001000" as candump writes it.
inline std::string to_text(const fieldbus::CanFrame& frame) {
  char buffer[8];
  std::snprintf(buffer, sizeof buffer, "%03X#", frame.id);
  std::string text = buffer;
  for (const std::uint8_t byte : frame.bytes()) {
    std::snprintf(buffer, sizeof buffer, "%02X", byte);
    text += buffer;
  }
  return text;
}

inline fieldbus::CanFrame from_text(const std::string& text) {
  fieldbus::CanFrame frame;
  const std::size_t hash = text.find('#');
  frame.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16));
  std::string digits;
  for (const char c : text.substr(hash + 1)) {
    if (c != ' ') digits += c;
  }
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    frame.data[frame.length++] = static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16));
  }
  return frame;
}

class RecordingPort final : public DevicePort {
 public:
  void send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept override {
    frames.push_back(frame);
    times_ns.push_back(ready_ns);
  }
  // What was sent since the last call, as text.
  std::vector<std::string> take() {
    std::vector<std::string> texts;
    for (const auto& frame : frames) texts.push_back(to_text(frame));
    frames.clear();
    times_ns.clear();
    return texts;
  }

  std::vector<fieldbus::CanFrame> frames;
  std::vector<std::int64_t> times_ns;
};

// Is where it is told to be, one call of move() later; slows down in steps of its own when stopped.
class IdealAxis final : public ServoAxis {
 public:
  void enable(std::int64_t) noexcept override {
    enabled = true;
    target = position;
    speed = 0.0;
  }
  void disable() noexcept override {
    enabled = false;
    speed = 0.0;
  }
  void set_interpolation_period_ns(std::int64_t period) noexcept override { period_ns = period; }
  void set_torque(double ratio) noexcept override { torques.push_back(ratio); }
  void set_target(std::int32_t counts, std::int64_t time_ns) noexcept override {
    targets.push_back(counts);
    from = position;
    target = counts;
    start_ns = time_ns;
    stopping = false;
    speed = (target - from) / (1e-9 * static_cast<double>(period_ns));
  }
  void stop(double counts_per_s2, std::int64_t time_ns) noexcept override {
    stops.push_back(counts_per_s2);
    if (!stopping) start_ns = time_ns;
    stopping = true;
    deceleration = counts_per_s2;
    last_ns = time_ns;
  }
  void move(std::int64_t time_ns) noexcept {
    if (!enabled) return;
    if (stopping) {
      const double h = 1e-9 * static_cast<double>(time_ns - last_ns);
      const double loss = deceleration * h;
      speed = std::abs(speed) <= loss ? 0.0 : speed - (speed > 0 ? loss : -loss);
      position += speed * h;
      last_ns = time_ns;
      return;
    }
    const double s = period_ns == 0 ? 1.0 : static_cast<double>(time_ns - start_ns) / static_cast<double>(period_ns);
    if (!jammed) position = s >= 1.0 ? target : from + (target - from) * s;
  }

  [[nodiscard]] std::int32_t position_counts() const noexcept override { return static_cast<std::int32_t>(position); }
  [[nodiscard]] std::int32_t demand_counts() const noexcept override {
    return static_cast<std::int32_t>(jammed ? target : position);
  }
  [[nodiscard]] double speed_counts_per_s() const noexcept override { return speed; }
  [[nodiscard]] double torque_ratio() const noexcept override { return 0.0; }
  [[nodiscard]] bool limited() const noexcept override { return false; }
  [[nodiscard]] bool at_rest() const noexcept override { return speed == 0.0; }

  bool enabled = false, stopping = false, jammed = false;
  double position = 0.0, from = 0.0, target = 0.0, speed = 0.0, deceleration = 0.0;
  std::int64_t period_ns = 0, start_ns = 0, last_ns = 0;
  std::vector<std::int32_t> targets;
  std::vector<double> stops, torques;
};

inline int scaled(int count) {
  const char* scale = std::getenv("PROXARM_TEST_SCALE");
  return static_cast<int>(count * (scale == nullptr ? 1.0 : std::atof(scale)));
}

}  // namespace proxarm::sim::testing
