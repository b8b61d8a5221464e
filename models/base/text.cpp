#include "models/base/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <vector>

namespace proxarm::description {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::size_t digits(std::string_view text) {
  return static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_digit) - text.begin());
}

// Returns the edit distance of two words, where transposing two neighbouring letters is one edit. The whole table is
// stored, because words are short.
std::size_t distance(std::string_view a, std::string_view b) {
  const std::size_t columns = b.size() + 1;
  std::vector<std::size_t> table((a.size() + 1) * columns);
  const auto at = [&](std::size_t i, std::size_t j) -> std::size_t& { return table[i * columns + j]; };
  for (std::size_t i = 0; i <= a.size(); ++i) at(i, 0) = i;
  for (std::size_t j = 0; j <= b.size(); ++j) at(0, j) = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      at(i, j) = std::min({at(i - 1, j) + 1, at(i, j - 1) + 1, at(i - 1, j - 1) + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
      }
    }
  }
  return at(a.size(), b.size());
}

}  // namespace

std::size_t utf8_length(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) -> unsigned { return static_cast<unsigned char>(text[i]); };
  if (text.empty()) return 0;
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  const unsigned second = byte(1);
  if (first == 0xe0 && second < 0xa0) return 0;  // an overlong encoding
  if (first == 0xed && second > 0x9f) return 0;  // a surrogate
  if (first == 0xf0 && second < 0x90) return 0;  // an overlong encoding
  if (first == 0xf4 && second > 0x8f) return 0;  // a character above U+10FFFF
  return length;
}

std::optional<double> strict_number(std::string_view text) noexcept {
  std::string_view rest = text;
  if (!rest.empty() && (rest[0] == '+' || rest[0] == '-')) rest.remove_prefix(1);
  if (text.starts_with('+')) text = rest;  // from_chars doesn't accept a plus sign
  const std::size_t whole = digits(rest);
  if (whole > 1 && rest[0] == '0') return std::nullopt;
  bool zero = whole == 0 || rest[0] == '0';
  rest.remove_prefix(whole);
  std::size_t fraction = 0;
  if (rest.starts_with('.')) {
    rest.remove_prefix(1);
    fraction = digits(rest);
    zero = zero && rest.substr(0, fraction).find_first_not_of('0') == std::string_view::npos;
    rest.remove_prefix(fraction);
  }
  if (whole + fraction == 0) return std::nullopt;
  if (rest.starts_with('e') || rest.starts_with('E')) {
    rest.remove_prefix(1);
    if (!rest.empty() && (rest[0] == '+' || rest[0] == '-')) rest.remove_prefix(1);
    const std::size_t exponent = digits(rest);
    if (exponent == 0) return std::nullopt;
    rest.remove_prefix(exponent);
  }
  if (!rest.empty()) return std::nullopt;
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  if (value == 0.0 && !zero) return std::nullopt;
  return value;
}

std::optional<std::int64_t> strict_integer(std::string_view text) noexcept {
  std::int64_t value = 0;
  int base = 10;
  std::string_view number = text;
  if (text.starts_with("0x") || text.starts_with("0X")) {
    base = 16;
    number.remove_prefix(2);
    if (number.starts_with('-')) return std::nullopt;
  } else {
    if (number.starts_with('+')) number.remove_prefix(1);
    std::string_view magnitude = number;
    if (magnitude.starts_with('-')) magnitude.remove_prefix(1);
    if (magnitude.size() > 1 && magnitude[0] == '0') return std::nullopt;
    if (text.starts_with('+') && number.starts_with('-')) return std::nullopt;
  }
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value, base);
  if (number.empty() || error != std::errc{} || end != number.data() + number.size()) return std::nullopt;
  return value;
}

std::string nearest(std::string_view word, std::span<const std::string> candidates) {
  // A longer word isn't a typing error, and the table of distance() is quadratic.
  constexpr std::size_t longest = 80;
  if (word.empty() || word.size() > longest) return {};
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (candidate.empty() || candidate.size() > longest) continue;
    std::size_t d = distance(word, candidate);
    // The unit or the frame is missing in the word or in the candidate.
    if (candidate.starts_with(std::string(word) + "_") || word.starts_with(candidate + "_")) d = 1;
    const std::size_t cut = std::min(word.find('_'), word.size());
    if (cut > 2 && candidate.substr(0, cut + 1) == word.substr(0, cut + 1)) d = std::min<std::size_t>(d, 2);
    if (d < best_distance && d < std::max(word.size(), candidate.size())) {
      best = candidate;
      best_distance = d;
    }
  }
  return best;
}

std::string rounded_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string one_of(std::span<const std::string> words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace proxarm::description
