// Reads messages and signals of a DBC file, the automotive industry's format that states the place and scale of each
// number in a frame.
//
// The reader reads BO_ (messages), SG_ (signals), SIG_VALTYPE_ (floats), and long names in BA_. It skips other sections
// unchecked. It exists because Debian 12 has no package of a DBC parser for C++; for this flat list of words, a small
// strict reader is less code than a grammar library needs. Three cases differ:
// - An error in a message or its signals (bad syntax, a signal that doesn't fit, a repeated name) is stored with its
//   line. Only users of this message get the error.
// - Bad syntax elsewhere is refused, and so are files above 4 MiB, more than 4096 messages, and more than 512 signals
//   in a message.
// - The pseudo-message in which some editors store unassigned signals is skipped. It has the identifier C0000000h or a
//   known name.
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
  // The full name, if an editor cut `name` to 32 characters; otherwise empty.
  std::string long_name;
  NumberField number;  // its bytes are counted from the start of the signal's frame
  // The number of bits that the file states. A signal of more than 32 bits can't be used; number.bits is then 32.
  int length = 0;
  bool multiplexed = false;
  double factor = 1.0, offset = 0.0;
  std::string unit;
};

struct DbcMessage {
  std::string name, long_name;
  std::uint32_t id = 0;
  bool extended = false;  // bit 31 of the identifier in the file
  std::uint8_t bytes = 0;
  int line = 0;
  std::vector<DbcSignal> signals;
  std::string mistake;  // the first error, with file and line; empty: no error

  [[nodiscard]] const DbcSignal* find(std::string_view signal) const noexcept;
};

struct DbcFile {
  std::filesystem::path file;
  std::vector<DbcMessage> messages;
  std::vector<std::string> remarks;  // the errors of messages, one per line

  [[nodiscard]] const DbcMessage* find(std::string_view message) const noexcept;
};

// Parse a DBC text, or read and parse a file. `file` appears in error messages. Both throw SetupError.
[[nodiscard]] DbcFile parse_dbc(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] DbcFile load_dbc(const std::filesystem::path& file);

}  // namespace proxarm::description
