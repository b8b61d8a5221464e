// Reads text strictly (numbers, UTF-8, the nearest of several words), and helps to write messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace proxarm::description {

// Returns the length in bytes (1..4) of the well-formed UTF-8 character at the beginning of `text`, or 0 if there is no
// such character.
std::size_t utf8_length(std::string_view text) noexcept;

// Returns a decimal number. The whole `text` must be the number: optional sign, digits with at most one point before,
// among or after them (.5, 1.), optional exponent, no leading zeros (010). Returns nullopt for other texts, and for
// numbers that aren't finite as a double (1e999) or underflow to zero (1e-999).
std::optional<double> strict_number(std::string_view text) noexcept;

// Returns an integer, or nullopt. The whole `text` must be the integer: decimal without leading zeros, or hexadecimal
// with 0x.
std::optional<std::int64_t> strict_integer(std::string_view text) noexcept;

// Returns the candidate that the user probably meant by `word` (with a typing error, or without its unit); empty if no
// candidate is near.
std::string nearest(std::string_view word, std::span<const std::string> candidates);

// Returns a measured or computed number for users, with three significant digits. For numbers that users typed, use
// number_text().
std::string rounded_text(double value);

// Returns the words as "a, b or c".
std::string one_of(std::span<const std::string> words);

}  // namespace proxarm::description
