// Splits a text into words and numbers, with line numbers for messages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace proxarm::scenes {

// Blanks are spaces, tabs and line ends: \n, \r\n or \r.
class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : text_(text) {}

  // The next word, also on later lines; empty at the end.
  [[nodiscard]] std::string_view word();
  // The rest of this line, trimmed; moves on to the next line.
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

// The next word of `line`, which keeps the rest; empty at its end.
std::string_view next_word(std::string_view& line) noexcept;

// A decimal number. Throws std::runtime_error that begins with `where`, such as "line 12": found "1,5", which has a
// comma …
double number_of(std::string_view word, const std::string& where);

// A whole number, optionally signed.
long long whole_number_of(std::string_view word, const std::string& where);

// Throws std::runtime_error: a coordinate that isn't finite.
[[noreturn]] void refuse_not_finite(const std::string& where);

// Lower case, for formats that ignore case.
std::string lower(std::string_view word);

}  // namespace proxarm::scenes
