// An INI text as EDS and DCF files are in fact written: sections and keys in any case, with the line of each, and kept
// readable where a line is none of the format's.
//
// Not Boost's reader, which refuses the whole file for one free line under [Comments] or one key that comes twice, and
// keeps no lines. A byte order mark is skipped; a line that begins with ';' or '#' is a comment, and so is what follows
// a
// ';' behind a number. Nothing is said of a file as such: whoever asks for a key or a section is told what is wrong
// with it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "models/base/setup_error.hpp"

namespace proxarm::description {

class IniFile {
 public:
  // Throws SetupError for more than 4 MB, and for a text without any section.
  IniFile(std::string_view text, const std::filesystem::path& file);

  struct Section {
    int line = 0;
    std::map<std::string, std::string> values;  // by key; all in lower case
    std::map<std::string, int> lines;
    std::string mistake;  // of the first line that can't be read, or a key that comes twice and differs; else empty
    int mistake_line = 0;
  };

  // By name, in lower case. One that comes twice is one.
  [[nodiscard]] const std::map<std::string, Section>& sections() const noexcept { return sections_; }
  // "" if it isn't there.
  [[nodiscard]] std::string text(const std::string& section, const std::string& key) const;
  // nullopt if the value is missing, empty or relative to $NODEID. As in C: decimal, hexadecimal with 0x, octal with 0.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& section, const std::string& key, std::int64_t low,
                                                   std::int64_t high) const;
  [[nodiscard]] SetupError error(const std::string& section, const std::string& key, std::string found,
                                 std::string expected) const;
  [[nodiscard]] int line_of(const std::string& section) const;

 private:
  std::filesystem::path file_;
  std::map<std::string, Section> sections_;
};

}  // namespace proxarm::description
