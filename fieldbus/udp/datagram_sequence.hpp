// Judges the datagrams of a sensor before their contents are read: by their length, and by the number that rises with
// each of them.
#pragma once

#include <cstdint>
#include <span>

#include "models/base/state_archive.hpp"
#include "models/description/sensor_protocol.hpp"

namespace proxarm::fieldbus {

// Datagrams since the start.
struct DatagramCounts {
  std::uint64_t wrong_lengths = 0;
  std::uint64_t repeated = 0;      // had the number of the one before, used or refused
  std::uint64_t out_of_order = 0;  // had a number before that of the one before
  std::uint64_t lost = 0;          // numbers that were skipped; includes those that came later out of order

  bool operator==(const DatagramCounts&) const = default;
};

class DatagramSequence {
 public:
  // Precondition: `protocol.datagrams` is set.
  explicit DatagramSequence(const description::SensorProtocol& protocol) noexcept
      : bytes_(protocol.sample_bytes()), counter_(protocol.counter) {}

  // Returns whether the datagram has the right length and is newer than all before it. A number that is less than half
  // of the counter's range ahead is newer. A sensor that was restarted counts from any number, so a second datagram in
  // a row that isn't newer begins a new sequence, if it is newer than the refused one before it.
  bool accept(std::span<const std::uint8_t> datagram) noexcept;
  // Forgets the last number: the next datagram of the right length is accepted.
  void restart() noexcept { begun_ = false; }

  [[nodiscard]] const DatagramCounts& counts() const noexcept { return counts_; }
  // Sets all counts to 0.
  void forget_counts() noexcept { counts_ = {}; }
  void archive(StateArchive& state) noexcept { state(last_, refused_, begun_, went_back_, counts_); }

 private:
  [[nodiscard]] std::uint32_t number_in(std::span<const std::uint8_t> datagram) const noexcept;

  std::size_t bytes_;
  std::optional<description::NumberField> counter_;
  std::uint32_t last_ = 0, refused_ = 0;  // refused_: of the datagram before, if went_back_
  bool begun_ = false, went_back_ = false;
  DatagramCounts counts_;
};

}  // namespace proxarm::fieldbus
