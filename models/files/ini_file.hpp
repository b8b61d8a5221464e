// Reads INI text as makers write it in EDS and DCF files: sections and keys, in upper or lower case, each with its
// line. An invalid line doesn't make the other lines unreadable.
//
// This reader exists because Boost's reader would refuse the whole file for one line without '=' or one repeated key,
// and doesn't store line numbers. Skipped are a byte order mark, lines that begin with ';' or '#', and text after a ';'
// that follows a number. Mistakes are reported only to code that asks for the key or the section.
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
  // Throws SetupError if the text has more than 4 MB, is in UTF-16, or has a value before the first section.
  IniFile(std::string_view text, const std::filesystem::path& file);

  struct Section {
    int line = 0;
    std::map<std::string, std::string> values;  // by key, in lower case
    std::map<std::string, int> lines;
    // The first unreadable line, or the first key repeated with another value; empty: no mistake.
    std::string mistake;
    int mistake_line = 0;
  };

  // Returns the sections by name, in lower case. A repeated section adds to the first section of this name.
  [[nodiscard]] const std::map<std::string, Section>& sections() const noexcept { return sections_; }
  // Returns the text of a value, or "" if the value is missing.
  [[nodiscard]] std::string text(const std::string& section, const std::string& key) const;
  // Returns a number, or nullopt if the value is missing, empty or relative to $NODEID. Numbers are written as in C:
  // decimal, hexadecimal with 0x, octal with 0.
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
