#include "controller/drawing/palette.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace proxarm::controller {
namespace {

constexpr Colour table[] = {
    // Colours of the page.
    {"paper", "#f5f7f9", "#10151b"},
    {"card", "#ffffff", "#171e26"},
    {"ink", "#17202a", "#e8edf2"},
    {"soft", "#515d69", "#9aa8b6"},
    {"line", "#d5dce3", "#2c3743"},
    {"accent", "#0072b2", "#56b4e9"},
    {"world-top", "#eef2f6", "#1d2630"},
    {"world-bottom", "#d9e0e7", "#0d1217"},
    // Colours of proxy, tool, hand and contacts.
    {"proxy", "#0072b2", "#56b4e9"},
    {"tool", "#803000", "#ffc61a"},
    {"hand", "#561a7d", "#d849f5"},
    {"stick", "#0072b2", "#56b4e9"},
    {"slip", "#cc5500", "#ff8c42"},
    {"shade-stick", "#0072b222", "#56b4e926"},
    {"shade-slip", "#cc550026", "#ff8c422e"},
    {"band", "#00724f1f", "#4fd1a524"},  // range of vibrations that a hand doesn't notice
    {"good", "#00724f", "#4fd1a5"},
    {"bad", "#a3001f", "#ff5c72"},
    {"bad-paper", "#fdecea", "#3a1a1a"},
    // Colours of the margin to instability, from the smallest margin to the largest.
    {"margin-1", "#a3001f", "#ff5c72"},
    {"margin-2", "#b35900", "#ffc61a"},
    {"margin-3", "#0072b2", "#56b4e9"},
    {"margin-4", "#0b2e52", "#e8edf2"},
    // Colours of bodies, which light shades; edges and grids keep the bodies distinct.
    {"arm", "#e3e8ed", "#8fa0b1"},
    {"arm-joint", "#94a3b2", "#5d6e80"},
    {"arm-edge", "#51606f", "#0b1016"},
    {"handle", "#d9923b", "#c98a2b"},
    {"tool-body", "#7c9bd0", "#7f9fd6"},
    {"solid", "#86bda8", "#4c8f78"},
    {"cavity", "#6fb59a", "#3f8f73"},
    {"solid-edge", "#1f5c47", "#9be0c5"},
    {"skin", "#e2b64b", "#d8b04a"},
    {"skin-edge", "#8a6410", "#d8b04a"},
    {"medium", "#8b9be0", "#7d8fd6"},
    {"floor", "#b3bdc7", "#3a4653"},
};

constexpr LineStyle lines[] = {
    {"tool", "tool", {}},         {"proxy", "proxy", {7, 4}},  {"hand", "hand", {}},      {"contact", "stick", {9, 4}},
    {"friction", "good", {2, 3}}, {"peaks", "soft", {2, 3}},   {"wanted", "ink", {2, 3}}, {"felt", "good", {}},
    {"energy", "hand", {7, 4}},   {"computing", "accent", {}},
};

constexpr SeriesStyle series[] = {
    {"#0072b2", 2.6, {}, 7},      {"#000000", 1.8, {9, 5}, 6},        {"#cc5500", 2.4, {14, 5}, 5},
    {"#00875f", 2.6, {2, 4}, 9},  {"#b0457f", 2.4, {12, 4, 2, 4}, 8}, {"#a87400", 2.4, {6, 3}, 13},
    {"#2f8fc7", 2.0, {4, 4}, 11}, {"#6f6f6f", 1.6, {20, 3}, 4},       {"#7a0177", 2.0, {16, 4, 2, 4, 2, 4}, 12},
    {"#7a4a08", 2.0, {3, 2}, 10},
};

constexpr std::array map_table{"#fff7bc", "#fee391", "#fec44f", "#fe9929", "#d95f0e", "#993404", "#5c1a02", "#1a0a30"};

template <typename Table>
const auto& named(const Table& table_of, std::string_view name) {
  const auto* const at =
      std::find_if(std::begin(table_of), std::end(table_of), [name](const auto& entry) { return name == entry.name; });
  assert(at != std::end(table_of));
  return *at;
}

double part(std::string_view css, std::size_t at) noexcept {
  const char digits[] = {css[at], css[at + 1], '\0'};
  return static_cast<double>(std::strtoul(digits, nullptr, 16)) / 255.0;
}

}  // namespace

std::span<const Colour> colours() noexcept { return table; }
std::span<const LineStyle> line_styles() noexcept { return lines; }
std::span<const SeriesStyle> series_styles() noexcept { return series; }
std::span<const char* const> map_colours() noexcept { return map_table; }

const Colour& colour(std::string_view name) { return named(table, name); }
const LineStyle& line_style(std::string_view name) { return named(lines, name); }

Rgb on_white(std::string_view css) noexcept {
  const double share = css.size() > 7 ? part(css, 7) : 1.0;
  const auto laid = [share](double x) { return 1.0 + share * (x - 1.0); };
  return {laid(part(css, 1)), laid(part(css, 3)), laid(part(css, 5))};
}

std::string css(const Rgb& colour) {
  char text[8];
  const auto byte = [](double x) { return static_cast<unsigned>(std::lround(255.0 * std::clamp(x, 0.0, 1.0))) & 255U; };
  std::snprintf(text, sizeof text, "#%02x%02x%02x", byte(colour.r), byte(colour.g), byte(colour.b));
  return text;
}

namespace {

std::string numbers(std::span<const double> dash, const char* between) {
  std::string text;
  for (const double length : dash) {
    if (!(length > 0.0)) break;
    char number[32];
    std::snprintf(number, sizeof number, "%s%g", text.empty() ? "" : between, length);
    text += number;
  }
  return text;
}

}  // namespace

std::string palette_css() {
  std::string light = ":root {", dark = ":root[data-theme=\"dark\"] {";
  const auto add = [](std::string& to, const std::string& name, const std::string& value) {
    to += " --" + name + ": " + value + ";";
  };
  for (const Colour& c : table) {
    add(light, c.name, c.light);
    add(dark, c.name, c.dark);
  }
  for (const LineStyle& line : lines) {
    const std::string name = line.name, dash = numbers(line.dash, " ");
    add(light, "line-" + name, colour(line.colour).light);
    add(dark, "line-" + name, colour(line.colour).dark);
    add(light, "dash-" + name, dash.empty() ? "0" : dash);
  }
  return light + " }\n" + dark + " }\n";
}

std::string gnuplot_dash(std::span<const double> dash) {
  const std::string lengths = numbers(dash, ",");
  return lengths.empty() ? "dt solid" : "dt (" + lengths + ")";
}

std::string gnuplot_line(std::string_view name) {
  const LineStyle& line = line_style(name);
  return "lc rgb '" + css(on_white(colour(line.colour).light)) + "' " + gnuplot_dash(line.dash);
}

}  // namespace proxarm::controller
