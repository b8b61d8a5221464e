// Runs the simulated cell as a separate process on CAN interfaces of the kernel, for `proxarm sim`.
//
// It is an event loop on one thread that sleeps until the next frame or event. The loop never polls the clock without
// sleeping, so it also works with a clock that stands still while the process computes. It prints nothing.
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
  std::uint64_t frames_not_sent = 0;  // frames that the interface refused
  std::uint64_t frames_lost = 0;      // frames that the kernel dropped because its receive buffer was full
  std::uint64_t wake_ups = 0;
  // Wake-ups that came more than one tick of the devices (tick_ns) after the event was due.
  std::uint64_t late_wake_ups = 0;
  std::int64_t latest_wake_up_ns = 0;  // largest delay of a wake-up after its event was due
};

class FarEndProcess {
 public:
  // `interface_of_bus[i]` is the index of the network's interface that carries bus i of the cell; several buses may
  // share an interface. Throws SetupError as SimulatedCell does, and if nodes or identifiers collide on one interface.
  FarEndProcess(const description::Cell& cell, const description::SensorDescription& sensor,
                const description::HandDescription& hand, fieldbus::CanNetwork& network,
                const std::vector<std::size_t>& interface_of_bus, const SimulatedCellConfig& config = {});
  FarEndProcess(const FarEndProcess&) = delete;
  FarEndProcess& operator=(const FarEndProcess&) = delete;
  ~FarEndProcess();

  // Runs until `stop` is set (noticed within 20 ms) or the network's clock reaches until_ns. May be called again.
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

// Sets the kernel's filters so that they accept the frames that the cell's devices need: NMT, SYNC, heartbeats, frames
// with a drive's node number, and the sensor's identifiers.
void set_acceptance_filters(fieldbus::SocketCanNetwork& network, const description::Cell& cell,
                            const description::SensorDescription& sensor,
                            const std::vector<std::size_t>& interface_of_bus);

// Opens the kernel's interfaces and runs until `stop`. `interfaces` has one name per bus of the cell; buses with the
// same name share one interface. Throws SetupError as FarEndProcess does, and if an interface can't be opened.
FarEndStatistics run_on_socketcan(const description::Cell& cell, const description::SensorDescription& sensor,
                                  const description::HandDescription& hand, const std::vector<std::string>& interfaces,
                                  const std::atomic<bool>& stop, const SimulatedCellConfig& config = {});

}  // namespace proxarm::sim
