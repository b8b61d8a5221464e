// What the CAN core costs on this machine: bits of a frame, events, a whole simulated cycle, a line of log, a plan.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fieldbus/budget/bus_budget.hpp"
#include "fieldbus/can/candump_log.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"

namespace {

using namespace proxarm::fieldbus;

CanFrame frame_of(std::uint32_t id, std::uint8_t length, bool fd = false) {
  CanFrame frame;
  frame.id = id;
  frame.fd = frame.bit_rate_switch = fd;
  frame.length = length;
  for (std::size_t i = 0; i < length; ++i) frame.data[i] = static_cast<std::uint8_t>(37 * i + id);
  return frame;
}

void wire_bits_of_a_classic_frame(benchmark::State& state) {
  CanFrame frame = frame_of(0x181, 8);
  for (auto _ : state) {
    ++frame.data[3];
    benchmark::DoNotOptimize(wire_bits(frame));
  }
}
BENCHMARK(wire_bits_of_a_classic_frame);

void wire_bits_of_a_64_byte_fd_frame(benchmark::State& state) {
  CanFrame frame = frame_of(0x181, 64, true);
  for (auto _ : state) {
    ++frame.data[3];
    benchmark::DoNotOptimize(wire_bits(frame));
  }
}
BENCHMARK(wire_bits_of_a_64_byte_fd_frame);

// 16 periodic ticks, as of as many servo loops.
void event_of_a_periodic_tick(benchmark::State& state) {
  EventQueue queue;
  struct Tick {
    EventQueue* queue;
    void operator()(std::int64_t time_ns) const { queue->schedule(time_ns + 250'000, *this); }
  };
  for (int i = 0; i < 16; ++i) queue.schedule(i * 1000, Tick{&queue});
  for (auto _ : state) queue.run_next();
}
BENCHMARK(event_of_a_periodic_tick);

struct Drive : CanListener {
  CanPort* port = nullptr;
  CanFrame answer;
  void on_frame(const CanFrame& frame, std::int64_t) noexcept override {
    if (frame.id == 0x080) port->send(answer);
  }
};

// Two buses with SYNC, three TPDOs and three RPDOs each.
void simulated_cycle_of_14_frames(benchmark::State& state) {
  SimulatedCanNetwork network({{.name = "axes_1_3"}, {.name = "axes_4_6"}});
  std::vector<Drive> drives(6);
  for (std::size_t i = 0; i < 6; ++i) {
    drives[i].answer = frame_of(0x181 + static_cast<std::uint32_t>(i), 6);
    drives[i].port = &network.simulated_bus(i / 3).attach(drives[i], std::to_string(i));
  }
  std::int64_t time_ns = 0;
  for (auto _ : state) {
    network.sleep_until(time_ns);
    TimedFrame timed;
    for (std::size_t b = 0; b < 2; ++b) network.bus(b).send(frame_of(0x080, 0));
    for (int received = 0; received < 6 && network.wait_for_frame(time_ns + 450'000);) {
      for (std::size_t b = 0; b < 2; ++b) {
        while (network.bus(b).receive(timed)) ++received;
      }
    }
    for (std::size_t i = 0; i < 6; ++i) network.bus(i / 3).send(frame_of(0x201 + static_cast<std::uint32_t>(i), 6));
    time_ns += 1'000'000;
  }
}
BENCHMARK(simulated_cycle_of_14_frames);

void line_of_candump_log(benchmark::State& state) {
  const CanFrame frame = frame_of(0x181, 8);
  CandumpLine line;
  std::int64_t time_ns = 1'700'000'000'000'000'000;
  for (auto _ : state) benchmark::DoNotOptimize(format_candump_line(line, time_ns += 1'000'000, "axes_1_3", frame));
}
BENCHMARK(line_of_candump_log);

void plan_of_a_bus_with_three_axes(benchmark::State& state) {
  PlannedBus bus{.name = "axes", .frames = {{.name = "SYNC", .id = 0x080, .sender = "controller", .sync = true}}};
  for (std::uint32_t i = 1; i <= 3; ++i) {
    const std::string drive = "drive " + std::to_string(i);
    bus.frames.push_back(
        {.name = drive + " TPDO1", .id = 0x180 + i, .shape = {.bytes = 6}, .sender = drive, .after = "SYNC"});
    bus.frames.push_back(
        {.name = drive + " RPDO1", .id = 0x200 + i, .shape = {.bytes = 6}, .sender = "controller", .release = 0.45});
  }
  for (auto _ : state) benchmark::DoNotOptimize(plan_bus(bus, 1'000'000));
}
BENCHMARK(plan_of_a_bus_with_three_axes);

}  // namespace
