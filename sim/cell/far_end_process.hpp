// Runs the simulated cell as a separate process on interfaces of a real kernel, for `proxarm sim`.
//
// An event loop on one thread that sleeps until the next frame or event. It never spins, so it also works with a clock
// that stands still while the process computes. Prints nothing.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "fieldbus/simulated/event_queue.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::fieldbus {
class SocketCanNetwork;
}

namespace proxarm::sim {

struct FarEndStatistics {
  std::uint64_t frames_received = 0;
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_not_sent = 0;  // refused by the interface
  std::uint64_t frames_lost = 0;      // dropped by the kernel because its receive buffer was full
  std::uint64_t wake_ups = 0;
  std::uint64_t late_wake_ups = 0;     // later than a tick of the devices after the event was due
  std::int64_t latest_wake_up_ns = 0;  // lateness of the worst one
};

class FarEndProcess {
 public:
  // `interface_of_bus[i]` is the network's index of the interface that carries the cell's bus i; several buses may
  // share one. Throws SetupError as SimulatedCell does, and for nodes or identifiers that collide on one interface.
  FarEndProcess(const description::Cell& cell, const description::SensorDescription& sensor,
                const description::HandDescription& hand, fieldbus::CanNetwork& network,
                const std::vector<std::size_t>& interface_of_bus, const SimulatedCellConfig& config = {});
  FarEndProcess(const FarEndProcess&) = delete;
  FarEndProcess& operator=(const FarEndProcess&) = delete;
  ~FarEndProcess();

  // Until `stop` is set (noticed within 20 ms) or the network's clock reaches until_ns. May be called again.
  void run(const std::atomic<bool>& stop, std::int64_t until_ns = std::numeric_limits<std::int64_t>::max());

  [[nodiscard]] FarEndStatistics statistics() const;
  [[nodiscard]] SimulatedCell& cell() noexcept { return *cell_; }
  [[nodiscard]] bool powered() const noexcept { return powered_; }

 private:
  class InterfacePort;

  void receive_all(std::int64_t now_ns);
  void deliver(std::size_t interface, const fieldbus::TimedFrame& timed, std::int64_t now_ns);
  void run_events(std::int64_t now_ns);

  fieldbus::CanNetwork& network_;
  fieldbus::EventQueue events_;
  std::vector<std::size_t> interface_of_bus_;
  std::vector<std::unique_ptr<InterfacePort>> ports_;
  std::unique_ptr<SimulatedCell> cell_;
  std::int64_t tick_ns_;
  FarEndStatistics statistics_;
  bool powered_ = false;
};

// Accepts only the frames that the acceptance filters of the cell's devices would: NMT, SYNC, heartbeats, frames with a
// drive's node number, and the sensor's identifiers.
void set_acceptance_filters(fieldbus::SocketCanNetwork& network, const description::Cell& cell,
                            const description::SensorDescription& sensor,
                            const std::vector<std::size_t>& interface_of_bus);

// Opens the kernel's interfaces, one name per bus of the cell (the same name twice is one logical bus), and runs until
// `stop`. Throws SetupError as FarEndProcess does, and for interfaces that can't be opened.
FarEndStatistics run_on_socketcan(const description::Cell& cell, const description::SensorDescription& sensor,
                                  const description::HandDescription& hand, const std::vector<std::string>& interfaces,
                                  const std::atomic<bool>& stop, const SimulatedCellConfig& config = {});

}  // namespace proxarm::sim
