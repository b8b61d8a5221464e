// Splits a text into words and numbers, with line numbers for messages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace proxarm::scenes {

// Words are separated by blanks: spaces, tabs and line ends (\n, \r\n or \r).
class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : text_(text) {}

  // Returns the next word, which may be on a later line; empty at the end of the text.
  [[nodiscard]] std::string_view word();
  // Returns the rest of this line, trimmed, and moves on to the next line.
  [[nodiscard]] std::string_view rest_of_line();
  [[nodiscard]] bool at_end() const noexcept { return at_ >= text_.size(); }
  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  [[nodiscard]] std::size_t line() const noexcept { return line_; }
  [[nodiscard]] std::string where() const { return "line " + std::to_string(line_); }

 private:
  void step() noexcept;

  std::string_view text_;
  std::size_t at_ = 0, line_ = 1;
};

// Removes the next word from `line` and returns it; empty at the end of the line.
std::string_view next_word(std::string_view& line) noexcept;

// Converts a decimal number. Throws std::runtime_error; its text begins with `where`, such as "line 12": found "1,5",
// which has a comma …
double number_of(std::string_view word, const std::string& where);

// Converts a whole number with an optional sign.
long long whole_number_of(std::string_view word, const std::string& where);

// Throws std::runtime_error for a coordinate that isn't finite.
[[noreturn]] void refuse_not_finite(const std::string& where);

// Returns the word in lower case, for formats that ignore case.
std::string lower(std::string_view word);

}  // namespace proxarm::scenes
