// The CAN buses of a cell inside one process, in virtual time, for `proxarm run --bus sim` and for tests.
//
//   SimulatedCanNetwork network({{.name = "axes_1_3"}, {.name = "sensor"}});
//   CanPort& port = network.simulated_bus(0).attach(drive, "drive 1");   // drive.on_frame() answers with port.send()
//   network.events().schedule(0, [&] { drive.servo_tick(); });
//   network.sleep_until(1'000'000);                                      // the controller's side: events run meanwhile
//
// Time starts at 0 and advances only in wait_for_frame() and sleep_until(), which run events; the controller's
// computing takes no virtual time. Everything depends on the input alone: two runs are identical. Nothing allocates
// once each identifier has been seen and the event queue has reached its size. One thread. All nodes must be attached
// before apply() and before the first wait.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "fieldbus/can/can_network.hpp"
#include "fieldbus/simulated/event_queue.hpp"
#include "fieldbus/simulated/fault_script.hpp"
#include "fieldbus/simulated/simulated_can_bus.hpp"

namespace proxarm::fieldbus {

class SimulatedCanNetwork final : public CanNetwork {
 public:
  // Throws SetupError for an invalid bitrate or a name given twice.
  explicit SimulatedCanNetwork(const std::vector<SimulatedBusConfig>& buses);
  ~SimulatedCanNetwork() override;

  [[nodiscard]] EventQueue& events() noexcept { return events_; }
  [[nodiscard]] SimulatedCanBus& simulated_bus(std::size_t index) noexcept { return *buses_[index]; }
  // By name; throws SetupError that lists the existing names.
  [[nodiscard]] SimulatedCanBus& simulated_bus(std::string_view name);

  // Adds rules. Throws SetupError for a bus or a port that doesn't exist.
  void apply(const FaultScript& script);
  // Called for every frame of every bus at its end; must not send. Only one observer; an empty function removes it.
  void set_observer(const WireObserver& observer);
  // From now on virtual time never runs ahead of the machine's monotonic clock. If the machine is late by up to
  // longest_catch_up_ns, virtual time waits and then catches up. A longer gap, such as a suspended process, passes as
  // on a real bus: all nodes keep running, and the sleep ends late.
  void follow_real_time();
  static constexpr std::int64_t longest_catch_up_ns = 200'000'000;  // longer than a busy machine delays a process
  static constexpr std::int64_t longest_gap_ns = 1'000'000'000;     // the rest of a longer gap is skipped
  // How late the machine was at the end of the last sleep.
  [[nodiscard]] std::int64_t woken_late_ns() const noexcept { return woken_late_ns_; }

  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses_.size(); }
  [[nodiscard]] CanBus& bus(std::size_t index) noexcept override { return *buses_[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return events_.now_ns(); }
  // Also runs the events at the deadline.
  void sleep_until(std::int64_t deadline_ns) noexcept override;
  // A frame that completes exactly at the deadline is in time.
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override;
  [[nodiscard]] std::int64_t waited_ns() const noexcept override { return waited_ns_; }
  [[nodiscard]] std::int64_t behind_ns() const noexcept override;  // 0 without follow_real_time()

 private:
  void pace(std::int64_t time_ns) noexcept;
  void live_through_gap() noexcept;

  EventQueue events_;
  std::size_t frames_waiting_ = 0;
  std::int64_t waited_ns_ = 0;  // by the machine's clock
  std::vector<std::unique_ptr<SimulatedCanBus>> buses_;
  bool real_time_ = false;
  // real_time_offset_ns_ is the monotonic clock minus virtual time.
  std::int64_t real_time_offset_ns_ = 0, woken_late_ns_ = 0;
};

}  // namespace proxarm::fieldbus
