// The object dictionary of a simulated CANopen device (CiA 301, 7.4). Its entries have an index and a subindex, a data
// type, an access type, a default value and functions that are called at a write; some may be mapped into PDOs. Values
// are stored as on the wire, as little-endian bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace proxarm::sim {

// SDO abort codes, with the numbers and the wording of CiA 301, table 22.
enum class SdoAbort : std::uint32_t {
  none = 0,  // no abort: the access succeeded
  toggle_bit_not_alternated = 0x05030000,
  protocol_timed_out = 0x05040000,
  command_specifier_not_valid = 0x05040001,
  invalid_block_size = 0x05040002,
  invalid_sequence_number = 0x05040003,
  crc_error = 0x05040004,
  out_of_memory = 0x05040005,
  unsupported_access = 0x06010000,
  read_of_write_only = 0x06010001,
  write_of_read_only = 0x06010002,
  object_does_not_exist = 0x06020000,
  object_cannot_be_mapped = 0x06040041,
  pdo_length_exceeded = 0x06040042,
  parameter_incompatibility = 0x06040043,
  hardware_error = 0x06060000,
  length_does_not_match = 0x06070010,
  length_too_high = 0x06070012,
  length_too_low = 0x06070013,
  subindex_does_not_exist = 0x06090011,
  invalid_value = 0x06090030,
  value_too_high = 0x06090031,
  value_too_low = 0x06090032,
  general_error = 0x08000000,
  cannot_transfer = 0x08000020,
  not_because_of_local_control = 0x08000021,
  not_in_present_device_state = 0x08000022,
};

enum class Access : std::uint8_t {
  read_only,
  write_only,
  read_write,
  constant,  // read-only, and the device itself doesn't change it either
};

// Data types with their numbers in CiA 301.
enum class DataType : std::uint16_t {
  boolean = 0x0001,
  integer8 = 0x0002,
  integer16 = 0x0003,
  integer32 = 0x0004,
  unsigned8 = 0x0005,
  unsigned16 = 0x0006,
  unsigned32 = 0x0007,
  real32 = 0x0008,
  visible_string = 0x0009,
  octet_string = 0x000A,
  domain = 0x000F,
  integer24 = 0x0010,
  real64 = 0x0011,
  integer40 = 0x0012,
  integer48 = 0x0013,
  integer56 = 0x0014,
  integer64 = 0x0015,
  unsigned24 = 0x0016,
  unsigned40 = 0x0018,
  unsigned48 = 0x0019,
  unsigned56 = 0x001A,
  unsigned64 = 0x001B,
};

// Returns the size in bytes of a type of fixed length; 0 for strings and domains.
[[nodiscard]] std::size_t size_of(DataType type) noexcept;

struct ObjectEntry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  DataType type = DataType::unsigned32;
  Access access = Access::read_write;
  bool pdo_mappable = false;
  bool hidden = false;                      // used by the device itself, but invisible to the network
  std::vector<std::uint8_t> value;          // current value; its length is fixed except for strings and domains
  std::vector<std::uint8_t> default_value;  // value after a reset
  std::size_t max_length = 0;               // length of the longest string or domain that is accepted
  std::optional<std::int64_t> minimum, maximum;
  // Is called with the new value (0 for strings and domains) before a write over SDO or PDO takes effect. A result
  // other than `none` refuses the write.
  std::function<SdoAbort(std::int64_t)> before_write;
  std::function<void()> after_write;

  // Returns the value as a number, sign-extended for signed types; 0 for strings and domains. Never throws.
  [[nodiscard]] std::int64_t number() const noexcept;
  // Sets the value, truncated to the type's length. Doesn't check the access type and doesn't call before_write or
  // after_write.
  void set(std::int64_t number) noexcept;
};

class ObjectDictionary {
 public:
  // Adds an entry with a number. The returned reference stays valid as long as the dictionary exists.
  ObjectEntry& add(std::uint16_t index, std::uint8_t subindex, DataType type, Access access, std::int64_t value,
                   bool pdo_mappable = false);
  ObjectEntry& add_text(std::uint16_t index, std::uint8_t subindex, std::string_view text);
  ObjectEntry& add_domain(std::uint16_t index, std::uint8_t subindex, Access access, std::size_t max_length);

  [[nodiscard]] ObjectEntry* find(std::uint16_t index, std::uint8_t subindex) noexcept;
  [[nodiscard]] const ObjectEntry* find(std::uint16_t index, std::uint8_t subindex) const noexcept;
  // Returns all entries, for the code that builds the device.
  [[nodiscard]] std::map<std::uint32_t, ObjectEntry>& entries() noexcept { return entries_; }
  // Precondition: the entry exists.
  [[nodiscard]] ObjectEntry& at(std::uint16_t index, std::uint8_t subindex = 0);
  // Returns 0 if there is no such entry.
  [[nodiscard]] std::int64_t number(std::uint16_t index, std::uint8_t subindex = 0) const noexcept;

  // True if the dictionary has an object with this index that is visible to the network.
  [[nodiscard]] bool shows(std::uint16_t index) const noexcept;

  // Access from the network. read() returns the entry. write() stores the bytes if all checks pass.
  [[nodiscard]] SdoAbort read(std::uint16_t index, std::uint8_t subindex, const ObjectEntry*& entry) const noexcept;
  [[nodiscard]] SdoAbort write(std::uint16_t index, std::uint8_t subindex, std::span<const std::uint8_t> bytes);
  // Makes those checks of write() that don't need the value, at the start of a long transfer. `length` is 0 if the
  // length isn't known.
  [[nodiscard]] SdoAbort can_write(std::uint16_t index, std::uint8_t subindex, std::size_t length) const noexcept;
  // Stores bytes that were received in a PDO; false if the value is refused. Precondition: `bytes` has the entry's
  // length.
  static bool write_mapped(ObjectEntry& entry, std::span<const std::uint8_t> bytes);

  // Restores the default values of the indices first..last without calling before_write or after_write.
  void restore_defaults(std::uint16_t first, std::uint16_t last) noexcept;

 private:
  [[nodiscard]] SdoAbort find_for_access(std::uint16_t index, std::uint8_t subindex,
                                         const ObjectEntry*& entry) const noexcept;
  static SdoAbort take_over(ObjectEntry& entry, std::span<const std::uint8_t> bytes);

  std::map<std::uint32_t, ObjectEntry> entries_;  // key: index << 8 | subindex
};

}  // namespace proxarm::sim
