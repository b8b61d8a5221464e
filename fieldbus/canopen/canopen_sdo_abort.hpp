// SDO abort codes (CiA 301, 7.2.4.3.17) with the standard's numbers and wording.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace proxarm::fieldbus {

namespace sdo_abort {
inline constexpr std::uint32_t toggle_not_alternated = 0x05030000;
inline constexpr std::uint32_t timed_out = 0x05040000;
inline constexpr std::uint32_t command_unknown = 0x05040001;
inline constexpr std::uint32_t invalid_block_size = 0x05040002;
inline constexpr std::uint32_t invalid_sequence_number = 0x05040003;
inline constexpr std::uint32_t crc_error = 0x05040004;
inline constexpr std::uint32_t out_of_memory = 0x05040005;
inline constexpr std::uint32_t unsupported_access = 0x06010000;
inline constexpr std::uint32_t write_of_read_only = 0x06010002;
inline constexpr std::uint32_t object_missing = 0x06020000;
inline constexpr std::uint32_t not_mappable = 0x06040041;
inline constexpr std::uint32_t length_mismatch = 0x06070010;
inline constexpr std::uint32_t sub_index_missing = 0x06090011;
inline constexpr std::uint32_t invalid_value = 0x06090030;
inline constexpr std::uint32_t value_too_high = 0x06090031;
inline constexpr std::uint32_t value_too_low = 0x06090032;
inline constexpr std::uint32_t general_error = 0x08000000;
inline constexpr std::uint32_t not_transferable = 0x08000020;
inline constexpr std::uint32_t local_control = 0x08000021;
inline constexpr std::uint32_t device_state = 0x08000022;
}  // namespace sdo_abort

// Returns the standard's wording of this code, or "unknown abort code" for a number that the standard lacks.
[[nodiscard]] std::string_view sdo_abort_text(std::uint32_t code) noexcept;
// Returns for example "SDO abort 06020000: object does not exist in the object dictionary".
[[nodiscard]] std::string describe_sdo_abort(std::uint32_t code);

}  // namespace proxarm::fieldbus
