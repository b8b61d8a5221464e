// Small strict readers of text (numbers, UTF-8, the nearest of several words) and helpers for messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace proxarm::description {

// Length in bytes (1..4) of the well-formed UTF-8 character at the beginning of `text`; 0 if there is none.
std::size_t utf8_length(std::string_view text) noexcept;

// A decimal number, which must be all of `text`: optional sign, digits with at most one point before, among or after
// them (.5, 1.), optional exponent, no leading zeros (010). nullopt otherwise, and for numbers that don't fit a finite
// double (1e999) or underflow to zero (1e-999).
std::optional<double> strict_number(std::string_view text) noexcept;

// An integer, which must be all of `text`: decimal without leading zeros, or hexadecimal with 0x.
std::optional<std::int64_t> strict_integer(std::string_view text) noexcept;

// The candidate that `word` probably means (a typing error, or a missing unit); empty if none is near.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

// A measured or computed number for users: three significant digits. For numbers from users' input use number_text().
std::string rounded_text(double value);

// "a, b or c"
std::string one_of(std::span<const std::string> words);

}  // namespace proxarm::description
