// Which bitrates a device has by its EDS file: [DeviceInfo] BaudRate_10 to BaudRate_1000, in kbit/s (CiA 306-1).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace proxarm::description {

// Throws SetupError, with file and line, where the file says by any of these keys which bitrates there are, and this
// one (bit/s) is none of them; and as parse_eds() for what is no number.
void require_bitrate(std::string_view eds_text, const std::filesystem::path& file, std::int64_t bitrate);
void require_bitrate(const std::filesystem::path& file, std::int64_t bitrate);

}  // namespace proxarm::description
