// Pictures by gnuplot. It is a program of its own; where it is absent, there is a warning instead of a picture.
//
// It is started without a shell, in a temporary folder with its script and its data, and no path or text from outside
// gets into the script unquoted. Not for the cycle.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::controller {

// A gnuplot string in single quotes, in which only the quote itself is special; control characters become blanks.
std::string gnuplot_string(const std::string& text);

// Runs `script`, which finds `data` in the file 'data' beside it and writes 'plot.svg'; that goes to `svg`. `gnuplot`
// is looked up in PATH. Returns a warning in one line where that didn't work; empty when it did.
[[nodiscard]] std::string draw_svg(const std::string& gnuplot, const std::string& script, const std::string& data,
                                   const std::filesystem::path& svg);

}  // namespace proxarm::controller
