// Messages and signals of a DBC file, the automotive industry's format: where each number is in a frame, and its scale.
//
// Of the format, what a sensor needs: BO_ (message), SG_ (signal), SIG_VALTYPE_ (float); other sections are skipped,
// not judged. Debian 12 packages no DBC parser for C++, and this part of the format is a flat list of words: a small
// strict reader is less than a grammar's library would bring along. What isn't of the format in a message or its
// signals, a signal that doesn't fit its message, two messages or signals with one name: that message's mistake, with
// the line, for whoever names it; the others can be used. Refused: a text that isn't of the format elsewhere, and files
// above 4 MiB, 4096 messages, 512 signals in one. Nothing nests, so there is no depth to limit. The message that some
// editors keep signals of no message in (identifier C0000000h, or by its name) is passed over.
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
  std::string long_name;  // that an editor cut to 32 characters; else empty
  NumberField number;     // its first byte in its frame
  int length = 0;         // bits as stated; more than 32 can be read past, but not used: then number.bits is 32
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
  std::string mistake;  // the first, with file and line; else empty

  [[nodiscard]] const DbcSignal* find(std::string_view signal) const noexcept;
};

struct DbcFile {
  std::filesystem::path file;
  std::vector<DbcMessage> messages;
  std::vector<std::string> remarks;  // mistakes of messages, a line each

  [[nodiscard]] const DbcMessage* find(std::string_view message) const noexcept;
};

// `file` is for messages. Both throw SetupError.
[[nodiscard]] DbcFile parse_dbc(std::string_view text, const std::filesystem::path& file);
[[nodiscard]] DbcFile load_dbc(const std::filesystem::path& file);

}  // namespace proxarm::description
