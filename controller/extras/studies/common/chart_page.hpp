// Lays out the page of a chart or a map: the title, and the places of the panels. Lengths are in pixels, from the top
// left.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

namespace proxarm::studies {

// Returns the text as a gnuplot string, with all special characters escaped.
std::string plain(const std::string& text);
// Returns the text as a gnuplot string in bold, with all special characters escaped.
std::string bold(const std::string& text);

// Returns a gnuplot string with the lines below each other.
std::string stacked(const std::vector<std::string>& lines);

// Breaks text at blanks into lines of at most `width` letters. Text isn't broken after a number, which stays with its
// unit.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

// Returns the number with this many significant digits, such as "0.98" or "1360". Numbers from 0.001 on have no
// exponent.
std::string number_text(double value, int digits);

// Returns a count as text, for example "10,000".
std::string count_text(double count);

// Returns the number of letters in a UTF-8 text.
std::size_t letters(const std::string& text);

// Returns a colour of the palette for gnuplot's rgb, on a white background, such as "'#17202a'".
std::string rgb(const char* name);

// Sets the ticks of an axis, 'x' or 'y', at these places.
void set_ticks(std::ostream& gp, char axis, const std::vector<double>& places);

struct Frame {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;
};

class Page {
 public:
  Page(const std::string& title, const std::string& subtitle, int width);
  // Returns the y below which panels may begin.
  [[nodiscard]] double top() const noexcept { return top_; }
  // Begins the script of a page of this height, with the page's title.
  void begin(std::ostream& gp, double height);
  // Sets the frame in which the next plot is drawn.
  void set_frame(std::ostream& gp, const Frame& frame) const;
  // Return a place as a share of the page, for gnuplot's `screen`.
  [[nodiscard]] double screen_x(double x) const noexcept { return x / width_; }
  [[nodiscard]] double screen_y(double y) const noexcept { return 1.0 - y / height_; }

 private:
  int width_;
  std::vector<std::string> title_, subtitle_;
  double top_ = 0.0, height_ = 1.0;
};

}  // namespace proxarm::studies
