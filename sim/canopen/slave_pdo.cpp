#include "sim/canopen/slave_pdo.hpp"

#include <algorithm>

namespace proxarm::sim {

namespace {

constexpr std::int64_t not_valid = std::int64_t{1} << 31;
constexpr std::int64_t flag_bits = std::int64_t{7} << 29;

// True for the identifiers that no PDO may use (CiA 301, table 42).
bool is_restricted(std::int64_t id) noexcept {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) || (id >= 0x601 && id <= 0x67F) ||
         (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}

}  // namespace

SlavePdo::SlavePdo(ObjectDictionary& dictionary, Direction direction, int number, std::uint8_t node, bool valid,
                   bool fd)
    : dictionary_(dictionary),
      direction_(direction),
      parameters_(static_cast<std::uint16_t>((direction == Direction::receive ? 0x1400 : 0x1800) + number - 1)),
      mapping_(static_cast<std::uint16_t>((direction == Direction::receive ? 0x1600 : 0x1A00) + number - 1)),
      most_(fd ? 64 : 8) {
  const std::int64_t id = (direction == Direction::receive ? 0x200 : 0x180) + 0x100 * (number - 1) + node;
  const auto reconfigure = [this] { configure(); };
  dictionary.add(parameters_, 0, DataType::unsigned8, Access::constant, 5);

  ObjectEntry& identifier =
      dictionary.add(parameters_, 1, DataType::unsigned32, Access::read_write, valid ? id : id | not_valid);
  identifier.before_write = [this](std::int64_t value) { return check_identifier(value); };
  identifier.after_write = reconfigure;

  ObjectEntry& type = dictionary.add(parameters_, 2, DataType::unsigned8, Access::read_write, 255);
  type.before_write = [this](std::int64_t value) { return check_type(value); };
  type.after_write = reconfigure;

  dictionary.add(parameters_, 3, DataType::unsigned16, Access::read_write, 0).after_write = reconfigure;
  dictionary.add(parameters_, 5, DataType::unsigned16, Access::read_write, 0).after_write = reconfigure;

  ObjectEntry& count = dictionary.add(mapping_, 0, DataType::unsigned8, Access::read_write, 0);
  count.before_write = [this](std::int64_t value) { return check_count(value); };
  count.after_write = reconfigure;
  for (int i = 1; i <= most_; ++i) {
    dictionary.add(mapping_, static_cast<std::uint8_t>(i), DataType::unsigned32, Access::read_write, 0).before_write =
        [this](std::int64_t value) { return check_object(value); };
  }
}

void SlavePdo::set_default_mapping(std::initializer_list<std::uint32_t> objects) {
  std::uint8_t subindex = 0;
  for (const std::uint32_t object : objects) {
    ObjectEntry& entry = dictionary_.at(mapping_, ++subindex);
    entry.set(object);
    entry.default_value = entry.value;
  }
  ObjectEntry& count = dictionary_.at(mapping_, 0);
  count.set(subindex);
  count.default_value = count.value;
  configure();
}

void SlavePdo::configure() noexcept {
  const std::int64_t identifier = dictionary_.number(parameters_, 1);
  valid_ = (identifier & not_valid) == 0;
  identifier_ = static_cast<std::uint32_t>(identifier & 0x7FF);
  type_ = static_cast<std::uint8_t>(dictionary_.number(parameters_, 2));
  inhibit_ns_ = dictionary_.number(parameters_, 3) * 100'000;
  event_timer_ns_ = dictionary_.number(parameters_, 5) * 1'000'000;
  const std::int64_t wanted = std::min<std::int64_t>(dictionary_.number(mapping_, 0), most_);
  count_ = 0;
  length_ = 0;
  for (std::int64_t i = 1; i <= wanted; ++i) {
    Mapped mapped;
    const auto object = static_cast<std::uint32_t>(dictionary_.number(mapping_, static_cast<std::uint8_t>(i)));
    if (resolve(object, mapped) != SdoAbort::none) break;
    mapped_[count_++] = mapped;
    length_ = static_cast<std::uint8_t>(length_ + mapped.length);
  }
}

SdoAbort SlavePdo::resolve(std::uint32_t object, Mapped& mapped) const noexcept {
  const auto index = static_cast<std::uint16_t>(object >> 16);
  const auto subindex = static_cast<std::uint8_t>(object >> 8);
  const std::uint32_t bits = object & 0xFF;
  // A dummy entry: its bytes in the PDO are skipped.
  if (direction_ == Direction::receive && index >= 1 && index <= 7 && subindex == 0) {
    const std::size_t size = size_of(static_cast<DataType>(index));
    if (bits != 8 * size) return SdoAbort::object_cannot_be_mapped;
    mapped = {nullptr, static_cast<std::uint8_t>(size)};
    return SdoAbort::none;
  }
  const ObjectEntry* found = dictionary_.find(index, subindex);
  if (found == nullptr || found->hidden) {
    return dictionary_.shows(index) ? SdoAbort::subindex_does_not_exist : SdoAbort::object_does_not_exist;
  }
  const bool writable = found->access == Access::read_write || found->access == Access::write_only;
  const bool fits = direction_ == Direction::receive ? writable : found->access != Access::write_only;
  if (!found->pdo_mappable || !fits || bits != 8 * size_of(found->type)) return SdoAbort::object_cannot_be_mapped;
  mapped = {dictionary_.find(index, subindex), static_cast<std::uint8_t>(bits / 8)};
  return SdoAbort::none;
}

// Checks a new value of the identifier object. Bits 0..29 can't change while the PDO is valid. 29-bit identifiers (bit
// 29) aren't supported.
SdoAbort SlavePdo::check_identifier(std::int64_t value) const noexcept {
  const std::int64_t id = value & ~flag_bits, present = dictionary_.number(parameters_, 1);
  if ((value >> 29 & 1) != 0 || id > 0x7FF) return SdoAbort::invalid_value;
  const bool stays_valid = (present & not_valid) == 0 && (value & not_valid) == 0;
  if (stays_valid && id != (present & ~flag_bits)) return SdoAbort::invalid_value;
  if ((value & not_valid) == 0 && is_restricted(id)) return SdoAbort::invalid_value;
  return SdoAbort::none;
}

SdoAbort SlavePdo::check_type(std::int64_t value) const noexcept {
  return value <= 240 || value >= 254 ? SdoAbort::none : SdoAbort::invalid_value;
}

// Checks a new number of mapped objects. The mapping can change only while the PDO isn't valid. A changed mapping takes
// effect when the number of its objects is written.
SdoAbort SlavePdo::check_count(std::int64_t value) const noexcept {
  if ((dictionary_.number(parameters_, 1) & not_valid) == 0) return SdoAbort::unsupported_access;
  if (value > most_) return SdoAbort::pdo_length_exceeded;
  int length = 0;
  for (std::int64_t i = 1; i <= value; ++i) {
    Mapped mapped;
    const auto object = static_cast<std::uint32_t>(dictionary_.number(mapping_, static_cast<std::uint8_t>(i)));
    if (const SdoAbort abort = resolve(object, mapped); abort != SdoAbort::none) return abort;
    length += mapped.length;
  }
  return length > most_ ? SdoAbort::pdo_length_exceeded : SdoAbort::none;
}

SdoAbort SlavePdo::check_object(std::int64_t value) const noexcept {
  const bool valid = (dictionary_.number(parameters_, 1) & not_valid) == 0;
  if (valid || dictionary_.number(mapping_, 0) != 0) return SdoAbort::unsupported_access;
  if (value == 0) return SdoAbort::none;  // 0 marks an unused entry
  Mapped mapped;
  return resolve(static_cast<std::uint32_t>(value), mapped);
}

void SlavePdo::unpack(std::span<const std::uint8_t> bytes) {
  std::size_t at = 0;
  for (std::uint8_t i = 0; i < count_; ++i) {
    const Mapped& mapped = mapped_[i];
    if (mapped.entry != nullptr) ObjectDictionary::write_mapped(*mapped.entry, bytes.subspan(at, mapped.length));
    at += mapped.length;
  }
}

void SlavePdo::pack(std::array<std::uint8_t, 64>& bytes) const noexcept {
  std::size_t at = 0;
  for (std::uint8_t i = 0; i < count_; ++i) {
    std::copy_n(mapped_[i].entry->value.begin(), mapped_[i].length, bytes.begin() + static_cast<std::ptrdiff_t>(at));
    at += mapped_[i].length;
  }
}

}  // namespace proxarm::sim
