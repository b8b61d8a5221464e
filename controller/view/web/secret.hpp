// Random secrets, and a comparison whose duration doesn't reveal how much of a guess was right.
#pragma once

#include <string>
#include <string_view>

namespace proxarm::view {

// 256 random bits as 64 hexadecimal digits. Throws std::runtime_error if the system provides none.
std::string random_secret();

// Compares in a time that doesn't depend on where the texts differ. Different lengths are detected at once.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace proxarm::view
