// Reads and writes frames as text in the log format of can-utils (`candump -L`), which canplayer, python-can and other
// tools also use. Each line holds one frame:
//
//   (1436509052.249713) vcan0 044#2A366C2BBA          11-bit identifier: 3 hex digits, then the data
//   (1436509052.449847) vcan0 1FFFFFFF#               29-bit identifier: 8 hex digits
//   (1436509052.649713) vcan0 123#R4                  remote frame; its length follows R if it isn't 0
//   (1436509052.849713) vcan0 213##1112233445566778   CAN FD: one digit of flags (1 bit rate switch, 2 error state)
//   (1436509052.949713) vcan0 20000040#0000000000000000   error frame: bit 29 of the identifier is set
//
// The reader also accepts nanoseconds (nine digits), lower case, dots between bytes, a raw DLC ("_9" .. "_F" after
// eight bytes), the direction that candump -x appends (R or T), blank lines, and comments (lines starting with '#').
// Any other line makes the reader throw SetupError with the line's number.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <istream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

// Room for the longest line with its newline: time 22 + 2, name 15 + 1, identifier 8, "##" and flags 3, data of 64
// bytes as 128 digits, newline 1.
inline constexpr std::size_t max_candump_line = 192;
using CandumpLine = std::array<char, max_candump_line>;

// Writes one line with its newline and returns the line's length. The name is cut at 15 characters, the kernel's limit
// for interface names, and its blanks become '_'. An empty name becomes "can". Times before 0 become 0. Allocates
// nothing; may be called from any thread.
std::size_t format_candump_line(CandumpLine& out, std::int64_t time_ns, std::string_view interface,
                                const CanFrame& frame) noexcept;

struct CandumpEntry {
  std::int64_t time_ns = 0;  // ns since the epoch, or since the zero of the log's clock
  std::string interface;
  CanFrame frame;
};

// Writes a log file. Must not be called from the cycle's thread, because flushing the buffer can block.
class CandumpLogWriter {
 public:
  // epoch_ns is added to every time; use 0 for virtual time. Throws SetupError if the file can't be created.
  explicit CandumpLogWriter(const std::string& path, std::int64_t epoch_ns = 0);
  void write(std::int64_t time_ns, std::string_view interface, const CanFrame& frame) noexcept;
  // Flushes and closes the file. Throws SetupError if any line couldn't be written. The destructor closes the file
  // without reporting errors.
  void finish();

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
  };
  std::string path_;
  std::int64_t epoch_ns_;
  std::unique_ptr<std::FILE, Close> file_;
  bool failed_ = false;
};

class CandumpLogReader {
 public:
  // `name` appears in error messages. The stream must outlive the reader.
  CandumpLogReader(std::istream& stream, std::string name);
  // Reads the next frame; false at the end of the log. Throws SetupError for an invalid line.
  bool next(CandumpEntry& out);
  [[nodiscard]] int line() const noexcept { return line_; }

 private:
  std::istream& stream_;
  std::string name_;
  std::string text_;
  int line_ = 0;
};

// Reads all frames of a file. Throws SetupError if the file can't be read or has an invalid line.
[[nodiscard]] std::vector<CandumpEntry> read_candump_log(const std::string& path);

}  // namespace proxarm::fieldbus
