#include "fieldbus/force_sensor.hpp"

#include "models/description/setup_error.hpp"

namespace proxarm::fieldbus {

using description::SetupError;

void ForceSensor::tare(CanNetwork& network, std::size_t bus, std::size_t samples, std::int64_t period_ns,
                       const Wrench& known_wrench_S, const FrameHandler& other) {
  constexpr int missing_allowed = 20;  // polls in a row without a sample: a frame may be lost, a cable isn't
  begin_tare(samples, known_wrench_S);
  const std::string name = network.bus(bus).name();
  const FrameHandler handler = [&](std::size_t from, const TimedFrame& received) {
    const bool ours = from == bus && on_frame(received.frame, received.time_ns);
    if (!ours && other) other(from, received);
  };
  int missing = 0;
  std::int64_t next_ns = network.now_ns();
  while (taring()) {
    CanFrame request;
    if (poll(network.now_ns(), request)) (void)network.bus(bus).send(request);
    next_ns += period_ns;
    pump_frames(network, next_ns, handler, [&](std::int64_t) { return next_ns; });
    missing = fresh() ? 0 : missing + 1;
    if (missing > missing_allowed) {
      throw SetupError({.bus = name,
                        .message = "force sensor: silent while it was tared",
                        .found = std::to_string(missing) + " polls without a sample",
                        .expected = "a sample per poll",
                        .advice = "check the sensor's cable and supply, and whether the bus carries this period"});
    }
    if (fresh() && !latest().healthy) {
      throw SetupError({.bus = name,
                        .message = "force sensor: error while it was tared",
                        .found = describe_status(latest().status),
                        .expected = "no error"});
    }
    if (fresh() && latest().saturated) {
      throw SetupError(
          {.bus = name,
           .message = "force sensor: overloaded while it was tared",
           .found = "a strain gauge at its rail",
           .expected = "readings within range",
           .advice = "let go of the handle; if it stays, the sensor may be damaged or the tool too heavy"});
    }
  }
}

std::string losses_text(std::initializer_list<LossCount> losses) {
  std::string text;
  for (const LossCount& loss : losses) {
    if (loss.count > 0) text += (text.empty() ? "" : ", ") + std::to_string(loss.count) + " " + loss.what;
  }
  return text;
}

}  // namespace proxarm::fieldbus
