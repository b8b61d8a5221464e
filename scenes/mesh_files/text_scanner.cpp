#include "scenes/mesh_files/text_scanner.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <stdexcept>

#include "models/base/setup_error.hpp"

namespace proxarm::scenes {
namespace {

bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f'; }

[[noreturn]] void refuse(std::string_view word, const std::string& where, const char* expected) {
  if (word.empty()) throw std::runtime_error(where + ": it ends where " + expected + " was expected");
  const char* comma = word.find(',') != std::string_view::npos ? " without a comma (1.5, not 1,5)" : "";
  throw std::runtime_error(where + ": " + description::in_quotes(std::string(word)) + " where " + expected + comma +
                           " was expected");
}

}  // namespace

void TextScanner::step() noexcept {
  const char c = text_[at_++];
  // \r\n counts as one line end, at its \n.
  if (c == '\n' || (c == '\r' && (at_ >= text_.size() || text_[at_] != '\n'))) ++line_;
}

std::string_view TextScanner::word() {
  while (!at_end() && is_blank(text_[at_])) step();
  const std::size_t begin = at_;
  while (!at_end() && !is_blank(text_[at_])) ++at_;
  return text_.substr(begin, at_ - begin);
}

std::string_view TextScanner::rest_of_line() {
  std::size_t begin = at_;
  while (!at_end() && text_[at_] != '\n' && text_[at_] != '\r') ++at_;
  std::size_t end = at_;
  if (!at_end()) {
    const bool both = text_[at_] == '\r' && at_ + 1 < text_.size() && text_[at_ + 1] == '\n';
    step();
    if (both) step();
  }
  while (begin < end && is_blank(text_[begin])) ++begin;
  while (end > begin && is_blank(text_[end - 1])) --end;
  return text_.substr(begin, end - begin);
}

std::string_view next_word(std::string_view& line) noexcept {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

double number_of(std::string_view word, const std::string& where) {
  std::string_view digits = word;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range && end == digits.data() + digits.size()) {
    // 0 if the number is too small, infinity if it is too large
    return std::strtod(std::string(digits).c_str(), nullptr);
  }
  if (error != std::errc() || end != digits.data() + digits.size()) refuse(word, where, "a number");
  return value;
}

long long whole_number_of(std::string_view word, const std::string& where) {
  std::string_view digits = word;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  long long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  // The number is larger than any file: the caller reports why it is invalid.
  if (error == std::errc::result_out_of_range && end == digits.data() + digits.size()) {
    return digits.starts_with('-') ? std::numeric_limits<long long>::min() : std::numeric_limits<long long>::max();
  }
  if (error != std::errc() || end != digits.data() + digits.size()) refuse(word, where, "a whole number");
  return value;
}

void refuse_not_finite(const std::string& where) {
  throw std::runtime_error(where + ": a coordinate that isn't finite");
}

std::string lower(std::string_view word) {
  std::string text(word);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace proxarm::scenes
