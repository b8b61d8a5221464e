// Random secrets, and a comparison whose duration doesn't reveal how much of a guess was right.
#pragma once

#include <string>
#include <string_view>

namespace proxarm::view {

// Returns 256 random bits as 64 hexadecimal digits. Throws std::runtime_error if the system provides no random bits.
std::string random_secret();

// Returns whether both texts are equal. The time doesn't depend on where the texts differ; only different lengths
// return at once.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace proxarm::view
