// libFuzzer: whatever bytes a file holds, reading it as a cell, a sensor, a hand, a number or a duration gives a value
// or a SetupError of one line. The first byte chooses which.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "models/base/quantity.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/modbus_drive.hpp"
#include "models/description/sensor.hpp"
#include "models/files/yaml_file.hpp"

namespace description = proxarm::description;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto parse = [&] { return description::YamlNode::parse(text, "fuzz.yaml"); };
  try {
    switch (data[0] % 8 == 4 ? 4 : data[0] % 4) {
      case 0:
        (void)description::read_cell(parse());
        break;
      case 1:
        (void)description::read_sensor(parse());
        break;
      case 2:
        (void)description::read_hand(parse());
        break;
      case 4:
        (void)description::read_modbus_drive(parse());
        break;
      default:
        (void)description::parse_duration(text);
        break;
    }
  } catch (const description::SetupError& error) {
    if (std::string_view(error.what()).find_first_of("\n\r\x1b") != std::string_view::npos) std::abort();
  }
  return 0;
}
