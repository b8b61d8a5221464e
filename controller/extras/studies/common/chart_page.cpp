#include "controller/extras/studies/common/chart_page.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <sstream>

#include "controller/drawing/gnuplot.hpp"
#include "controller/drawing/palette.hpp"

namespace proxarm::studies {
namespace {

constexpr int title_size = 21, subtitle_size = 17, text_size = 17;
constexpr double title_line = 27.0, subtitle_line = 23.0;

// Returns the text with the characters escaped that gnuplot's enhanced text would interpret.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '_' || c == '^' || c == '{' || c == '}' || c == '@' || c == '&' || c == '~') result += '\\';
    result += c;
  }
  return result;
}

// Returns how many letters of this size fit into the width.
std::size_t fitting(int width, int size) { return static_cast<std::size_t>(1.7 * width / size); }

}  // namespace

std::string plain(const std::string& text) { return controller::gnuplot_string(escaped(text)); }

std::string bold(const std::string& text) { return controller::gnuplot_string("{/:Bold " + escaped(text) + "}"); }

std::string stacked(const std::vector<std::string>& lines) {
  std::string text = "\"";
  for (const std::string& line : lines) {
    if (text.size() > 1) text += "\\n";
    for (const char c : escaped(line)) text += c == '\\' ? std::string("\\\\") : std::string(1, c == '"' ? '\'' : c);
  }
  return text + "\"";
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  std::string bound;  // words that stay together
  const auto put = [&] {
    if (bound.empty()) return;
    if (lines.empty() || letters(lines.back()) + 1 + letters(bound) > width) {
      lines.push_back(bound);
    } else {
      lines.back() += " " + bound;
    }
    bound.clear();
  };
  for (std::string word; words >> word;) {
    bound += (bound.empty() ? "" : " ") + word;
    // A number stays with the next word, its unit.
    if (std::isdigit(static_cast<unsigned char>(word.back())) == 0) put();
  }
  put();
  return lines;
}

std::string number_text(double value, int digits) {
  char text[64];
  if (!(std::abs(value) >= 1e-3) || !std::isfinite(value)) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
  }
  const auto whole = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  const double unit = std::pow(10.0, whole - digits);
  std::snprintf(text, sizeof text, "%.*f", std::max(0, digits - whole), std::round(value / unit) * unit);
  std::string number = text;
  if (number.find('.') == std::string::npos) return number;
  number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  return number;
}

std::string count_text(double count) {
  std::string text = std::to_string(static_cast<long long>(std::llround(count)));
  for (auto at = static_cast<std::ptrdiff_t>(text.size()) - 3; at > (count < 0.0 ? 1 : 0); at -= 3) {
    text.insert(static_cast<std::size_t>(at), ",");
  }
  return text;
}

std::size_t letters(const std::string& text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string rgb(const char* name) {
  return "'" + controller::css(controller::on_white(controller::colour(name).light)) + "'";
}

void set_ticks(std::ostream& gp, char axis, const std::vector<double>& places) {
  gp << "set " << axis << "tics (";
  for (std::size_t i = 0; i < places.size(); ++i) gp << (i == 0 ? "" : ", ") << places[i];
  gp << ")\n";
}

Page::Page(const std::string& title, const std::string& subtitle, int width)
    : width_(width),
      title_(wrapped(title, fitting(width - 40, title_size))),
      subtitle_(wrapped(subtitle, fitting(width - 40, subtitle_size))),
      top_(22.0 + title_line * static_cast<double>(title_.size()) +
           subtitle_line * static_cast<double>(subtitle_.size())) {}

void Page::begin(std::ostream& gp, double height) {
  height_ = height;
  gp << "set terminal svg size " << width_ << "," << height << " font 'sans," << text_size
     << "' background 'white' enhanced\nset output 'plot.svg'\nset encoding utf8\nset tics scale 0.7\nset multiplot\n";
  double y = 24.0;
  int label = 1000;
  for (const std::string& line : title_) {
    gp << "set label " << label++ << " " << bold(line) << " at screen 0.5, screen " << screen_y(y) << " center font ',"
       << title_size << "' textcolor rgb " << rgb("ink") << "\n";
    y += title_line;
  }
  for (const std::string& line : subtitle_) {
    gp << "set label " << label++ << " " << plain(line) << " at screen 0.5, screen " << screen_y(y)
       << " center textcolor rgb " << rgb("soft") << "\n";
    y += subtitle_line;
  }
}

void Page::set_frame(std::ostream& gp, const Frame& frame) const {
  gp << "set lmargin at screen " << screen_x(frame.left) << "\nset rmargin at screen " << screen_x(frame.right)
     << "\nset tmargin at screen " << screen_y(frame.top) << "\nset bmargin at screen " << screen_y(frame.bottom)
     << "\n";
}

}  // namespace proxarm::studies
