// Reads the bitrates that a device's EDS file lists: [DeviceInfo] BaudRate_10 to BaudRate_1000, in kbit/s (CiA 306-1).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace proxarm::description {

// Throws SetupError, with file and line, if the file lists bitrates but not `bitrate` (bit/s), or if it contains a
// value that isn't a number where one is required.
void require_bitrate(std::string_view eds_text, const std::filesystem::path& file, std::int64_t bitrate);
void require_bitrate(const std::filesystem::path& file, std::int64_t bitrate);

}  // namespace proxarm::description
