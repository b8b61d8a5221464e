#include "controller/extras/studies/common/map_chart.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "controller/drawing/gnuplot.hpp"
#include "controller/drawing/palette.hpp"
#include "controller/extras/studies/common/chart_page.hpp"

namespace proxarm::studies {
namespace {

constexpr double map_left = 92.0, map_right = 14.0, map_above = 56.0, map_between = 44.0, map_below = 68.0,
                 scale_width = 96.0, note_height = 30.0;

// Returns gnuplot's palette of `steps` colours, each for one part of the scale. The colours are spaced evenly between
// the first and the last of map_colours().
std::string palette_steps(int steps) {
  const auto colours = controller::map_colours();
  std::string text;
  for (int i = 0; i < steps; ++i) {
    const double place = static_cast<double>(colours.size() - 1) * (steps > 1 ? i / (steps - 1.0) : 0.5);
    const auto before = std::min(static_cast<std::size_t>(place), colours.size() - 2);
    const double share = place - static_cast<double>(before);
    const controller::Rgb a = controller::on_white(colours[before]), b = controller::on_white(colours[before + 1]);
    const std::string colour =
        controller::css({a.r + share * (b.r - a.r), a.g + share * (b.g - a.g), a.b + share * (b.b - a.b)});
    for (const int end : {i, i + 1}) text += (text.empty() ? "" : ", ") + std::to_string(end) + " '" + colour + "'";
  }
  return text;
}

// Returns where the cell at grid line k ends: logarithmically halfway to the next line, and by the same ratio beyond
// the last line. `side` is negative for the lower end.
double edge(const std::vector<double>& grid, std::size_t k, double side) {
  const std::size_t last = grid.size() - 1;
  if (last == 0) return grid[0] * (side < 0.0 ? 0.9 : 1.1);
  const bool outer = side < 0.0 ? k == 0 : k == last;
  const std::size_t other = side < 0.0 ? (outer ? 1 : k - 1) : (outer ? last - 1 : k + 1);
  return outer ? grid[k] * std::sqrt(grid[k] / grid[other]) : std::sqrt(grid[k] * grid[other]);
}

// Returns one line per cell, for gnuplot's boxxyerror. For a map without cells, returns a line that isn't drawn.
std::string cells_of(const Map& map) {
  std::ostringstream cells;
  cells.precision(8);
  for (std::size_t row = 0; row < map.y.size(); ++row) {
    for (std::size_t column = 0; column < map.x.size(); ++column) {
      const double z = map.z[row * map.x.size() + column];
      if (!std::isfinite(z)) continue;
      cells << map.x[column] << " " << map.y[row] << " " << edge(map.x, column, -1.0) << " " << edge(map.x, column, 1.0)
            << " " << edge(map.y, row, -1.0) << " " << edge(map.y, row, 1.0) << " ";
      cells << z << "\n";
    }
  }
  return cells.str().empty() ? "1 1 1 1 1 1 nan\n" : cells.str();
}

// Sets everything of a map except the cells. `first`: the map is the first in its row. `lowest`: the map is the last in
// its column.
void set_map(std::ostream& gp, const MapChart& chart, const Map& map, bool first, bool lowest) {
  for (const auto& [axis, grid] : {std::pair{'x', &map.x}, std::pair{'y', &map.y}}) {
    gp << "set logscale " << axis << "\nset " << axis << "range [" << edge(*grid, 0, -1.0) << ":"
       << edge(*grid, grid->size() - 1, 1.0) << "]\n";
  }
  set_ticks(gp, 'x', chart.x_ticks);
  set_ticks(gp, 'y', chart.y_ticks);
  gp << "set format y '" << (first ? "%g" : "") << "'\nset title " << stacked(map.title)
     << " offset 0,-0.7 font ',16'\nset xlabel " << plain(lowest ? map.x_label : "") << " offset 0,0.3\nset ylabel "
     << plain(first ? map.y_label : "") << " offset 0.3,0\n";
  int label = 0;
  for (const Note& note : map.notes) {
    gp << "set label " << ++label << " " << bold(note.text) << " at graph 0.5, first " << note.y
       << (note.side == Note::Side::below ? " center front offset 0,-1.3" : " center front offset 0,1.3")
       << " boxed textcolor rgb " << rgb("ink") << "\n";
  }
}

}  // namespace

Scale scale_of(const MapChart& chart) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const Map& map : chart.maps) {
    for (const double z : map.z) {
      if (!std::isfinite(z) || !(z > 0.0)) continue;
      low = std::min(low, z);
      high = std::max(high, z);
    }
  }
  if (!(high > 0.0)) return {};
  const double from = std::floor(2.0 * std::log10(std::max(low, chart.z_least))) / 2.0;
  const double to = std::ceil(2.0 * std::log10(high)) / 2.0;
  return {std::pow(10.0, from), std::pow(10.0, std::max(to, from + 0.5)), low < chart.z_least};
}

namespace {

// Sets the scale of colours. Each colour is for half a decade, and there are ticks between the colours.
void set_scale(std::ostream& gp, const Scale& scale) {
  const auto halves = static_cast<int>(std::lround(2.0 * std::log10(scale.high / scale.low)));
  gp << "set palette defined (" << palette_steps(halves) << ")"
     << "\nset logscale cb\nset cbrange [" << scale.low << ":" << scale.high << "]\nset cbtics (";
  for (int i = 0; i <= halves; ++i) {
    const double z = scale.low * std::pow(10.0, 0.5 * i);
    gp << (i == 0 ? "" : ", ") << plain((i == 0 && scale.goes_below ? "≤ " : "") + number_text(z, 1)) << " " << z;
  }
  gp << ")\n";
}

struct MapLayout {
  std::size_t columns, rows;
  double top, width, frames_end;

  MapLayout(const MapChart& chart, double page_top)
      : columns(static_cast<std::size_t>(chart.columns)),
        rows(std::max<std::size_t>(1, (chart.maps.size() + columns - 1) / columns)),
        top(page_top + map_above),
        width((chart.width - map_left - scale_width) / static_cast<double>(columns)),
        frames_end(page_top + static_cast<double>(rows) * (map_above + chart.panel_height) +
                   static_cast<double>(rows - 1) * map_between) {}
  [[nodiscard]] Frame frame(const MapChart& chart, std::size_t i) const {
    const std::size_t row = i / columns;
    const double left = map_left + static_cast<double>(i % columns) * width;
    const double upper = top + static_cast<double>(row) * (map_above + chart.panel_height + map_between);
    return {left, upper, left + width - map_right, upper + chart.panel_height};
  }
};

void place_scale(std::ostream& gp, const MapChart& chart, const Page& page, const MapLayout& layout) {
  gp << "set label 1101 " << plain(chart.z_label) << " at screen "
     << page.screen_x(chart.width - 0.5 * scale_width - 4.0) << ", screen " << page.screen_y(layout.top - 18.0)
     << " center\nset colorbox user origin screen " << page.screen_x(chart.width - scale_width + 6.0) << ", screen "
     << page.screen_y(layout.frames_end) << " size screen " << page.screen_x(20.0) << ", screen "
     << page.screen_y(layout.top) - page.screen_y(layout.frames_end) << "\n";
}

// Draws a map's cells, and a white mark with a ring at each note.
void plot_map(std::ostream& gp, std::ostream& data, const Map& map, std::size_t& block) {
  data << cells_of(map) << "\n\n";
  gp << "plot 'data' index " << block++
     << " using 1:2:3:4:5:6:7 with boxxyerror fillstyle solid 1.0 border lc rgb '#ffffff' lw 0.6 lc palette";
  if (!map.notes.empty()) {
    for (const Note& note : map.notes) data << note.x << " " << note.y << "\n";
    data << "\n\n";
    const std::string index = std::to_string(block++);
    gp << ", 'data' index " << index << " using 1:2 with points pt 7 ps 1.5 lc rgb '#ffffff', '' index " << index
       << " using 1:2 with points pt 6 ps 1.5 lw 2.6 lc rgb " << rgb("ink");
  }
  gp << "\nunset label\n";
}

}  // namespace

std::string draw(const MapChart& chart, const std::filesystem::path& svg) {
  Page page(chart.title, chart.subtitle, chart.width);
  const MapLayout layout(chart, page.top());
  const double height = layout.frames_end + map_below + note_height;
  std::ostringstream gp, data;
  data.precision(8);
  page.begin(gp, height);
  set_scale(gp, scale_of(chart));
  gp << "set tics front\nset object 1 rectangle from graph 0, graph 0 to graph 1, graph 1 behind fillcolor rgb "
     << rgb("floor") << " fillstyle solid noborder\nset style textbox opaque noborder fillcolor rgb '#ffffff' margins "
     << "0.4,0.4\nset label 1100 " << plain(chart.note) << " at screen 0.5, screen " << page.screen_y(height - 16.0)
     << " center textcolor rgb " << rgb("ink") << "\nunset key\n";
  std::size_t block = 0;
  for (std::size_t i = 0; i < chart.maps.size(); ++i) {
    page.set_frame(gp, layout.frame(chart, i));
    set_map(gp, chart, chart.maps[i], i % layout.columns == 0, i + layout.columns >= chart.maps.size());
    if (i == 0) {
      place_scale(gp, chart, page, layout);
    } else {
      gp << "unset colorbox\n";
    }
    plot_map(gp, data, chart.maps[i], block);
  }
  gp << "unset multiplot\n";
  return controller::draw_svg("gnuplot", gp.str(), data.str(), svg);
}

}  // namespace proxarm::studies
