// Finds the line of a key in a YAML file, for mistakes that are found after the file was read.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::description {

// Returns the line of a key. `dotted` is the key's path from the root. If the key doesn't exist, returns the line of
// its nearest parent that exists, or 0 if none exists. Precondition: the file has been read without a mistake.
int line_of_key(const std::filesystem::path& file, const std::string& dotted);

}  // namespace proxarm::description
