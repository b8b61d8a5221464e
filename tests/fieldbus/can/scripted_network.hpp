// A CanNetwork for conversation tests: virtual time, and an answering script instead of devices.
//
// Frames are written and compared as candump writes them: "602#4018100100000000".
#pragma once

#include <cctype>
#include <cstdio>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::fieldbus {

inline CanFrame frame_of(const std::string& text) {
  CanFrame frame;
  const std::size_t hash = text.find('#');
  frame.id = static_cast<std::uint32_t>(std::stoul(text.substr(0, hash), nullptr, 16));
  std::string digits;
  for (const char c : text.substr(hash + 1)) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) digits += c;
  }
  frame.length = static_cast<std::uint8_t>(digits.size() / 2);
  for (std::size_t i = 0; i < frame.length; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(std::stoul(digits.substr(2 * i, 2), nullptr, 16));
  }
  return frame;
}

inline std::string text_of(const CanFrame& frame) {
  char head[16];
  std::snprintf(head, sizeof head, "%03X#", static_cast<unsigned>(frame.id));
  std::string text = head;
  for (const std::uint8_t byte : frame.bytes()) {
    std::snprintf(head, sizeof head, "%02X", unsigned{byte});
    text += head;
  }
  return text;
}

class ScriptedNetwork;

class ScriptedBus final : public CanBus {
 public:
  explicit ScriptedBus(ScriptedNetwork& network, std::string name) : network_(network), name_(std::move(name)) {}

  SendResult send(const CanFrame& frame) noexcept override;
  bool receive(TimedFrame& out) noexcept override;
  [[nodiscard]] const BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

  // The device's side: a frame arrives at the master `delay_ns` from now.
  void arrive(const CanFrame& frame, std::int64_t delay_ns = 100'000);
  void arrive(const std::string& frame, std::int64_t delay_ns = 100'000) { arrive(frame_of(frame), delay_ns); }
  [[nodiscard]] std::int64_t next_arrival_ns() const { return queue_.empty() ? INT64_MAX : queue_.front().time_ns; }

  std::vector<std::string> sent;                      // everything the master sent
  std::function<void(const CanFrame&)> on_send;       // the script
  std::function<SendResult(const CanFrame&)> refuse;  // unless it says `sent`, nothing is sent

 private:
  ScriptedNetwork& network_;
  std::string name_;
  BusStatus status_;
  std::deque<TimedFrame> queue_;  // ordered by time
};

class ScriptedNetwork final : public CanNetwork {
 public:
  explicit ScriptedNetwork(std::vector<std::string> names = {"vcan0"}) {
    for (std::string& name : names) buses.push_back(std::make_unique<ScriptedBus>(*this, name));
  }
  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses.size(); }
  [[nodiscard]] ScriptedBus& bus(std::size_t index) noexcept override { return *buses[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return time_ns; }
  void sleep_until(std::int64_t deadline_ns) noexcept override { time_ns = std::max(time_ns, deadline_ns); }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override {
    std::int64_t next_ns = INT64_MAX;
    for (const auto& b : buses) next_ns = std::min(next_ns, b->next_arrival_ns());
    sleep_until(std::min(next_ns, deadline_ns));
    return next_ns <= deadline_ns;
  }

  std::int64_t time_ns = 1'000'000'000;
  std::vector<std::unique_ptr<ScriptedBus>> buses;
};

inline SendResult ScriptedBus::send(const CanFrame& frame) noexcept {
  if (refuse) {
    const SendResult result = refuse(frame);
    if (result != SendResult::sent) return result;
  }
  sent.push_back(text_of(frame));
  if (on_send) on_send(frame);
  return SendResult::sent;
}

inline bool ScriptedBus::receive(TimedFrame& out) noexcept {
  if (queue_.empty() || queue_.front().time_ns > network_.time_ns) return false;
  out = queue_.front();
  queue_.pop_front();
  return true;
}

inline void ScriptedBus::arrive(const CanFrame& frame, std::int64_t delay_ns) {
  const TimedFrame timed{frame, network_.time_ns + delay_ns};
  auto place = queue_.end();
  while (place != queue_.begin() && std::prev(place)->time_ns > timed.time_ns) --place;
  queue_.insert(place, timed);
}

// Plays a conversation: each line "> frame" is what the master must send next, each "< frame" is answered at once.
class Conversation {
 public:
  Conversation(ScriptedBus& bus, std::vector<std::string> lines) : bus_(bus), lines_(std::move(lines)) {
    bus_.on_send = [this](const CanFrame& frame) { on_send(frame); };
    answer();
  }
  ~Conversation() { bus_.on_send = nullptr; }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  [[nodiscard]] bool complete() const { return next_ == lines_.size() && mistakes.empty(); }
  std::string mistakes;  // what was sent where something else, or nothing, was expected

 private:
  void on_send(const CanFrame& frame) {
    const std::string got = "> " + text_of(frame);
    const std::string expected =
        next_ < lines_.size() ? "> " + text_of(frame_of(lines_[next_].substr(2))) : "> nothing";
    if (got != expected) {
      mistakes += "sent " + got + ", expected " + expected + "\n";
      return;
    }
    ++next_;
    answer();
  }
  void answer() {
    std::int64_t delay_ns = 100'000;
    while (next_ < lines_.size() && lines_[next_][0] == '<') {
      bus_.arrive(lines_[next_].substr(2), delay_ns);
      delay_ns += 100'000;
      ++next_;
    }
  }

  ScriptedBus& bus_;
  std::vector<std::string> lines_;
  std::size_t next_ = 0;
};

}  // namespace proxarm::fieldbus
