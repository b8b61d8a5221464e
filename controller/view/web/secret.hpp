// Random words that can't be guessed, and comparing them without telling how much of a guess was right.
#pragma once

#include <string>
#include <string_view>

namespace proxarm::view {

// 256 random bits as 64 hexadecimal digits. Throws std::runtime_error where the system gives none.
std::string random_secret();

// Takes the same time wherever they differ; what differs in length is told apart at once.
bool same_secret(std::string_view a, std::string_view b) noexcept;

}  // namespace proxarm::view
