// Changes values in the text of a cell's file. Comments and all other text stay unchanged.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Returns whether there is a # before the place `at` in its line of a YAML text.
bool in_comment(const std::string& text, std::size_t at);

// Replaces the text of the cell's file by `edit` of that text. Returns the path of a backup beside the file,
// FILE.before-WHAT. If the new text isn't a valid cell, or `check` throws for the cell of the new text, throws and
// leaves the file unchanged. Throws SetupError.
std::filesystem::path change_cell(const std::filesystem::path& file, const std::string& what,
                                  const std::function<std::string(const std::string& text)>& edit,
                                  const std::function<void(const description::Cell& written)>& check);

}  // namespace proxarm::command_line
