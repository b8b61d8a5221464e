// Reads messages and signals of a DBC file, the automotive industry's format: the place and scale of each number in a
// frame.
//
// Reads BO_ (message), SG_ (signal), SIG_VALTYPE_ (float) and long names in BA_; skips other sections unchecked. Debian
// 12 packages no DBC parser for C++, and for this flat list of words a small strict reader is less code than a grammar
// library. An error in a message or its signals (bad syntax, a signal that doesn't fit, a repeated name) is noted with
// its line and reported only to users of that message. Refused: bad syntax elsewhere, and files above 4 MiB, 4096
// messages, or 512 signals in a message. Skipped: the pseudo-message (identifier C0000000h, or by its name) in which
// some editors keep unassigned signals.
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
  std::string long_name;  // the full name if an editor cut it to 32 characters; otherwise empty
  NumberField number;     // bytes relative to its frame
  int length = 0;         // bits as stated; a signal of more than 32 can't be used, and number.bits is then 32
  bool multiplexed = false;
  double factor = 1.0, offset = 0.0;
  std::string unit;
};

struct DbcMessage {
  std::string name, long_name;
  std::uint32_t id = 0;
  bool extended = false;  // bit 31 in the file
  std::uint8_t bytes = 0;
  int line = 0;
  std::vector<DbcSignal> signals;
  std::string mistake;  // the first error, with file and line; empty: none

  [[nodiscard]] const DbcSignal* find(std::string_view signal) const noexcept;
};

struct DbcFile {
  std::filesystem::path file;
  std::vector<DbcMessage> messages;
  std::vector<std::string> remarks;  // errors of messages, one per line

  [[nodiscard]] const DbcMessage* find(std::string_view message) const noexcept;
};

// `file` is for error messages. Both throw SetupError.
[[nodiscard]] DbcFile parse_dbc(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] DbcFile load_dbc(const std::filesystem::path& file);

}  // namespace proxarm::description
