// The CAN buses of a cell inside one process, in virtual time, for `proxarm run --bus sim` and for tests.
//
//   SimulatedCanNetwork network({{.name = "axes_1_3"}, {.name = "sensor"}});
//   CanPort& port = network.simulated_bus(0).attach(drive, "drive 1");   // drive.on_frame() answers with port.send()
//   network.events().schedule(0, [&] { drive.servo_tick(); });
//   network.sleep_until(1'000'000);                                      // the controller's side: events run meanwhile
//
// Time starts at 0 and advances only in wait_for_frame() and sleep_until(), which run events. The controller's
// computing takes no virtual time. A run depends on its input alone, so two runs are identical. Memory is allocated
// only until each identifier has been seen and the event queue has reached its largest size. Only one thread may use a
// network. All nodes must be attached before apply() and before the first wait.
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
  // Returns the bus with this name. Throws SetupError that lists the existing names if there is no such bus.
  [[nodiscard]] SimulatedCanBus& simulated_bus(std::string_view name);

  // Adds the rules of a fault script. Throws SetupError if a rule names a bus or a port that doesn't exist.
  void apply(const FaultScript& script);
  // Sets a function that is called for every frame of every bus at the frame's end. The function must not send. There
  // is only one observer; an empty function removes it.
  void set_observer(const WireObserver& observer);
  // Makes virtual time follow the machine's monotonic clock, so that virtual time never runs ahead of it. If the
  // machine is late by up to longest_catch_up_ns, virtual time waits and then catches up. A larger lateness is a gap,
  // such as that of a suspended process. During a gap all nodes keep running, as on a real bus, and the controller's
  // sleep ends late.
  void follow_real_time();
  // Longer than a busy machine delays a process.
  static constexpr std::int64_t longest_catch_up_ns = 200'000'000;
  // If a gap is longer, the rest of it is skipped.
  static constexpr std::int64_t longest_gap_ns = 1'000'000'000;
  // Returns how late the machine was at the end of the last sleep.
  [[nodiscard]] std::int64_t woken_late_ns() const noexcept { return woken_late_ns_; }

  [[nodiscard]] std::size_t bus_count() const noexcept override { return buses_.size(); }
  [[nodiscard]] CanBus& bus(std::size_t index) noexcept override { return *buses_[index]; }
  [[nodiscard]] std::int64_t now_ns() const noexcept override { return events_.now_ns(); }
  // Also runs the events whose time is the deadline.
  void sleep_until(std::int64_t deadline_ns) noexcept override;
  // A frame that ends exactly at the deadline counts as received in time.
  bool wait_for_frame(std::int64_t deadline_ns) noexcept override;
  [[nodiscard]] std::int64_t waited_ns() const noexcept override { return waited_ns_; }
  [[nodiscard]] std::int64_t behind_ns() const noexcept override;  // 0 without follow_real_time()

 private:
  void pace(std::int64_t time_ns) noexcept;
  void live_through_gap() noexcept;

  EventQueue events_;
  std::size_t frames_waiting_ = 0;
  std::int64_t waited_ns_ = 0;  // measured by the machine's clock
  std::vector<std::unique_ptr<SimulatedCanBus>> buses_;
  bool real_time_ = false;
  // real_time_offset_ns_ is the machine's monotonic clock minus virtual time.
  std::int64_t real_time_offset_ns_ = 0, woken_late_ns_ = 0;
};

}  // namespace proxarm::fieldbus
