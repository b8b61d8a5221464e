#include "sim/canopen/object_dictionary.hpp"

#include <algorithm>
#include <cassert>

namespace proxarm::sim {

namespace {

constexpr std::uint32_t key_of(std::uint16_t index, std::uint8_t subindex) noexcept {
  return static_cast<std::uint32_t>(index) << 8 | subindex;
}

bool is_signed(DataType type) noexcept {
  const auto number = static_cast<std::uint16_t>(type);
  return (number >= 0x02 && number <= 0x04) || number == 0x10 || (number >= 0x12 && number <= 0x15);
}

std::int64_t decode(DataType type, std::span<const std::uint8_t> bytes) noexcept {
  std::uint64_t raw = 0;
  for (std::size_t i = 0; i < bytes.size() && i < 8; ++i) raw |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
  const std::size_t bits = 8 * std::min<std::size_t>(bytes.size(), 8);
  if (is_signed(type) && bits > 0 && bits < 64 && (raw >> (bits - 1) & 1) != 0) raw |= ~std::uint64_t{0} << bits;
  return static_cast<std::int64_t>(raw);
}

}  // namespace

std::size_t size_of(DataType type) noexcept {
  switch (type) {
    case DataType::boolean:
    case DataType::integer8:
    case DataType::unsigned8:
      return 1;
    case DataType::integer16:
    case DataType::unsigned16:
      return 2;
    case DataType::integer24:
    case DataType::unsigned24:
      return 3;
    case DataType::integer32:
    case DataType::unsigned32:
    case DataType::real32:
      return 4;
    case DataType::integer40:
    case DataType::unsigned40:
      return 5;
    case DataType::integer48:
    case DataType::unsigned48:
      return 6;
    case DataType::integer56:
    case DataType::unsigned56:
      return 7;
    case DataType::integer64:
    case DataType::unsigned64:
    case DataType::real64:
      return 8;
    case DataType::visible_string:
    case DataType::octet_string:
    case DataType::domain:
      break;
  }
  return 0;
}

std::int64_t ObjectEntry::number() const noexcept { return size_of(type) == 0 ? 0 : decode(type, value); }

void ObjectEntry::set(std::int64_t number) noexcept {
  const auto raw = static_cast<std::uint64_t>(number);
  for (std::size_t i = 0; i < value.size() && i < 8; ++i) value[i] = static_cast<std::uint8_t>(raw >> (8 * i));
}

ObjectEntry& ObjectDictionary::add(std::uint16_t index, std::uint8_t subindex, DataType type, Access access,
                                   std::int64_t value, bool pdo_mappable) {
  assert(size_of(type) > 0);
  ObjectEntry& entry = entries_[key_of(index, subindex)];
  entry.index = index;
  entry.subindex = subindex;
  entry.type = type;
  entry.access = access;
  entry.pdo_mappable = pdo_mappable;
  entry.value.assign(size_of(type), 0);
  entry.set(value);
  entry.default_value = entry.value;
  return entry;
}

ObjectEntry& ObjectDictionary::add_text(std::uint16_t index, std::uint8_t subindex, std::string_view text) {
  ObjectEntry& entry = entries_[key_of(index, subindex)];
  entry.index = index;
  entry.subindex = subindex;
  entry.type = DataType::visible_string;
  entry.access = Access::constant;
  entry.value.assign(text.begin(), text.end());
  entry.default_value = entry.value;
  entry.max_length = text.size();
  return entry;
}

ObjectEntry& ObjectDictionary::add_domain(std::uint16_t index, std::uint8_t subindex, Access access,
                                          std::size_t max_length) {
  ObjectEntry& entry = entries_[key_of(index, subindex)];
  entry.index = index;
  entry.subindex = subindex;
  entry.type = DataType::domain;
  entry.access = access;
  entry.max_length = max_length;
  return entry;
}

ObjectEntry* ObjectDictionary::find(std::uint16_t index, std::uint8_t subindex) noexcept {
  const auto found = entries_.find(key_of(index, subindex));
  return found == entries_.end() ? nullptr : &found->second;
}

const ObjectEntry* ObjectDictionary::find(std::uint16_t index, std::uint8_t subindex) const noexcept {
  const auto found = entries_.find(key_of(index, subindex));
  return found == entries_.end() ? nullptr : &found->second;
}

ObjectEntry& ObjectDictionary::at(std::uint16_t index, std::uint8_t subindex) {
  ObjectEntry* entry = find(index, subindex);
  assert(entry != nullptr);
  return *entry;
}

std::int64_t ObjectDictionary::number(std::uint16_t index, std::uint8_t subindex) const noexcept {
  const ObjectEntry* entry = find(index, subindex);
  return entry == nullptr ? 0 : entry->number();
}

bool ObjectDictionary::shows(std::uint16_t index) const noexcept {
  for (auto entry = entries_.lower_bound(key_of(index, 0)); entry != entries_.end(); ++entry) {
    if (entry->second.index != index) return false;
    if (!entry->second.hidden) return true;
  }
  return false;
}

SdoAbort ObjectDictionary::find_for_access(std::uint16_t index, std::uint8_t subindex,
                                           const ObjectEntry*& entry) const noexcept {
  entry = find(index, subindex);
  if (entry != nullptr && !entry->hidden) return SdoAbort::none;
  return shows(index) ? SdoAbort::subindex_does_not_exist : SdoAbort::object_does_not_exist;
}

SdoAbort ObjectDictionary::read(std::uint16_t index, std::uint8_t subindex, const ObjectEntry*& entry) const noexcept {
  if (const SdoAbort abort = find_for_access(index, subindex, entry); abort != SdoAbort::none) return abort;
  return entry->access == Access::write_only ? SdoAbort::read_of_write_only : SdoAbort::none;
}

SdoAbort ObjectDictionary::can_write(std::uint16_t index, std::uint8_t subindex, std::size_t length) const noexcept {
  const ObjectEntry* entry = nullptr;
  if (const SdoAbort abort = find_for_access(index, subindex, entry); abort != SdoAbort::none) return abort;
  if (entry->access == Access::read_only || entry->access == Access::constant) return SdoAbort::write_of_read_only;
  const std::size_t fixed = size_of(entry->type);
  if (length == 0) return SdoAbort::none;
  if (length > (fixed > 0 ? fixed : entry->max_length)) return SdoAbort::length_too_high;
  if (length < fixed) return SdoAbort::length_too_low;
  return SdoAbort::none;
}

SdoAbort ObjectDictionary::write(std::uint16_t index, std::uint8_t subindex, std::span<const std::uint8_t> bytes) {
  if (const SdoAbort abort = can_write(index, subindex, bytes.size()); abort != SdoAbort::none) return abort;
  ObjectEntry& entry = at(index, subindex);
  if (bytes.empty() && size_of(entry.type) > 0) return SdoAbort::length_too_low;
  return take_over(entry, bytes);
}

SdoAbort ObjectDictionary::take_over(ObjectEntry& entry, std::span<const std::uint8_t> bytes) {
  const std::int64_t number = size_of(entry.type) == 0 ? 0 : decode(entry.type, bytes);
  if (entry.maximum && number > *entry.maximum) return SdoAbort::value_too_high;
  if (entry.minimum && number < *entry.minimum) return SdoAbort::value_too_low;
  if (entry.before_write) {
    if (const SdoAbort abort = entry.before_write(number); abort != SdoAbort::none) return abort;
  }
  entry.value.assign(bytes.begin(), bytes.end());
  if (entry.after_write) entry.after_write();
  return SdoAbort::none;
}

bool ObjectDictionary::write_mapped(ObjectEntry& entry, std::span<const std::uint8_t> bytes) {
  return take_over(entry, bytes) == SdoAbort::none;
}

void ObjectDictionary::restore_defaults(std::uint16_t first, std::uint16_t last) noexcept {
  for (auto it = entries_.lower_bound(key_of(first, 0)); it != entries_.end() && it->second.index <= last; ++it) {
    it->second.value = it->second.default_value;
  }
}

}  // namespace proxarm::sim
