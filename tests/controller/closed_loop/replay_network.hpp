// A network that remembers what its owner received, and one that plays it back: the controller alone runs on it, with
// nobody at the far end, as its sends go nowhere.
#pragma once

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::controller::testing {

using Recording = std::vector<std::vector<fieldbus::TimedFrame>>;  // per bus, in the order of receipt

// A bus that passes everything on.
struct BusAround : fieldbus::CanBus {
  explicit BusAround(fieldbus::CanBus& bus) : inner(bus) {}
  fieldbus::SendResult send(const fieldbus::CanFrame& frame) noexcept override { return inner.send(frame); }
  bool receive(fieldbus::TimedFrame& out) noexcept override { return inner.receive(out); }
  [[nodiscard]] const fieldbus::BusStatus& status() const noexcept override { return inner.status(); }
  [[nodiscard]] const std::string& name() const noexcept override { return inner.name(); }

  fieldbus::CanBus& inner;
};

// A network with a Bus (a BusAround) around each of its buses.
template <typename Bus>
class NetworkAround : public fieldbus::CanNetwork {
 public:
  // `arguments`: of each Bus, behind the bus that it is around.
  template <typename... Arguments>
  explicit NetworkAround(fieldbus::CanNetwork& inner, Arguments&&... arguments) : network(inner) {
    for (std::size_t i = 0; i < inner.bus_count(); ++i) {
      buses.push_back(std::make_unique<Bus>(inner.bus(i), arguments...));
    }
  }
  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses.size(); }
  [[nodiscard]] fieldbus::CanBus& bus(std::size_t index) noexcept override { return *buses[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return network.now_ns(); }
  void sleep_until(std::int64_t deadline_ns) noexcept override { network.sleep_until(deadline_ns); }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override { return network.wait_for_frame(deadline_ns); }

 protected:
  fieldbus::CanNetwork& network;
  std::vector<std::unique_ptr<Bus>> buses;
};

struct RecordingBus final : BusAround {
  using BusAround::BusAround;
  bool receive(fieldbus::TimedFrame& out) noexcept override {
    if (!inner.receive(out)) return false;
    received.push_back(out);
    return true;
  }

  std::vector<fieldbus::TimedFrame> received;
};

class RecordingNetwork final : public NetworkAround<RecordingBus> {
 public:
  using NetworkAround::NetworkAround;
  [[nodiscard]] Recording recording() const {
    Recording all;
    for (const auto& bus : buses) all.push_back(bus->received);
    return all;
  }
};

class ReplayNetwork final : public fieldbus::CanNetwork {
 public:
  ReplayNetwork(Recording recording, const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < recording.size(); ++i) {
      buses_.push_back(std::make_unique<Bus>(time_ns_, std::move(recording[i]), names[i]));
    }
  }
  [[nodiscard]] std::uint64_t frames_sent() const noexcept {
    std::uint64_t sent = 0;
    for (const auto& bus : buses_) sent += bus->sent;
    return sent;
  }
  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses_.size(); }
  [[nodiscard]] fieldbus::CanBus& bus(std::size_t index) noexcept override { return *buses_[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return time_ns_; }
  void sleep_until(std::int64_t deadline_ns) noexcept override { time_ns_ = std::max(time_ns_, deadline_ns); }
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override {
    std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
    for (const auto& bus : buses_) next_ns = std::min(next_ns, bus->next_ns());
    sleep_until(std::min(next_ns, deadline_ns));
    return next_ns <= deadline_ns;
  }

 private:
  struct Bus final : fieldbus::CanBus {
    Bus(const std::int64_t& time, std::vector<fieldbus::TimedFrame> recorded, std::string its_name)
        : now_ns(time), frames(std::move(recorded)), own_name(std::move(its_name)) {}
    fieldbus::SendResult send(const fieldbus::CanFrame& /*frame*/) noexcept override {
      ++sent;
      return fieldbus::SendResult::sent;
    }
    bool receive(fieldbus::TimedFrame& out) noexcept override {
      if (next_ns() > now_ns) return false;
      out = frames[next++];
      return true;
    }
    [[nodiscard]] std::int64_t next_ns() const noexcept {
      return next < frames.size() ? frames[next].time_ns : std::numeric_limits<std::int64_t>::max();
    }
    [[nodiscard]] const fieldbus::BusStatus& status() const noexcept override { return own_status; }
    [[nodiscard]] const std::string& name() const noexcept override { return own_name; }

    const std::int64_t& now_ns;
    std::vector<fieldbus::TimedFrame> frames;
    std::size_t next = 0;
    std::uint64_t sent = 0;
    fieldbus::BusStatus own_status;
    std::string own_name;
  };

  std::int64_t time_ns_ = 0;
  std::vector<std::unique_ptr<Bus>> buses_;
};

}  // namespace proxarm::controller::testing
