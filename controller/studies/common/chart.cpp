#include "controller/studies/common/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "controller/drawing/gnuplot.hpp"
#include "controller/drawing/palette.hpp"

namespace proxarm::studies {
namespace {

using controller::gnuplot_string;

void define_styles(std::ostream& gp) {
  int number = 0;
  for (const controller::SeriesStyle& s : controller::series_styles()) {
    gp << "set style line " << ++number << " lc rgb '" << s.colour << "' lw " << s.width << " pt " << s.mark
       << " ps 0.9 " << controller::gnuplot_dash(s.dash) << "\n";
  }
}

void range(std::ostream& gp, char axis, double low, double high, bool log) {
  gp << (log ? "set" : "unset") << " logscale " << axis << "\n";
  const bool readable = low >= 1e-3 && high <= 1e4 && low < high;
  if (log && !readable) {
    gp << "set format " << axis << " '10^{%L}'\n";
  } else {
    gp << "set format " << axis << " '%g'\n";
  }
  if (low < high) {
    gp << "set " << axis << "range [" << low << ":" << high << "]\n";
  } else {
    gp << "set " << axis << "range [*:*]\n";
  }
}

// Escapes the characters that gnuplot's enhanced text would interpret.
std::string plain(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '_' || c == '^' || c == '{' || c == '}' || c == '@' || c == '&' || c == '~') result += '\\';
    result += c;
  }
  return gnuplot_string(result);
}

void place(std::ostream& gp, std::size_t index, int columns, std::size_t count, double top_margin,
           double bottom_margin) {
  const std::size_t wide = static_cast<std::size_t>(columns);
  const std::size_t rows = (count + wide - 1) / wide;
  const double width = 1.0 / static_cast<double>(wide);
  const double height = (1.0 - top_margin - bottom_margin) / static_cast<double>(rows);
  const double left = static_cast<double>(index % wide) * width;
  const std::size_t row = index / wide;
  const double bottom = 1.0 - top_margin - height * static_cast<double>(row + 1);
  gp << "set origin " << left << "," << bottom << "\nset size " << width << "," << height << "\n";
}

// Names below an axis that counts; none: numbers.
void name_places(std::ostream& gp, const std::vector<std::string>& names) {
  if (names.empty()) {
    gp << "set xtics auto\n";
    return;
  }
  gp << "set xtics (";
  for (std::size_t i = 0; i < names.size(); ++i) gp << (i == 0 ? "" : ", ") << plain(names[i]) << " " << i;
  gp << ")\nset xrange [-0.5:" << static_cast<double>(names.size()) - 0.5 << "]\n";
}

}  // namespace

namespace {

constexpr int most_levels = 9;

// Level lines of y across the panel, each with its value at its right end.
void draw_levels(std::ostream& gp, const std::vector<double>& levels) {
  gp << "unset arrow\n";
  for (int label = 1; label <= most_levels; ++label) gp << "unset label " << label << "\n";
  int label = 0;
  for (const double level : levels) {
    gp << "set arrow from graph 0, first " << level << " to graph 1, first " << level
       << " nohead lc rgb '#6f6f6f' lw 1.2 dt (3,3)\nset label " << ++label << " '" << 100.0 * level
       << " %' at graph 0.985, first " << level << " right offset 0,0.45 font 'sans,15' textcolor rgb '#515d69'\n";
  }
}

// Rows of the common key, in columns of the width that the longest names take.
int key_rows(const Chart& chart) {
  if (!chart.common_key || chart.panels.empty()) return 0;
  constexpr int sample_width = 150, letter_width = 12;  // of 19 points, with what gnuplot leaves between columns
  std::size_t named = 0, longest = 0;
  for (const Curve& curve : chart.panels[0].curves) {
    if (curve.name.empty() || curve.x.empty()) continue;
    ++named;
    longest = std::max(longest, curve.name.size());
  }
  const std::size_t column_width = sample_width + letter_width * longest;
  const std::size_t columns =
      std::max<std::size_t>(1, static_cast<std::size_t>(chart.columns * chart.panel_width) / column_width);
  return static_cast<int>((named + columns - 1) / columns);
}

}  // namespace

std::string draw(const Chart& chart, const std::filesystem::path& svg) {
  std::ostringstream gp, data;
  data.precision(8);
  const auto columns = static_cast<std::size_t>(chart.columns);
  const std::size_t rows = (chart.panels.size() + columns - 1) / columns;
  const int named_rows = key_rows(chart), key_height = 26 * named_rows;
  const int extra = 70 + key_height;
  const int height = static_cast<int>(rows) * chart.panel_height + extra;
  gp << "set terminal svg size " << chart.columns * chart.panel_width << "," << height
     << " font 'sans,19' background 'white' enhanced\nset output 'plot.svg'\nset encoding utf8\n";
  define_styles(gp);
  gp << "set grid lc rgb '#c0c0c0' lw 0.6\nset tics scale 0.7\nset multiplot\n"
     << "set label 1000 " << plain(chart.title) << " at screen 0.5, screen " << 1.0 - 26.0 / height
     << " center font 'sans,22'\n";
  if (rows > 1) gp << "set lmargin 10\n";  // panels that stand below each other begin at the same place
  std::size_t block = 0;
  for (std::size_t i = 0; i < chart.panels.size(); ++i) {
    const Panel& panel = chart.panels[i];
    place(gp, i, chart.columns, chart.panels.size(), 50.0 / height, (20.0 + key_height) / height);
    range(gp, 'x', panel.x_low, panel.x_high, panel.log_x);
    range(gp, 'y', panel.y_low, panel.y_high, panel.log_y);
    // Many decades: every other one is labelled.
    gp << (panel.log_y && panel.y_low > 0.0 && panel.y_high / panel.y_low > 1e6 ? "set ytics 100\n"
                                                                                : "set ytics auto\n");
    name_places(gp, panel.x_names);
    gp << "set title " << plain(panel.title) << "\nset xlabel " << plain(panel.x_label) << "\nset ylabel "
       << plain(panel.y_label) << "\n";
    if (chart.common_key && i == 0) {
      gp << "set key at screen 0.5, screen " << (12.0 + 0.5 * key_height) / height << " center vertical maxrows "
         << named_rows << " samplen 4 Left reverse\n";
    } else if (chart.common_key || !panel.key) {
      gp << "unset key\n";
    } else {
      gp << "set key outside right top vertical maxcols 1 samplen 3 spacing 1.1 Left reverse font ',16'\n";
    }
    draw_levels(gp, panel.levels);
    std::string plot = "plot ";
    for (const Curve& curve : panel.curves) {
      if (curve.x.empty()) continue;
      for (std::size_t k = 0; k < curve.x.size(); ++k) {
        if (std::isfinite(curve.y[k])) {
          data << curve.x[k] << " " << curve.y[k] << "\n";
        } else {
          data << "\n";  // a gap
        }
      }
      data << "\n\n";
      const std::size_t style = static_cast<std::size_t>(curve.style) % controller::series_styles().size() + 1;
      if (plot.size() > 5) plot += ", ";
      plot += "'data' index " + std::to_string(block++) + " using 1:2 with " +
              (curve.line ? (curve.marks ? "linespoints" : "lines") : "points") + " ls " + std::to_string(style) +
              (curve.name.empty() ? " notitle" : " title " + plain(curve.name));
    }
    if (plot.size() > 5) gp << plot << "\n";
    gp << "unset label 1000\n";
  }
  gp << "unset multiplot\n";
  return controller::draw_svg("gnuplot", gp.str(), data.str(), svg);
}

namespace {

// Where z is `level`: a line "x y" to "x y" across each mesh of the grid, linear in what is drawn.
struct Contour {
  std::string lines{};
  double label_x = 0.0, label_y = 0.0;  // a place on it
};

Contour contour(const Map& map, double level) {
  const auto scaled = [](double v, bool log) { return log ? std::log(v) : v; };
  const auto between = [&scaled](double from, double to, double share, bool log) {
    const double v = scaled(from, log) + share * (scaled(to, log) - scaled(from, log));
    return log ? std::exp(v) : v;
  };
  std::ostringstream lines;
  Contour found;
  std::size_t count = 0;
  for (std::size_t j = 0; j + 1 < map.y.size(); ++j) {
    for (std::size_t i = 0; i + 1 < map.x.size(); ++i) {
      // Around the mesh: on each side where z passes the level, a point.
      const std::array<std::array<std::size_t, 2>, 5> corners{{{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}, {i, j}}};
      std::vector<std::array<double, 2>> points;
      for (std::size_t side = 0; side < 4; ++side) {
        const auto [i_a, j_a] = corners[side];
        const auto [i_b, j_b] = corners[side + 1];
        const double a = scaled(map.z[j_a * map.x.size() + i_a], map.log_z),
                     b = scaled(map.z[j_b * map.x.size() + i_b], map.log_z), z = scaled(level, map.log_z);
        if (!std::isfinite(a) || !std::isfinite(b) || (a < z) == (b < z)) continue;
        const double share = (z - a) / (b - a);
        points.push_back(
            {between(map.x[i_a], map.x[i_b], share, map.log_x), between(map.y[j_a], map.y[j_b], share, map.log_y)});
      }
      if (points.size() != 2) continue;  // at a saddle, or beside a white cell, the line is left open
      for (const auto& [x, y] : points) lines << x << " " << y << "\n";
      lines << "\n";
      if (++count > 4) continue;  // the label goes to the fourth mesh, away from the border
      found.label_x = points[0][0];
      found.label_y = points[0][1];
    }
  }
  found.lines = lines.str();
  return found;
}

// Where a point is in the panel, as shares of its width and height.
std::array<double, 2> place_in(const Map& map, double x, double y) {
  const auto share = [](double v, const std::vector<double>& grid, bool log) {
    const auto f = [log](double u) { return log ? std::log(u) : u; };
    return (f(v) - f(grid.front())) / (f(grid.back()) - f(grid.front()));
  };
  return {share(x, map.x, map.log_x), share(y, map.y, map.log_y)};
}

// Whether a number there lies over none of the others.
bool is_room(const std::vector<std::array<double, 2>>& labelled, const std::array<double, 2>& place) {
  constexpr double width = 0.16, height = 0.13;  // of a number, as shares of the panel
  return std::ranges::none_of(labelled, [&place](const std::array<double, 2>& other) {
    return std::abs(other[0] - place[0]) < width && std::abs(other[1] - place[1]) < height;
  });
}

std::string map_steps() {
  std::string steps;
  const auto colours = controller::map_colours();
  for (std::size_t i = 0; i < colours.size(); ++i) {
    steps += (i == 0 ? "" : ", ") + std::to_string(i) + " '" + colours[i] + "'";
  }
  return steps;
}

}  // namespace

std::string draw(const MapChart& chart, const std::filesystem::path& svg) {
  std::ostringstream gp, data;
  data.precision(8);
  const auto columns = static_cast<std::size_t>(chart.columns);
  const std::size_t rows = (chart.maps.size() + columns - 1) / columns;
  const int height = static_cast<int>(rows) * 430 + 90;
  gp << "set terminal svg size " << chart.columns * 620 << "," << height
     << " font 'sans,19' background 'white' enhanced\nset output 'plot.svg'\nset encoding utf8\n"
     << "set palette maxcolors " << 2 * (controller::map_colours().size() - 1) << "\nset palette defined ("
     << map_steps() << ")\nset tics scale 0.7 front\n"
     << "set object 1 rectangle from graph 0, graph 0 to graph 1, graph 1 behind fillcolor rgb '#c9d0d6' fillstyle "
        "solid noborder\n"
     << "set multiplot\nset label 1000 " << plain(chart.title) << " at screen 0.5, screen " << 1.0 - 26.0 / height
     << " center font 'sans,22'\nset label 1001 " << plain(chart.note) << " at screen 0.5, screen " << 18.0 / height
     << " center\nunset key\n";
  std::size_t block = 0;
  for (std::size_t i = 0; i < chart.maps.size(); ++i) {
    const Map& map = chart.maps[i];
    place(gp, i, chart.columns, chart.maps.size(), 50.0 / height, 40.0 / height);
    const double width = 1.0 / static_cast<double>(columns), left = static_cast<double>(i % columns) * width;
    gp << "set lmargin at screen " << left + 0.19 * width << "\nset rmargin at screen " << left + 0.84 * width << "\n";
    range(gp, 'x', map.x.front(), map.x.back(), map.log_x);
    range(gp, 'y', map.y.front(), map.y.back(), map.log_y);
    gp << "set format x '%g'\nset format y '%g'\n";
    if (map.log_x && map.x.back() < 100.0 * map.x.front()) gp << "set logscale x 2\n";  // else one label only
    gp << (map.log_z ? "set" : "unset") << " logscale cb\n";
    if (chart.z_low < chart.z_high) gp << "set cbrange [" << chart.z_low << ":" << chart.z_high << "]\n";
    gp << "set title " << plain(map.title) << "\nset xlabel " << plain(map.x_label) << "\nset ylabel "
       << plain(map.y_label) << "\n";
    // Cells as quadrangles between the middles of the grid's lines.
    const auto edge = [](const std::vector<double>& grid, std::size_t k, double side, bool log) {
      const auto f = [log](double v) { return log ? std::log(v) : v; };
      const std::size_t other = side < 0.0 ? (k == 0 ? 0 : k - 1) : std::min(k + 1, grid.size() - 1);
      const double middle = 0.5 * (f(grid[k]) + f(grid[other]));
      return log ? std::exp(middle) : middle;
    };
    std::size_t drawn = 0;
    std::ostringstream cells;
    for (std::size_t row = 0; row < map.y.size(); ++row) {
      for (std::size_t column = 0; column < map.x.size(); ++column) {
        const double z = map.z[row * map.x.size() + column];
        if (!std::isfinite(z)) continue;
        ++drawn;
        cells << map.x[column] << " " << map.y[row] << " " << edge(map.x, column, -1.0, map.log_x) << " "
              << edge(map.x, column, 1.0, map.log_x) << " " << edge(map.y, row, -1.0, map.log_y) << " "
              << edge(map.y, row, 1.0, map.log_y) << " " << z << "\n";
      }
    }
    data << (drawn > 0 ? cells.str() : "1 1 1 1 1 1 nan\n") << "\n\n";
    std::string plot = "plot 'data' index " + std::to_string(block++) +
                       " using 1:2:3:4:5:6:7 with boxxyerror fillstyle solid 1.0 noborder lc palette";
    gp << (i % columns + 1 == columns ? "set" : "unset") << " colorbox\n";  // one for a row
    int label = 2000;
    std::vector<std::array<double, 2>> labelled;
    for (const double level : chart.contours) {
      const Contour line = contour(map, level);
      if (line.lines.empty()) continue;
      data << line.lines << "\n";
      // White below black: to be seen on every colour.
      const std::string index = std::to_string(block++);
      plot += ", 'data' index " + index + " using 1:2 with lines lw 4 lc rgb '#ffffff', '' index " + index +
              " using 1:2 with lines lw 1.6 lc rgb '#000000'";
      const std::array<double, 2> place = place_in(map, line.label_x, line.label_y);
      if (!is_room(labelled, place)) continue;
      labelled.push_back(place);
      gp << "set label " << label++ << " '" << level << "' at graph " << std::clamp(place[0], 0.08, 0.92) << ", graph "
         << std::clamp(place[1], 0.08, 0.92) << " center front font 'sans,17' boxed\n";
    }
    gp << "set style textbox opaque noborder fillcolor rgb '#ffffff'\n" << plot << "\nunset label\n";
  }
  gp << "unset multiplot\n";
  return controller::draw_svg("gnuplot", gp.str(), data.str(), svg);
}

}  // namespace proxarm::studies
