// Draws pictures by gnuplot. If gnuplot is missing, there is a warning instead of a picture.
//
// gnuplot is started without a shell, in a temporary folder with its script and data. The script quotes all paths and
// texts that come from outside. Not for the cycle.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::controller {

// Returns the text as a gnuplot string in single quotes, in which only the quote itself is special. Control characters
// become blanks.
std::string gnuplot_string(const std::string& text);

// Runs `script`. The script reads `data` from the file 'data' beside it and writes 'plot.svg', which is then copied to
// `svg`. `gnuplot` is looked up in PATH. Returns a warning of one line on failure, else an empty string.
[[nodiscard]] std::string draw_svg(const std::string& gnuplot, const std::string& script, const std::string& data,
                                   const std::filesystem::path& svg);

}  // namespace proxarm::controller
