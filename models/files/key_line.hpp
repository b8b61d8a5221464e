// Where a key stands in a YAML file, for a mistake that shows only after the file has been read.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::description {

// The line of a key, dotted from the root, or of the nearest one above it that is there; 0: none of them is.
// Precondition: the file has been read without a mistake.
int line_of_key(const std::filesystem::path& file, const std::string& dotted);

}  // namespace proxarm::description
