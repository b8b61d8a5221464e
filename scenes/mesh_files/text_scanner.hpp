// Words and numbers of a text, with the line that they are in.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace proxarm::scenes {

// Blanks are spaces, tabs and the ends of lines, which may be \n, \r\n or \r.
class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : text_(text) {}

  // The next word, over ends of lines; empty at the end.
  [[nodiscard]] std::string_view word();
  // The rest of this line without blanks at its ends, and past its end.
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

// The next word of a line; empty at its end. What is behind it stays in `line`.
std::string_view next_word(std::string_view& line) noexcept;

// A decimal number. Throws std::runtime_error with `where`, such as "line 12": found "1,5", which has a comma …
double number_of(std::string_view word, const std::string& where);

// A whole number, with a sign or without.
long long whole_number_of(std::string_view word, const std::string& where);

// Throws std::runtime_error: a coordinate that isn't finite.
[[noreturn]] void refuse_not_finite(const std::string& where);

// Lower case, for words of formats that don't tell cases apart.
std::string lower(std::string_view word);

}  // namespace proxarm::scenes
