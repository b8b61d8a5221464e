#include "sim/devices/eds_objects.hpp"

#include <algorithm>

namespace proxarm::sim {

namespace {

using description::EdsFile;
using description::EdsObject;

// Objects whose values aren't taken from the file: the identity (the caller takes it from [DeviceInfo]), errors,
// measured values, and properties of the axis.
constexpr std::uint16_t own_values[] = {0x1000, 0x1001, 0x1003, 0x1018, 0x603F, 0x6041, 0x6061, 0x6062,
                                        0x6064, 0x606C, 0x6076, 0x6077, 0x607D, 0x60F4, 0x60FD};
constexpr std::uint16_t supported_modes = 0x6502;

std::optional<std::uint32_t> default_of(const EdsObject& object, std::uint8_t node) noexcept {
  if (object.default_offset) return *object.default_offset + node;
  return object.default_value;
}

Access access_of(const EdsObject& object) noexcept {
  if (!object.writable) return Access::read_only;
  return object.readable ? Access::read_write : Access::write_only;
}

// Changes the entry's type and length; the number that it holds stays the same.
void change_type(ObjectEntry& entry, DataType type) {
  if (type == entry.type || size_of(type) == 0 || size_of(entry.type) == 0) return;
  const std::int64_t number = entry.number();
  entry.type = type;
  entry.value.assign(size_of(type), 0);
  entry.set(number);
  entry.default_value = entry.value;
}

void take_over(const EdsObject& object, std::uint8_t node, ObjectEntry& entry) {
  entry.hidden = false;
  change_type(entry, static_cast<DataType>(object.type));
  entry.access = access_of(object);
  entry.pdo_mappable = object.mappable;
  const bool profile_or_maker = entry.index >= 0x2000;
  if (profile_or_maker && object.low) entry.minimum = object.low;
  if (profile_or_maker && object.high) entry.maximum = object.high;
  if (std::find(std::begin(own_values), std::end(own_values), entry.index) != std::end(own_values)) return;
  if (size_of(entry.type) == 0) {
    entry.value.assign(object.default_text.begin(), object.default_text.end());
  } else if (const auto value = default_of(object, node); value && !(entry.index == supported_modes && *value == 0)) {
    entry.set(static_cast<std::int32_t>(*value));
  }
  entry.default_value = entry.value;
}

}  // namespace

void take_over(const EdsFile& eds, std::uint8_t node, ObjectDictionary& dictionary) {
  for (auto& [key, entry] : dictionary.entries()) entry.hidden = true;
  for (const auto& [address, object] : eds.objects) {
    if (!object.mistake.empty()) continue;
    const auto index = static_cast<std::uint16_t>(address >> 8);
    const auto subindex = static_cast<std::uint8_t>(address);
    ObjectEntry* entry = dictionary.find(index, subindex);
    if (entry == nullptr && object.bits > 0) {
      entry = &dictionary.add(index, subindex, static_cast<DataType>(object.type), Access::read_write, 0);
    } else if (entry == nullptr) {
      entry = &dictionary.add_text(index, subindex, "");
    }
    take_over(object, node, *entry);
  }
}

}  // namespace proxarm::sim
