// Small strict readers of text that the descriptions share: numbers, UTF-8, the nearest of several words; and what
// messages are made of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace proxarm::description {

// Length in bytes (1..4) of the well-formed UTF-8 character that `text` begins with; 0 if it doesn't.
std::size_t utf8_length(std::string_view text) noexcept;

// A decimal number: optional sign, digits with at most one point before, among or after them, optional exponent; all of
// `text`. Beside the point there may be nothing (.5, 1.), but no leading zeros (010). None for anything else, and for
// what doesn't fit a finite double (1e999) or becomes zero without being it (1e-999).
std::optional<double> strict_number(std::string_view text) noexcept;

// An integer, decimal without leading zeros or hexadecimal with 0x; all of `text`.
std::optional<std::int64_t> strict_integer(std::string_view text) noexcept;

// The candidate that `word` was probably meant to be (a slip of the pen or a forgotten unit away); empty if none is
// near.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

// A measured or computed number for people: three significant digits. What somebody wrote is number_text()'s.
std::string rounded_text(double value);

// "a, b or c"
std::string one_of(std::span<const std::string> words);

}  // namespace proxarm::description
