// Runs simulated nodes in real time on real interfaces: the far end of the wire as a process of its own.
//
//   SocketCanNetwork network({"vcan0"});
//   NodeLoop loop(network);
//   Drive drive(loop.attach(0, drive_listener), loop.events());
//   loop.run(stop);                       // until the flag is set, by a signal handler for example
//
// The nodes are the same as on SimulatedCanNetwork: they send on a CanPort, hear on_frame() and schedule events on
// events(), whose clock is the network's. Between events and frames the loop sleeps. Several nodes on one bus share one
// socket, so what one sends the loop itself hands to the others. Events run at their own time (EventQueue::now_ns())
// even if the machine is late; frames that came before an event are heard before it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "fieldbus/can_network.hpp"
#include "fieldbus/can_port.hpp"
#include "fieldbus/event_queue.hpp"
#include "fieldbus/ring_buffer.hpp"

namespace proxarm::fieldbus {

class NodeLoop {
 public:
  explicit NodeLoop(CanNetwork& network);
  ~NodeLoop();
  NodeLoop(const NodeLoop&) = delete;
  NodeLoop& operator=(const NodeLoop&) = delete;

  // Set-up only; `listener` outlives the loop, the port lives as long as the loop.
  CanPort& attach(std::size_t bus, CanListener& listener);
  [[nodiscard]] EventQueue& events() noexcept { return events_; }

  // Until the network's clock reaches end_ns.
  void run_until(std::int64_t end_ns);
  // Until the flag is set; looks at it at least every 100 ms.
  void run(const std::atomic<bool>& stop);

 private:
  class Port;
  struct LocalFrame {
    CanFrame frame;
    const Port* sender = nullptr;
  };

  void step(std::int64_t limit_ns);
  void take_frames();
  void hand_over_local_frames();

  CanNetwork& network_;
  EventQueue events_;
  std::vector<std::unique_ptr<Port>> ports_;
  RingBuffer<LocalFrame> local_;
};

}  // namespace proxarm::fieldbus
