// Draws pictures by gnuplot. If this program is missing, there is a warning instead of a picture.
//
// gnuplot is started without a shell, in a temporary folder with its script and data, and the script quotes all paths
// and texts from outside. Not for the cycle.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::controller {

// A gnuplot string in single quotes, in which only the quote itself is special; control characters become blanks.
std::string gnuplot_string(const std::string& text);

// Runs `script`, which reads `data` from the file 'data' beside it and writes 'plot.svg'; this is copied to `svg`.
// `gnuplot` is looked up in PATH. Returns a warning of one line on failure, else an empty string.
[[nodiscard]] std::string draw_svg(const std::string& gnuplot, const std::string& script, const std::string& data,
                                   const std::filesystem::path& svg);

}  // namespace proxarm::controller
