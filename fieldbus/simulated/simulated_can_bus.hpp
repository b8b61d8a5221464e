// One in-process CAN bus with real bit timing and arbitration, on the event queue of its SimulatedCanNetwork.
//
// Each port (the controller's, and one per node) has a first-in first-out transmit queue, whose head takes part in
// arbitration. When the bus goes idle, the head with the dominant identifier wins and occupies the bus for its exact
// length (can_timing.hpp). All other ports receive the frame at the end of its EOF field; the next frame may start
// three bits later.
//
// A frame that no other node acknowledges isn't delivered: the controller turns error passive, its queue fills up, and
// it continues when a node is attached or comes back.
//
// A frame destroyed by noise (FaultAction::destroy) ends in an error frame and is repeated at once. Every node counts
// its errors as in ISO 11898-1:
//     error      sender's transmit counter +8, others' receive counters +1
//     success    sender's −1, others' −1 (from above 127 down to 127)
//     state      by the larger one: error warning from 96, error passive from 128; bus-off when transmit is above 255
// Bus-off purges the queue. With restart_ns the node returns after that time and 128 times 11 recessive bits; without
// it, never. Not modelled: the pause of 8 bits that an error passive sender makes after its frames.
//
// Arbitration is bit by bit: the lower base identifier wins; then a data frame over a remote one, an 11-bit over a
// 29-bit identifier, a classic over an FD frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fieldbus/can/bus_statistics.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/can/can_port.hpp"
#include "fieldbus/can/can_timing.hpp"
#include "fieldbus/can/ring_buffer.hpp"
#include "fieldbus/simulated/event_queue.hpp"
#include "fieldbus/simulated/fault_script.hpp"

namespace proxarm::fieldbus {

struct SimulatedBusConfig {
  std::string name;
  std::int64_t bitrate = 1'000'000;             // bit/s, 10'000 to 1'000'000, the range of CAN
  std::int64_t data_bitrate = 0;                // bit/s of CAN FD's data phase, up to 8'000'000; 0: a classic bus
  std::size_t transmit_queue_length = 10;       // frames behind the one in the controller (SocketCAN's txqueuelen)
  std::size_t node_transmit_queue_length = 64;  // the same for attached nodes
  std::size_t receive_queue_length = 1024;      // frames; further ones are lost and counted
  std::int64_t load_window_ns = 1'000'000;      // for BusStatistics::peak_load()
  std::int64_t restart_ns = 0;                  // after bus-off by errors (SocketCAN's restart-ms); 0: never
};

struct ErrorCounters {
  int transmit = 0;
  int receive = 0;
};

// A frame as it was on the wire, for logs. `frame` is valid only during the call.
struct WireFrame {
  const CanFrame& frame;
  std::int64_t queued_ns;
  std::int64_t start_ns;
  std::int64_t end_ns;  // time of reception
  std::size_t bus;
  std::string_view bus_name;
  std::string_view sender;  // port name; "controller"
  bool lost;                // dropped or destroyed by a fault rule
};
using WireObserver = std::function<void(const WireFrame&)>;

enum class NodeFormat : std::uint8_t { as_bus, classic, fd };

class SimulatedCanBus final : public CanBus {
 public:
  // Constructed by SimulatedCanNetwork, which owns the event queue and counts the frames in all receive queues.
  SimulatedCanBus(SimulatedBusConfig config, std::size_t index, EventQueue& events, std::size_t& frames_waiting);
  ~SimulatedCanBus() override;

  // Adds a node before the start. `listener` must outlive the bus; the port lives as long as the bus. Throws SetupError
  // if the name is taken, or if a classic and an FD node would share the bus: a classic node answers every FD frame
  // with an error.
  CanPort& attach(CanListener& listener, std::string name, NodeFormat format = NodeFormat::as_bus);

  SendResult send(const CanFrame& frame) noexcept override;
  bool receive(TimedFrame& out) noexcept override;
  [[nodiscard]] const BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return config_.name; }

  // bus_off and down purge the port's queue and disconnect it; the error_ states reconnect it. False: no such port.
  bool set_state(std::string_view port, BusState state) noexcept;
  // Zeros if there is no such port.
  [[nodiscard]] ErrorCounters error_counters(std::string_view port) const noexcept;
  void set_observer(WireObserver observer) { observer_ = std::move(observer); }

  [[nodiscard]] const SimulatedBusConfig& config() const noexcept { return config_; }
  [[nodiscard]] BusStatistics& statistics() noexcept { return statistics_; }
  [[nodiscard]] const BusStatistics& statistics() const noexcept { return statistics_; }
  [[nodiscard]] double load() const noexcept { return statistics_.load(events_.now_ns()); }  // since reset()
  [[nodiscard]] std::size_t transmit_queue_size() const noexcept;  // the controller's, including the frame on the wire

  [[nodiscard]] bool has_port(std::string_view name) const noexcept;
  // For SimulatedCanNetwork::apply(): throws SetupError if a rule names a port that the bus doesn't have.
  void add_fault(const FaultRule& rule);

 private:
  class Port;
  struct ActiveFault {
    FaultRule rule;
    std::uint64_t seen = 0;
  };
  struct DelayedFrame {
    CanFrame frame;
    Port* receiver = nullptr;
  };

  [[nodiscard]] bool can_carry(const CanFrame& frame) const noexcept;
  SendResult queue_frame(Port& port, const CanFrame& frame) noexcept;
  [[nodiscard]] Port* find_port(std::string_view name) noexcept;
  void change_state(Port& port, BusState state) noexcept;
  void force_state(Port& port, BusState state) noexcept;
  void count_errors(const Port* sender, bool destroyed) noexcept;
  void follow_errors(Port& port) noexcept;
  void request_arbitration();
  void arbitrate();
  [[nodiscard]] bool is_acknowledged(const Port& sender) const noexcept;
  [[nodiscard]] Port* arbitration_winner() noexcept;
  void pick_faults() noexcept;
  void complete();
  void log(bool lost) const;
  void deliver_to(Port& port);
  void deliver(Port& port, const CanFrame& frame) noexcept;
  void deliver_later(Port& port, const CanFrame& frame, std::int64_t delay_ns);
  void babble(const FaultRule& rule);
  void babble_once(std::size_t fault, Port& port);

  SimulatedBusConfig config_;
  std::size_t index_;
  EventQueue& events_;
  std::size_t& frames_waiting_;
  BitRates rates_;
  std::int64_t interframe_ns_;
  std::int64_t error_frame_ns_;
  BusStatus status_;
  BusStatistics statistics_;
  WireObserver observer_;
  std::vector<std::unique_ptr<Port>> ports_;  // the controller's first
  RingBuffer<TimedFrame> received_;

  // The frame on the wire.
  CanFrame current_;
  Port* sender_ = nullptr;  // nullptr: the bus is idle, or the sender went off during its frame
  std::int64_t current_start_ns_ = 0;
  std::int64_t current_queued_ns_ = 0;
  bool transmitting_ = false;
  bool repeating_ = false;  // second transmission of a duplicated frame
  bool arbitration_requested_ = false;
  bool alone_ = false;        // the controller is error passive because no node acknowledges
  bool any_errors_ = false;   // some counter is above zero
  std::int64_t idle_ns_ = 0;  // earliest start of the next frame

  std::vector<ActiveFault> faults_;
  std::vector<std::size_t> matched_;  // indices of the faults that apply to the current frame
  std::vector<DelayedFrame> delayed_;
  std::vector<std::size_t> free_delayed_;
};

}  // namespace proxarm::fieldbus
