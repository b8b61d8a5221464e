#include "fieldbus/canopen/canopen_object.hpp"

#include <cstdio>

namespace proxarm::fieldbus {

std::string hex_text(std::uint64_t value, int digits) {
  char buffer[24];
  std::snprintf(buffer, sizeof buffer, "0x%0*llX", digits, static_cast<unsigned long long>(value));
  return buffer;
}

std::string to_string(ObjectAddress object) {
  char buffer[16];
  std::snprintf(buffer, sizeof buffer, "%04Xh:%02X", unsigned{object.index}, unsigned{object.sub});
  return buffer;
}

}  // namespace proxarm::fieldbus
