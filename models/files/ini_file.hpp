// Reads INI text as makers write EDS and DCF files: sections and keys in any case, each with its line. Invalid lines
// don't make the rest unreadable.
//
// Boost's reader would refuse the whole file for one free line or one repeated key, and keeps no lines. Skipped are a
// byte order mark, lines that begin with ';' or '#', and text from a ';' behind a number. Mistakes are reported only to
// code that asks for the key or the section.
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
  // Throws SetupError for text of more than 4 MB, in UTF-16, or with a value before the first section.
  IniFile(std::string_view text, const std::filesystem::path& file);

  struct Section {
    int line = 0;
    std::map<std::string, std::string> values;  // by key, in lower case
    std::map<std::string, int> lines;
    std::string mistake;  // the first unreadable line, or the first key repeated with another value; empty: none
    int mistake_line = 0;
  };

  // By name, in lower case. A repeated section continues the first.
  [[nodiscard]] const std::map<std::string, Section>& sections() const noexcept { return sections_; }
  // "" if missing.
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
