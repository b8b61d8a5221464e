#include "fieldbus/canopen/canopen_pdo.hpp"

#include <stdexcept>

namespace proxarm::fieldbus {
namespace {

constexpr std::uint32_t does_not_exist = 1U << 31;
constexpr std::uint32_t no_remote_request = 1U << 30;

std::uint16_t communication_index(PdoDirection direction, std::uint8_t number) noexcept {
  return static_cast<std::uint16_t>((direction == PdoDirection::receive ? 0x1400 : 0x1800) + number - 1);
}

std::uint16_t mapping_index(PdoDirection direction, std::uint8_t number) noexcept {
  return static_cast<std::uint16_t>((direction == PdoDirection::receive ? 0x1600 : 0x1A00) + number - 1);
}

// Returns the step that writes the PDO's COB-ID. Bit 30 isn't compared when the COB-ID is read back: some drives always
// report it as 1, others as 0.
SdoStep cob_id_step(PdoDirection direction, std::uint8_t number, std::uint32_t cob_id, const char* name) {
  if (direction == PdoDirection::transmit) cob_id |= no_remote_request;
  SdoStep step = sdo_write({communication_index(direction, number), 1}, 4, cob_id, name);
  step.mask = ~no_remote_request;
  return step;
}

void check(const PdoConfiguration& pdo) {
  unsigned bits = 0;
  for (const MappedObject& mapped : pdo.mapping) bits += mapped.bits;
  if (pdo.number < 1 || pdo.number > 4) throw std::invalid_argument("PDO number must be 1..4");
  if (pdo.id > 0x7FF || is_restricted_id(pdo.id)) throw std::invalid_argument("PDO identifier is restricted");
  const unsigned most_bits = pdo.fd ? 512 : 64, most_objects = pdo.fd ? 64 : 8;
  if (pdo.mapping.empty() || pdo.mapping.size() > most_objects || bits > most_bits) {
    throw std::invalid_argument("PDO mapping too long");
  }
}

}  // namespace

std::uint32_t pdo_id(PdoDirection direction, std::uint8_t number, std::uint8_t node) noexcept {
  return (direction == PdoDirection::receive ? 0x200U : 0x180U) + 0x100U * (number - 1U) + node;
}

bool is_restricted_id(std::uint32_t id) noexcept {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) || (id >= 0x601 && id <= 0x67F) ||
         (id >= 0x6E0 && id <= 0x6FF) || (id >= 0x701 && id <= 0x7FF) || id == 0x080;
}

std::uint32_t mapping_entry(const MappedObject& mapped) noexcept {
  return static_cast<std::uint32_t>(mapped.object.index) << 16 | static_cast<std::uint32_t>(mapped.object.sub) << 8 |
         mapped.bits;
}

// If the drive's mapping is fixed, it is accepted if it equals the wanted mapping; a transmit PDO may carry further
// objects after the wanted ones. If the transmission type of a receive PDO is fixed, these types are accepted too: 0
// (synchronous, acyclic), which acts at the same SYNC as type 1, and 254 and 255 (asynchronous), which act on
// reception.
std::vector<SdoStep> pdo_steps(const PdoConfiguration& pdo) {
  check(pdo);
  const bool receive = pdo.direction == PdoDirection::receive;
  const std::uint16_t communication = communication_index(pdo.direction, pdo.number);
  const std::uint16_t mapping = mapping_index(pdo.direction, pdo.number);
  const auto objects = static_cast<std::uint8_t>(pdo.mapping.size());
  std::vector<std::uint32_t> counts{objects};
  for (std::uint32_t more = objects + 1U; !receive && more <= 8; ++more) counts.push_back(more);
  std::vector<SdoStep> steps;
  steps.push_back(or_found(cob_id_step(pdo.direction, pdo.number, does_not_exist | pdo.id,
                                       receive ? "RPDO COB-ID (disable)" : "TPDO COB-ID (disable)"),
                           {pdo.id}));
  steps.push_back(
      or_found(sdo_write({mapping, 0}, 1, 0, receive ? "RPDO mapping (clear)" : "TPDO mapping (clear)"), counts));
  std::uint8_t sub = 0;
  for (const MappedObject& mapped : pdo.mapping) {
    const std::uint32_t entry = mapping_entry(mapped);
    steps.push_back(
        or_found(sdo_write({mapping, ++sub}, 4, entry, receive ? "RPDO mapping" : "TPDO mapping"), {entry}));
  }
  steps.push_back(
      or_found(sdo_write({mapping, 0}, 1, sub, receive ? "RPDO mapping (objects)" : "TPDO mapping (objects)"), counts));
  SdoStep type = sdo_write({communication, 2}, 1, pdo.transmission_type,
                           receive ? "RPDO transmission type" : "TPDO transmission type");
  type.as_found = {pdo.transmission_type};
  if (receive) {
    type.as_found.insert(type.as_found.end(), {0, 254, 255});
    type.lost = "where this is 254 or 255, what it is sent acts as soon as it comes, and not at SYNC";
  }
  steps.push_back(type);
  if (pdo.event_timer_ms > 0) {
    steps.push_back(if_present(sdo_write({communication, 5}, 2, pdo.event_timer_ms,
                                         receive ? "RPDO event timer (timeout)" : "TPDO event timer"),
                               "its RPDO timer doesn't stop it when the setpoints end; what else it watches does"));
  }
  steps.push_back(or_found(
      cob_id_step(pdo.direction, pdo.number, pdo.id, receive ? "RPDO COB-ID (enable)" : "TPDO COB-ID (enable)"),
      {pdo.id}));
  return steps;
}

SdoStep disable_pdo_step(PdoDirection direction, std::uint8_t number, std::uint8_t node) {
  SdoStep step =
      if_present(cob_id_step(direction, number, does_not_exist | pdo_id(direction, number, node),
                             direction == PdoDirection::receive ? "unused RPDO COB-ID" : "unused TPDO COB-ID"));
  step.mask = does_not_exist;  // only bit 31 is compared: an unused PDO may keep any identifier
  // A receive PDO that can't be disabled is harmless, because only the controller could send it, and doesn't.
  if (direction == PdoDirection::transmit) step.as_found = {step.value};
  return step;
}

}  // namespace proxarm::fieldbus
