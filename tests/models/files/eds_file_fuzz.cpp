// libFuzzer: whatever bytes an EDS file holds, reading it gives objects whose values fit their types, or a SetupError
// of one line.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "models/base/setup_error.hpp"
#include "models/files/eds_file.hpp"

namespace description = proxarm::description;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto eds = description::parse_eds({reinterpret_cast<const char*>(data), size}, "fuzz.eds");
    for (const auto& [address, object] : eds.objects) {
      if (address > 0xFFFFFF || object.bits < 0 || object.bits > 64) std::abort();
      for (const auto& value : {object.default_value, object.value}) {
        if (value && (object.bits == 0 || object.bits > 32 || std::uint64_t{*value} >> object.bits != 0)) std::abort();
      }
    }
  } catch (const description::SetupError& error) {
    if (std::string_view(error.what()).find_first_of("\n\r\x1b") != std::string_view::npos) std::abort();
  }
  return 0;
}
