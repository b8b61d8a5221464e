// The address of an entry of a CANopen object dictionary, and its text in messages to the user.
#pragma once

#include <cstdint>
#include <string>

namespace proxarm::fieldbus {

struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  friend bool operator==(const ObjectAddress&, const ObjectAddress&) = default;
};

[[nodiscard]] std::string to_string(ObjectAddress object);            // such as "60C2h:01"
[[nodiscard]] std::string hex_text(std::uint64_t value, int digits);  // such as "0x00020192"

}  // namespace proxarm::fieldbus
