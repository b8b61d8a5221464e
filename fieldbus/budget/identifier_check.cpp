#include "fieldbus/budget/identifier_check.hpp"

#include "fieldbus/canopen/canopen_object.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

void refuse_shared_identifiers(std::span<const UsedIdentifier> used, std::span<const std::string> bus_names) {
  for (std::size_t a = 0; a < used.size(); ++a) {
    for (std::size_t b = a + 1; b < used.size(); ++b) {
      if (used[a].bus != used[b].bus || used[a].id != used[b].id || used[a].owner == used[b].owner) continue;
      const std::size_t bus = used[a].bus;
      throw description::SetupError(
          {.bus = bus < bus_names.size() ? bus_names[bus] : std::to_string(bus),
           .message = "identifier " + hex_text(used[a].id, 3) + " would be used twice",
           .found = used[a].owner + " and " + used[b].owner,
           .expected = "one owner of each identifier",
           .advice =
               "give one of them other identifiers, where it lets you (a drive's node, a sensor's base_id), or each of "
               "the cell's buses an interface of its own"});
    }
  }
}

}  // namespace proxarm::fieldbus
