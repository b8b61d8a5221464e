// libFuzzer: whatever bytes a DBC file holds, reading it gives messages whose signals lie within them, or a SetupError
// of one line.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "models/base/setup_error.hpp"
#include "models/description/dbc_file.hpp"

namespace description = proxarm::description;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto dbc = description::parse_dbc({reinterpret_cast<const char*>(data), size}, "fuzz.dbc");
    for (const auto& message : dbc.messages) {
      for (const auto& signal : message.signals) {
        if (signal.number.byte + signal.number.bytes() > message.bytes) std::abort();
        if (signal.number.shift < 0 || signal.number.shift > 7) std::abort();
      }
    }
  } catch (const description::SetupError& error) {
    if (std::string_view(error.what()).find_first_of("\n\r\x1b") != std::string_view::npos) std::abort();
  }
  return 0;
}
