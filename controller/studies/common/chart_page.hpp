// Lays out the page of a chart or a map: its title, and where panels are. Lengths in pixels, from the top left.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace proxarm::studies {

// A gnuplot string with all special characters escaped.
std::string plain(const std::string& text);
// The same in bold.
std::string bold(const std::string& text);

// Lines below each other.
std::string stacked(const std::vector<std::string>& lines);

// Breaks text at blanks into lines of at most `width` letters, but not after a number.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

// "0.98", "1360": a number with this many significant digits, without an exponent from 0.001 on.
std::string number_text(double value, int digits);

// For example "10,000".
std::string count_text(double count);

// The number of letters in a UTF-8 text.
std::size_t letters(const std::string& text);

// "'#17202a'": a colour of the palette on white, for gnuplot's rgb.
std::string rgb(const char* name);

// `axis`: 'x' or 'y'.
void set_ticks(std::ostream& gp, char axis, const std::vector<double>& places);

struct Frame {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;
};

class Page {
 public:
  Page(const std::string& title, const std::string& subtitle, int width);
  // Where panels may begin.
  [[nodiscard]] double top() const noexcept { return top_; }
  // Begins the script of a page of that height, with its title.
  void begin(std::ostream& gp, double height);
  // Places the next plot in this frame.
  void set_frame(std::ostream& gp, const Frame& frame) const;
  // Shares of the page, for gnuplot's `screen`.
  [[nodiscard]] double screen_x(double x) const noexcept { return x / width_; }
  [[nodiscard]] double screen_y(double y) const noexcept { return 1.0 - y / height_; }

 private:
  int width_;
  std::vector<std::string> title_, subtitle_;
  double top_ = 0.0, height_ = 1.0;
};

}  // namespace proxarm::studies
