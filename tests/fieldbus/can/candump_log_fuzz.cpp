// libFuzzer: any text at the reader of candump logs. It either reads a frame or throws SetupError; and what it read,
// our writer writes in a form that reads back the same.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

#include "fieldbus/can/can_timing.hpp"
#include "fieldbus/can/candump_log.hpp"
#include "models/base/setup_error.hpp"

namespace {

using namespace proxarm::fieldbus;

void require(bool condition) {
  if (!condition) std::abort();
}

void check_round_trip(const CandumpEntry& entry) {
  require(is_valid_length(entry.frame.length, entry.frame.fd));
  for (std::size_t i = entry.frame.remote ? 0 : entry.frame.length; i < entry.frame.data.size(); ++i) {
    require(entry.frame.data[i] == 0);
  }
  CandumpLine line;
  const std::size_t size = format_candump_line(line, entry.time_ns, entry.interface, entry.frame);
  require(size > 0 && size <= line.size() && line[size - 1] == '\n');
  std::istringstream stream(std::string(line.data(), size));
  CandumpLogReader reader(stream, "round trip");
  CandumpEntry again;
  require(reader.next(again));
  require(again.frame == entry.frame);
  require(again.time_ns == entry.time_ns / 1000 * 1000);
  require(!reader.next(again));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream stream(std::string(reinterpret_cast<const char*>(data), size));
  CandumpLogReader reader(stream, "fuzz.log");
  CandumpEntry entry;
  try {
    while (reader.next(entry)) check_round_trip(entry);
  } catch (const proxarm::description::SetupError& error) {
    require(error.line() > 0);
    require(std::string_view(error.what()).find('\n') == std::string_view::npos);
  }
  return 0;
}
