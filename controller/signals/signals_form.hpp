// How a record keeps its tables.
#pragma once

#include <cstdint>

namespace proxarm::controller {

// Signals and contacts: as text; as numbers; as numbers that are packed, and frames.log with them.
enum class SignalsForm : std::uint8_t { csv, binary, packed };

}  // namespace proxarm::controller
