// One in-process CAN bus with real bit timing and arbitration. Its events run on the event queue of its
// SimulatedCanNetwork.
//
// The controller has a port, and each node has one. Each port has a first-in first-out transmit queue; the frame at the
// head of each queue takes part in arbitration. When the bus goes idle, the head with the dominant identifier wins and
// occupies the bus for the exact length of the frame (can_timing.hpp). All other ports receive the frame at the end of
// its EOF field. The next frame may start three bits later.
//
// A frame that no other node acknowledges isn't delivered. If the controller sent it, the controller turns error
// passive and its queue fills up. It continues when a node is attached or comes back.
//
// A frame that noise destroys (FaultAction::destroy) ends in an error frame and is repeated at once. Every node counts
// its errors as in ISO 11898-1:
//     error      the sender's transmit counter +8, the receive counters of other nodes +1
//     success    the sender's transmit counter −1, the receive counters of other nodes −1 (to 127 if above)
//     state      error warning if a counter is at least 96, error passive if a counter is at least 128,
//                bus-off if the transmit counter is above 255
// Bus-off purges the node's queue. With restart_ns > 0 the node returns after that time plus 128 times 11 recessive
// bits; with restart_ns = 0 it never returns. The pause of 8 bits that an error passive sender makes after its frames
// isn't modelled.
//
// Arbitration is bit by bit. The lower base identifier wins. If the base identifiers are equal, a data frame wins over
// a remote frame, an 11-bit identifier over a 29-bit identifier, and a classic frame over an FD frame.
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
  std::int64_t bitrate = 1'000'000;  // bit/s, 10'000 to 1'000'000, the range of CAN
  std::int64_t data_bitrate = 0;     // bit/s of the CAN FD data phase, up to 8'000'000; 0: a classic bus
  // Frames that can wait behind the frame in the controller (SocketCAN's txqueuelen).
  std::size_t transmit_queue_length = 10;
  std::size_t node_transmit_queue_length = 64;  // transmit_queue_length of attached nodes
  // Frames that the controller can hold before they are received; further frames are lost and counted.
  std::size_t receive_queue_length = 1024;
  std::int64_t load_window_ns = 1'000'000;  // window of BusStatistics::peak_load()
  // Time after which a node that went bus-off by errors restarts (SocketCAN's restart-ms); 0: never.
  std::int64_t restart_ns = 0;
};

struct ErrorCounters {
  int transmit = 0;
  int receive = 0;
};

// A frame that was on the wire, for logs. `frame` is valid only during the call of the observer.
struct WireFrame {
  const CanFrame& frame;
  std::int64_t queued_ns;
  std::int64_t start_ns;
  std::int64_t end_ns;  // end of the frame, when it is received
  std::size_t bus;
  std::string_view bus_name;
  // Name of the sender's port, such as "controller"; empty if the sender went off during the frame.
  std::string_view sender;
  bool lost;  // true: a fault rule dropped or destroyed the frame
};
using WireObserver = std::function<void(const WireFrame&)>;

enum class NodeFormat : std::uint8_t { as_bus, classic, fd };

class SimulatedCanBus final : public CanBus {
 public:
  // SimulatedCanNetwork constructs the bus. `events` is the network's event queue; `frames_waiting` is the number of
  // frames in the receive queues of all buses, which each bus keeps up to date.
  SimulatedCanBus(SimulatedBusConfig config, std::size_t index, EventQueue& events, std::size_t& frames_waiting);
  ~SimulatedCanBus() override;

  // Adds a node. Must be called before the start. `listener` must outlive the bus; the port lives as long as the bus.
  // Throws SetupError if the name is taken, or if a classic node and an FD node would share the bus, because a classic
  // node answers every FD frame with an error.
  CanPort& attach(CanListener& listener, std::string name, NodeFormat format = NodeFormat::as_bus);

  SendResult send(const CanFrame& frame) noexcept override;
  bool receive(TimedFrame& out) noexcept override;
  [[nodiscard]] const BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return config_.name; }

  // Sets the state of a port. The states bus_off and down purge the port's queue and disconnect the port; the error_
  // states connect it again. False if there is no such port.
  bool set_state(std::string_view port, BusState state) noexcept;
  // Returns zeros if there is no such port.
  [[nodiscard]] ErrorCounters error_counters(std::string_view port) const noexcept;
  void set_observer(WireObserver observer) { observer_ = std::move(observer); }

  [[nodiscard]] const SimulatedBusConfig& config() const noexcept { return config_; }
  [[nodiscard]] BusStatistics& statistics() noexcept { return statistics_; }
  [[nodiscard]] const BusStatistics& statistics() const noexcept { return statistics_; }
  // Returns the bus load since the last reset of the statistics.
  [[nodiscard]] double load() const noexcept { return statistics_.load(events_.now_ns()); }
  // Returns the size of the controller's transmit queue, including the frame on the wire.
  [[nodiscard]] std::size_t transmit_queue_size() const noexcept;

  [[nodiscard]] bool has_port(std::string_view name) const noexcept;
  // Adds a rule; called by SimulatedCanNetwork::apply(). Throws SetupError if the rule names a port that the bus
  // doesn't have.
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
  std::vector<std::unique_ptr<Port>> ports_;  // the first port is the controller's
  RingBuffer<TimedFrame> received_;

  // The frame on the wire.
  CanFrame current_;
  Port* sender_ = nullptr;  // nullptr: the bus is idle, or the sender went off the bus during its frame
  std::int64_t current_start_ns_ = 0;
  std::int64_t current_queued_ns_ = 0;
  bool transmitting_ = false;
  bool repeating_ = false;  // the frame on the wire is the second transmission of a duplicated frame
  bool arbitration_requested_ = false;
  bool alone_ = false;        // the controller is error passive because no node acknowledges its frames
  bool any_errors_ = false;   // some error counter is above zero
  std::int64_t idle_ns_ = 0;  // earliest start of the next frame

  std::vector<ActiveFault> faults_;
  std::vector<std::size_t> matched_;  // indices in faults_ of the rules that apply to the frame on the wire
  std::vector<DelayedFrame> delayed_;
  std::vector<std::size_t> free_delayed_;
};

}  // namespace proxarm::fieldbus
