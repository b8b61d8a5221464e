// Helpers for validate() functions: they turn a value outside its range into a SetupError with the option's name, the
// value found and the expected range.
#pragma once

#include <cmath>

#include "models/base/setup_error.hpp"

namespace proxarm::controller {

inline bool is_positive(double value) noexcept { return std::isfinite(value) && value > 0.0; }
inline bool is_not_negative(double value) noexcept { return std::isfinite(value) && value >= 0.0; }

inline void require_option(bool holds, const char* option, double found, const char* expected) {
  if (!holds) {
    throw description::SetupError({.key = option, .found = description::number_text(found), .expected = expected});
  }
}

}  // namespace proxarm::controller
