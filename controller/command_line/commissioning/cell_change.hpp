// A cell's file with some values changed in its text, by a command that has found them: comments and all else stay.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "models/description/cell.hpp"

namespace proxarm::command_line {

// Whether a place of a YAML text is behind a # of its line.
bool in_comment(const std::string& text, std::size_t at);

// Writes `edit` of the cell's text to its file. What was there goes to a backup beside it, FILE.before-WHAT, whose path
// is returned. The new text is loaded first: where it is no cell, or `check` throws, nothing is changed. Throws
// SetupError.
std::filesystem::path change_cell(const std::filesystem::path& file, const std::string& what,
                                  const std::function<std::string(const std::string& text)>& edit,
                                  const std::function<void(const description::Cell& written)>& check);

}  // namespace proxarm::command_line
