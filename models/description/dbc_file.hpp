// Messages and signals of a DBC file, the automotive industry's format: where each number is in a frame, and its scale.
//
// Of the format, what a sensor needs: BO_ (message), SG_ (signal), SIG_VALTYPE_ (float); other sections are skipped,
// not judged. Debian 12 packages no DBC parser for C++, and this part of the format is a flat list of words: a small
// strict reader is less than a grammar's library would bring along. Refused, with the line: anything that isn't of the
// format, a signal that doesn't fit its message, two messages or signals with one name; and files above 4 MiB, 4096
// messages, 512 signals in one. Nothing nests, so there is no depth to limit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "models/description/sensor_protocol.hpp"

namespace proxarm::description {

struct DbcSignal {
  std::string name;
  NumberField number;  // its first byte in its frame
  int length = 0;      // bits as stated; more than 32 can be read past, but not used: then number.bits is 32
  bool multiplexed = false;
  double factor = 1.0, offset = 0.0;
  std::string unit;
};

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0;
  bool extended = false;  // bit 31 in the file
  std::uint8_t bytes = 0;
  int line = 0;
  std::vector<DbcSignal> signals;

  [[nodiscard]] const DbcSignal* find(std::string_view signal) const noexcept;
};

struct DbcFile {
  std::filesystem::path file;
  std::vector<DbcMessage> messages;

  [[nodiscard]] const DbcMessage* find(std::string_view message) const noexcept;
};

// `file` is for messages. Both throw SetupError.
[[nodiscard]] DbcFile parse_dbc(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] DbcFile load_dbc(const std::filesystem::path& file);

}  // namespace proxarm::description
