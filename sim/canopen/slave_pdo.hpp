// One PDO of a simulated CANopen device (CiA 301, 7.2.2 and 7.5.2.35–38): its parameters as objects, and their rules.
//
//   receive PDO n:  parameters 1400h + n − 1, mapping 1600h + n − 1, identifier 200h, 300h, 400h, 500h + node
//   transmit PDO n: parameters 1800h + n − 1, mapping 1A00h + n − 1, identifier 180h, 280h, 380h, 480h + node
//   parameters: 1 identifier (bit 31: PDO not valid), 2 transmission type, 3 inhibit time in 100 µs,
//               5 event timer in ms
//   mapping:    0 number of objects, then index << 16 | subindex << 8 | bits each; bytes follow in that order
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// Common to both directions: parameters and mapping, as read from the dictionary.
class SlavePdo {
 public:
  enum class Direction : std::uint8_t { receive, transmit };

  // Adds the PDO's objects; `number` 1..4. At first valid only if `valid`. CAN FD: up to 64 bytes and objects, else 8.
  SlavePdo(ObjectDictionary& dictionary, Direction direction, int number, std::uint8_t node, bool valid,
           bool fd = false);
  SlavePdo(const SlavePdo&) = delete;
  SlavePdo& operator=(const SlavePdo&) = delete;

  // Mapping after a reset. Precondition: the objects exist by then.
  void set_default_mapping(std::initializer_list<std::uint32_t> objects);
  // Reads parameters and mapping from the dictionary; call after each change and after a reset.
  void configure() noexcept;

  [[nodiscard]] bool valid() const noexcept { return valid_ && count_ > 0; }
  [[nodiscard]] std::uint32_t identifier() const noexcept { return identifier_; }
  [[nodiscard]] std::uint8_t transmission_type() const noexcept { return type_; }
  [[nodiscard]] bool synchronous() const noexcept { return type_ <= 240; }
  [[nodiscard]] std::int64_t inhibit_ns() const noexcept { return inhibit_ns_; }
  [[nodiscard]] std::int64_t event_timer_ns() const noexcept { return event_timer_ns_; }
  [[nodiscard]] std::uint8_t length() const noexcept { return length_; }  // mapped bytes, 0..8, CAN FD 0..64

  // Writes the mapped objects from PDO data. Precondition: at least length() bytes.
  void unpack(std::span<const std::uint8_t> bytes);
  // Builds the PDO's data; bytes past length() stay unchanged.
  void pack(std::array<std::uint8_t, 64>& bytes) const noexcept;

 private:
  struct Mapped {
    ObjectEntry* entry = nullptr;  // null for a dummy of a receive PDO
    std::uint8_t length = 0;
  };

  [[nodiscard]] SdoAbort resolve(std::uint32_t object, Mapped& mapped) const noexcept;
  [[nodiscard]] SdoAbort check_identifier(std::int64_t value) const noexcept;
  [[nodiscard]] SdoAbort check_type(std::int64_t value) const noexcept;
  [[nodiscard]] SdoAbort check_count(std::int64_t value) const noexcept;
  [[nodiscard]] SdoAbort check_object(std::int64_t value) const noexcept;

  ObjectDictionary& dictionary_;
  Direction direction_;
  std::uint16_t parameters_;
  std::uint16_t mapping_;

  bool valid_ = false;
  std::uint32_t identifier_ = 0;
  std::uint8_t type_ = 255;
  std::int64_t inhibit_ns_ = 0;
  std::int64_t event_timer_ns_ = 0;
  std::int64_t most_;  // of objects, and of bytes
  std::array<Mapped, 64> mapped_{};
  std::uint8_t count_ = 0;
  std::uint8_t length_ = 0;
};

}  // namespace proxarm::sim
