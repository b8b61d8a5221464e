// A force sensor on UDP that is known only by its description file, such as an ATI Net F/T with its Raw Data Transfer
// (RDT). Start and stop are datagrams with the file's bytes; each datagram of the sensor is one sample. A sample is
// decoded like that of a described sensor on CAN (described_sensor.hpp).
//
//   session                                         sensor
//     12 34 00 00 00 00 00 00  (stop)        ──▶
//     12 34 00 02 00 00 00 00  (start, RDT)  ──▶
//                                            ◀──    36 bytes, rate_Hz times a second
//     12 34 00 00 00 00 00 00  (stop)        ──▶    at the end
//
// The cycle thread reads the port without waiting, once at the beginning of each cycle. The newest datagram of the
// right length becomes the cycle's sample. Older ones, and those out of order or repeated, are counted and dropped. A
// reading is up to one period of the stream old when the cycle begins, which the stability check counts.
#pragma once

#include <memory>

#include "fieldbus/sensors/described_sensor.hpp"
#include "fieldbus/udp/datagram_port.hpp"
#include "fieldbus/udp/datagram_sequence.hpp"

namespace proxarm::fieldbus {

struct DatagramSensorSettings {
  std::string peer;  // the sensor's address, for messages
  // As for a described sensor on CAN: ten attempts of 0.1 s, so a booting sensor has a second.
  std::int64_t answer_timeout_ns = 100'000'000;
  int attempts = 10;
  std::int64_t pause_ns = 2'000'000;  // pause after the stop datagram, in which datagrams on their way arrive
  // Datagrams that arrived longer than this before the cycle count as never come: after a pause of this process, the
  // kernel has the oldest ones in its queue.
  std::int64_t oldest_ns = 20'000'000;
};

class DatagramSensor final : public ForceSensor {
 public:
  // A port with more datagrams than this in one cycle is flooded: no datagram of it is used in this cycle, because it
  // isn't known whether a newer one waits. The fastest stream that a file can have sends 20 in a millisecond.
  static constexpr int flood = 512;

  // Throws SetupError if the file doesn't describe datagrams. Precondition: `port` isn't null.
  DatagramSensor(const description::SensorDescription& sensor, std::unique_ptr<DatagramPort> port,
                 DatagramSensorSettings settings);
  // Stops the stream, if start() began one.
  ~DatagramSensor() override;

  // ---- before the cycle ----
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override { return {}; }
  void start(CanNetwork& network, std::size_t bus, const FrameHandler& other = {}) override;
  [[nodiscard]] std::string identity() const override;

  // ---- cycle thread ----
  bool poll(std::int64_t now_ns, CanFrame& frame) noexcept override;
  bool on_frame(const CanFrame&, std::int64_t) noexcept override { return false; }
  [[nodiscard]] bool fresh() const noexcept override { return decoder_.fresh(); }
  // The port is read once a cycle, so waiting is of no use.
  [[nodiscard]] bool answered() const noexcept override { return true; }
  [[nodiscard]] const ForceSample& latest() const noexcept override { return decoder_.latest(); }
  void archive(StateArchive& state) noexcept override { state(decoder_, sequence_); }
  void archive_input(StateArchive& state) noexcept override;

  // ---- as text ----
  [[nodiscard]] std::string describe_status(std::uint32_t status) const override {
    return decoder_.describe_status(status);
  }
  [[nodiscard]] std::string describe_losses() const override;
  [[nodiscard]] const DatagramCounts& counts() const noexcept { return sequence_.counts(); }

 private:
  void empty_port(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool await_sample(CanNetwork& network);
  [[noreturn]] void refuse_start() const;
  [[nodiscard]] bool take_newest(std::int64_t now_ns) noexcept;

  description::SensorProtocol protocol_;
  std::string name_;
  DatagramSensorSettings settings_;
  std::unique_ptr<DatagramPort> port_;
  DescribedSensor decoder_;
  DatagramSequence sequence_;
  Datagram read_, newest_;
  bool started_ = false;
  bool took_ = false;      // newest_ came in this cycle
  bool restored_ = false;  // newest_ was read from an archive, for the next poll()
  std::uint64_t floods_ = 0;
  std::uint64_t bad_checksums_before_ = 0;  // those until the end of start()
};

}  // namespace proxarm::fieldbus
