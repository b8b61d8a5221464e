// One PDO of a simulated CANopen device (CiA 301, 7.2.2 and 7.5.2.35–38): its parameters as objects, and the rules for
// them.
//
//   receive PDO n:  parameters 1400h + n − 1, mapping 1600h + n − 1, identifier 200h, 300h, 400h, 500h + node
//   transmit PDO n: parameters 1800h + n − 1, mapping 1A00h + n − 1, identifier 180h, 280h, 380h, 480h + node
//   parameters:     subindex 1   identifier (bit 31: the PDO isn't valid)
//                   subindex 2   transmission type
//                   subindex 3   inhibit time in 100 µs
//                   subindex 5   event timer in ms
//   mapping:        subindex 0   number of objects
//                   subindex 1.. index << 16 | subindex << 8 | bits, in the order of the bytes in the PDO
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// What receive and transmit PDOs have in common: parameters and mapping, as read from the dictionary.
class SlavePdo {
 public:
  enum class Direction : std::uint8_t { receive, transmit };

  // Adds the PDO's objects to the dictionary. `valid` says whether the PDO is valid at first. A PDO has up to 64 bytes
  // and objects with CAN FD, else up to 8. Precondition: `number` is 1..4.
  SlavePdo(ObjectDictionary& dictionary, Direction direction, int number, std::uint8_t node, bool valid,
           bool fd = false);
  SlavePdo(const SlavePdo&) = delete;
  SlavePdo& operator=(const SlavePdo&) = delete;

  // Sets the mapping that the PDO has after a reset. Precondition: the mapped objects exist when the reset comes.
  void set_default_mapping(std::initializer_list<std::uint32_t> objects);
  // Reads parameters and mapping from the dictionary. Must be called after each change of them and after a reset.
  void configure() noexcept;

  [[nodiscard]] bool valid() const noexcept { return valid_ && count_ > 0; }
  [[nodiscard]] std::uint32_t identifier() const noexcept { return identifier_; }
  [[nodiscard]] std::uint8_t transmission_type() const noexcept { return type_; }
  [[nodiscard]] bool synchronous() const noexcept { return type_ <= 240; }
  [[nodiscard]] std::int64_t inhibit_ns() const noexcept { return inhibit_ns_; }
  [[nodiscard]] std::int64_t event_timer_ns() const noexcept { return event_timer_ns_; }
  // Number of mapped bytes, 0..8, with CAN FD 0..64.
  [[nodiscard]] std::uint8_t length() const noexcept { return length_; }

  // Writes the PDO's data to the mapped objects. Precondition: `bytes` has at least length() bytes.
  void unpack(std::span<const std::uint8_t> bytes);
  // Writes the mapped objects to the PDO's data. Bytes past length() stay unchanged.
  void pack(std::array<std::uint8_t, 64>& bytes) const noexcept;

 private:
  struct Mapped {
    ObjectEntry* entry = nullptr;  // nullptr for a dummy entry of a receive PDO
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
  std::int64_t most_;  // maximum number of mapped objects, and of mapped bytes
  std::array<Mapped, 64> mapped_{};
  std::uint8_t count_ = 0;
  std::uint8_t length_ = 0;
};

}  // namespace proxarm::sim
