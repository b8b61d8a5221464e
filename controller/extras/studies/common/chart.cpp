#include "controller/extras/studies/common/chart.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "controller/drawing/gnuplot.hpp"
#include "controller/drawing/palette.hpp"
#include "controller/extras/studies/common/chart_page.hpp"

namespace proxarm::studies {
namespace {

void define_styles(std::ostream& gp) {
  int number = 0;
  for (const controller::SeriesStyle& s : controller::series_styles()) {
    gp << "set style line " << ++number << " lc rgb '" << s.colour << "' lw " << s.width << " pt " << s.mark << " "
       << controller::gnuplot_dash(s.dash) << "\n";
  }
  gp << "set grid lc rgb " << rgb("line") << " lt 1 lw 0.6\n";
}

std::size_t style_of(const Curve& curve) {
  return static_cast<std::size_t>(curve.style) % controller::series_styles().size() + 1;
}

// Sets ticks at the given places. If there are none, sets them at every other decade for an axis of many decades, else
// where gnuplot puts them.
void ticks(std::ostream& gp, char axis, const std::vector<double>& places, bool many_decades) {
  if (!places.empty()) return set_ticks(gp, axis, places);
  gp << "set " << axis << "tics " << (many_decades ? "100\n" : "auto\n");
}

void set_axis(std::ostream& gp, char axis, double low, double high, bool log, const std::vector<double>& places) {
  gp << (log ? "set" : "unset") << " logscale " << axis << "\n";
  const bool readable = low >= 1e-3 && high <= 1.1e4 && low < high;
  gp << "set format " << axis << (log && !readable ? " '10^{%L}'\n" : " '%g'\n");
  if (low < high) {
    gp << "set " << axis << "range [" << low << ":" << high << "]\n";
  } else {
    gp << "set " << axis << "range [*:*]\n";
  }
  gp << "set " << axis << "tics font ',17'\n";
  ticks(gp, axis, places, log && low > 0.0 && high / low > 1e6);
}

constexpr std::size_t name_width = 9;  // in letters

void name_places(std::ostream& gp, const std::vector<std::string>& names) {
  gp << "set xtics (";
  for (std::size_t i = 0; i < names.size(); ++i) {
    gp << (i == 0 ? "" : ", ") << stacked(wrapped(names[i], name_width)) << " " << i;
  }
  gp << ") font ',15'\nset xrange [-0.5:" << static_cast<double>(names.size()) - 0.5 << "]\n";
}

void draw_grounds(std::ostream& gp, const Panel& panel, int& label) {
  int number = 0;
  for (const Span& span : panel.x_spans) {
    gp << "set object " << ++number << " rectangle from first " << span.from << ", graph 0 to first " << span.to
       << ", graph 1 behind fillcolor rgb " << rgb("world-top") << " fillstyle solid noborder\n";
    if (span.text.empty()) continue;
    gp << "set label " << ++label << " " << plain(span.text) << " at first " << 0.5 * (span.from + span.to)
       << ", graph 1.0 center offset 0,0.5 font ',15' textcolor rgb " << rgb("soft") << "\n";
  }
  for (const Span& span : panel.y_spans) {
    gp << "set object " << ++number << " rectangle from graph 0, first " << span.from << " to graph 1, first "
       << span.to << " behind fillcolor rgb " << rgb("world-top") << " fillstyle solid noborder\n";
    if (span.text.empty()) continue;
    const double middle = panel.log_y ? std::sqrt(span.from * span.to) : 0.5 * (span.from + span.to);
    gp << "set label " << ++label << " " << plain(span.text) << " at graph 0.99, first " << middle
       << " right font ',14' textcolor rgb " << rgb("soft") << "\n";
  }
  for (const Level& level : panel.levels) {
    gp << "set arrow from graph 0, first " << level.at << " to graph 1, first " << level.at << " nohead lc rgb "
       << rgb("soft") << " lw 1.4 dt (3,3)\nset label " << ++label << " " << plain(level.text) << " at graph 1, first "
       << level.at << " left offset 0.6,0 font ',15' textcolor rgb " << rgb("ink") << "\n";
  }
  for (const Level& upright : panel.uprights) {
    gp << "set arrow from first " << upright.at << ", graph 0 to first " << upright.at << ", graph 1 nohead lc rgb "
       << rgb("soft") << " lw 1.4 dt (3,3)\nset label " << ++label << " " << plain(upright.text) << " at first "
       << upright.at << ", graph 1 left offset 0.5,-0.9 font ',15' textcolor rgb " << rgb("ink") << "\n";
  }
}

void draw_note(std::ostream& gp, const Note& note, int label) {
  struct Placed {
    const char *align, *offset;
  };
  const auto placed = [&note]() -> Placed {
    switch (note.side) {
      case Note::Side::right:
        return {"left", "1.9,0"};
      case Note::Side::left:
        return {"right", "-1.9,0"};
      case Note::Side::above:
        return {"center", "0,1.2"};
      case Note::Side::below:
        return {"center", "0,-1.2"};
      case Note::Side::on:
        break;
    }
    return {"center", "0,0"};
  }();
  gp << "set label " << label << " " << (note.ring ? bold(note.text) : plain(note.text)) << " at first " << note.x
     << ", first " << note.y << " " << placed.align << " front offset " << placed.offset << " font ',16' textcolor rgb "
     << rgb("ink") << " boxed\n";
}

// Writes one point per line. A point whose y isn't finite leaves a gap in the curve.
void write_points(std::ostream& data, const Curve& curve) {
  for (std::size_t k = 0; k < curve.x.size(); ++k) {
    if (std::isfinite(curve.y[k])) {
      data << curve.x[k] << " " << curve.y[k] << "\n";
    } else {
      data << "\n";
    }
  }
  data << "\n\n";
}

// Returns how gnuplot is to draw a curve, for example "with lines ls 2".
std::string look_of(const Curve& curve, double mark_size) {
  return std::string("with ") + (curve.line ? (curve.marks ? "linespoints" : "lines") : "points") + " ls " +
         std::to_string(style_of(curve)) + (curve.marks ? " ps " + std::to_string(mark_size) : "");
}

// Returns gnuplot's plot entries for a panel's curves, and for the rings around the panel's notes. Appends the points
// of each entry to `data` as a block.
std::vector<std::string> plots_of(const Panel& panel, std::ostream& data, std::size_t& block) {
  std::vector<std::string> plots;
  const auto add = [&](const Curve& curve, const std::string& look) {
    if (curve.x.empty()) return;
    write_points(data, curve);
    plots.push_back("'data' index " + std::to_string(block++) + " using 1:2 " + look + " notitle");
  };
  for (const Curve& curve : panel.curves) add(curve, look_of(curve, curve.mark_size));
  Curve rings;
  for (const Note& note : panel.notes) {
    if (!note.ring) continue;
    rings.x.push_back(note.x);
    rings.y.push_back(note.y);
  }
  add(rings, "with points pt 6 ps 2.2 lw 2.6 lc rgb " + rgb("ink"));
  return plots;
}

// Returns gnuplot's plot entries for the key, one for each name of a curve in any panel. gnuplot draws these entries
// with the first panel, without data.
std::vector<std::string> key_entries(const Chart& chart, std::size_t& longest) {
  std::vector<std::string> entries;
  std::set<std::string> named;
  for (const Panel& panel : chart.panels) {
    for (const Curve& curve : panel.curves) {
      if (!chart.key || curve.name.empty() || curve.x.empty() || !named.insert(curve.name).second) continue;
      longest = std::max(longest, letters(curve.name));
      entries.push_back("NaN " + look_of(curve, 1.1) + " title " + plain(curve.name));
    }
  }
  return entries;
}

constexpr double key_line = 24.0;

struct Layout {
  std::vector<Frame> frames;
  double key_top = 0.0, height = 0.0;
  std::size_t key_rows = 0;
};

bool has_words_above(const Panel& panel) {
  return std::ranges::any_of(panel.x_spans, [](const Span& span) { return !span.text.empty(); });
}

double room_above(const Panel& panel) {
  return 12.0 + (panel.title.empty() ? 0.0 : 26.0) + (has_words_above(panel) ? 20.0 : 0.0);
}

double room_below(const Panel& panel) {
  std::size_t lines = 1;
  for (const std::string& name : panel.x_names) lines = std::max(lines, wrapped(name, name_width).size());
  return 12.0 + 19.0 * static_cast<double>(lines) + (panel.x_label.empty() ? 8.0 : 38.0);
}

double room_right(const Panel& panel) {
  std::size_t longest = 0;
  for (const Level& level : panel.levels) longest = std::max(longest, letters(level.text));
  return 30.0 + 9.0 * static_cast<double>(longest);
}

Layout layout_of(const Chart& chart, double top, std::size_t entries, std::size_t longest) {
  constexpr double room_left = 96.0;
  Layout layout;
  double y = top;
  std::size_t i = 0;
  while (i < chart.panels.size()) {
    const bool wide = chart.first_wide && i == 0;
    const std::size_t columns = wide ? 1 : static_cast<std::size_t>(chart.columns);
    const std::size_t end = std::min(i + columns, chart.panels.size());
    double above = 0.0, below = 0.0, right = 0.0;
    if (chart.columns == 1) {  // panels below each other get frames of the same width
      for (const Panel& panel : chart.panels) right = std::max(right, room_right(panel));
    }
    for (std::size_t k = i; k < end; ++k) {
      above = std::max(above, room_above(chart.panels[k]));
      below = std::max(below, room_below(chart.panels[k]));
      right = std::max(right, room_right(chart.panels[k]));
    }
    const double width = chart.width / static_cast<double>(columns);
    const double height = (wide ? 1.35 : 1.0) * chart.panel_height;
    for (std::size_t k = i; k < end; ++k) {
      const double left = static_cast<double>(k - i) * width;
      layout.frames.push_back({left + room_left, y + above, left + width - right, y + above + height});
    }
    y += above + height + below;
    i = end;
  }
  layout.key_top = y;
  if (entries > 0) {
    const double entry_width = 96.0 + 9.2 * static_cast<double>(longest);
    const auto abreast = std::max<std::size_t>(1, static_cast<std::size_t>(chart.width / entry_width));
    layout.key_rows = (entries + abreast - 1) / abreast;
    y += key_line * static_cast<double>(layout.key_rows) + 8.0;
  }
  layout.height = y + 8.0;
  return layout;
}

// Sets everything of a panel except the curves.
void set_panel(std::ostream& gp, const Panel& panel) {
  set_axis(gp, 'x', panel.x_low, panel.x_high, panel.log_x, panel.x_ticks);
  set_axis(gp, 'y', panel.y_low, panel.y_high, panel.log_y, panel.y_ticks);
  if (!panel.x_names.empty()) name_places(gp, panel.x_names);
  gp << "set title " << bold(panel.title) << " offset 0," << (has_words_above(panel) ? 0.6 : -0.4)
     << " font ',17' textcolor rgb " << rgb(panel.title_colour.c_str()) << "\nset xlabel " << plain(panel.x_label)
     << " offset 0,0.3\nset ylabel " << plain(panel.y_label) << " offset "
     << (panel.log_y && panel.y_low < 1e-3 ? 1.6 : 0.6) << ",0\nunset arrow\nunset object\n";
  int label = 0;
  draw_grounds(gp, panel, label);
  for (const Note& note : panel.notes) {
    if (!note.text.empty()) draw_note(gp, note, ++label);
  }
}

}  // namespace

std::string draw(const Chart& chart, const std::filesystem::path& svg) {
  std::size_t longest = 0;
  const std::vector<std::string> entries = key_entries(chart, longest);
  Page page(chart.title, chart.subtitle, chart.width);
  const Layout layout = layout_of(chart, page.top(), entries.size(), longest);
  std::ostringstream gp, data;
  data.precision(8);
  page.begin(gp, layout.height);
  define_styles(gp);
  gp << "set style textbox opaque noborder fillcolor rgb '#ffffff' margins 0.3,0.3\n";
  std::size_t block = 0;
  for (std::size_t i = 0; i < chart.panels.size(); ++i) {
    page.set_frame(gp, layout.frames[i]);
    set_panel(gp, chart.panels[i]);
    std::vector<std::string> plots = plots_of(chart.panels[i], data, block);
    if (i == 0 && !entries.empty()) {
      gp << "set key at screen 0.5, screen "
         << page.screen_y(layout.key_top + 0.5 * key_line * static_cast<double>(layout.key_rows))
         << " center vertical maxrows " << layout.key_rows << " samplen 3.2 Left reverse font ',15'\n";
      plots.insert(plots.end(), entries.begin(), entries.end());
    } else {
      gp << "unset key\n";
    }
    for (std::size_t k = 0; k < plots.size(); ++k) gp << (k == 0 ? "plot " : ", ") << plots[k];
    gp << "\nunset label\n";
  }
  gp << "unset multiplot\n";
  return controller::draw_svg("gnuplot", gp.str(), data.str(), svg);
}

}  // namespace proxarm::studies
