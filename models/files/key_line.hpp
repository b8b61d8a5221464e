// The line of a key in a YAML file, for mistakes found after the file was read.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::description {

// The line of a key, dotted from the root, or of its nearest existing parent; 0: none exists. Precondition: the file
// has been read without a mistake.
int line_of_key(const std::filesystem::path& file, const std::string& dotted);

}  // namespace proxarm::description
