// Changes values in the text of a cell's file; comments and everything else stay.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Returns whether this place of a YAML text is behind a # in its line.
bool in_comment(const std::string& text, std::size_t at);

// Replaces the cell's text by `edit` of it. Returns the path of a backup beside the file, FILE.before-WHAT. The new
// text is loaded first: if it isn't a valid cell or `check` throws, the file is unchanged. Throws SetupError.
std::filesystem::path change_cell(const std::filesystem::path& file, const std::string& what,
                                  const std::function<std::string(const std::string& text)>& edit,
                                  const std::function<void(const description::Cell& written)>& check);

}  // namespace proxarm::command_line
