// The file format of a record's tables.
#pragma once

#include <cstdint>

namespace proxarm::controller {

// Signals and contacts are written as text, as numbers, or as packed numbers. `packed` also applies to frames.log.
enum class SignalsForm : std::uint8_t { csv, binary, packed };

}  // namespace proxarm::controller
