#include "controller/report/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "controller/report/gnuplot.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;
using models::Vec3;

constexpr std::size_t most_samples = 4000;

// The next panel is drawn in this row.
void place(std::ostream& gp, int row) {
  constexpr double top = 0.915, height = 0.205;
  gp << "set tmargin at screen " << top - height * row << "\nset bmargin at screen " << top - height * (row + 1) + 0.018
     << "\n";
}

}  // namespace

// What the position panels show: coordinates along `directions` from `origin`.
struct PlotBuilder::Axes {
  bool wall = false;  // directions[0] is the normal, directions[1] along the slide
  Vec3 origin = Vec3::Zero();
  std::array<Vec3, 3> directions{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
};

struct PlotBuilder::Ranges {
  double force_low_N, force_high_N, near_mm;
};

struct PlotBuilder::Band {
  double from_s, to_s;
  ContactPhase contact;
};

PlotBuilder::PlotBuilder(std::string title, std::string gnuplot)
    : title_(std::move(title)), gnuplot_(std::move(gnuplot)) {}

void PlotBuilder::add(const CycleRecord& record) {
  if (record.phase != Phase::rendering) return;
  if (seen_++ % stride_ != 0) return;
  if (samples_.size() >= most_samples) {
    // Twice as coarse from here on, and back to the start.
    for (std::size_t i = 0; 2 * i < samples_.size(); ++i) samples_[i] = samples_[2 * i];
    samples_.resize((samples_.size() + 1) / 2);
    stride_ *= 2;
  }
  const bool truth = record.has(RecordFlag::truth);
  truth_ = truth_ || truth;
  Sample sample;
  sample.time_s = 1e-9 * static_cast<double>(record.time_ns);
  sample.contact = record.contact;
  sample.tool = truth ? record.true_tool_W_m : record.tool_W_m;
  sample.proxy = record.proxy_W_m;
  sample.hand = record.force_W_N;
  sample.contact_force = record.contact_force_W_N;
  sample.normal = record.normal_W;
  samples_.push_back(sample);
}

PlotBuilder::Axes PlotBuilder::axes() const {
  Axes axes;
  const auto first = std::find_if(samples_.begin(), samples_.end(), [](const Sample& s) {
    return s.contact != ContactPhase::free && vec3(s.normal).norm() > 0.5;
  });
  if (first == samples_.end()) return axes;
  const Vec3 n = vec3(first->normal).normalized();
  Vec3 farthest = Vec3::Zero();
  for (auto s = first; s != samples_.end(); ++s) {
    const Vec3 d = vec3(s->proxy) - vec3(first->proxy), along = d - n.dot(d) * n;
    if (s->contact != ContactPhase::free && along.norm() > farthest.norm()) farthest = along;
  }
  // Nothing slid: any direction along the wall will do.
  if (!(farthest.norm() > 1e-6)) farthest = n.unitOrthogonal();
  axes.wall = true;
  axes.origin = vec3(first->proxy);
  axes.directions = {n, farthest.normalized(), n.cross(farthest.normalized())};
  return axes;
}

// Contact phases as intervals; one that is too short to be seen is added to the one before it.
std::vector<PlotBuilder::Band> PlotBuilder::bands() const {
  std::vector<Band> bands;
  const double shortest = (samples_.back().time_s - samples_.front().time_s) / 400.0;
  for (const Sample& s : samples_) {
    if (!bands.empty() && (bands.back().contact == s.contact)) {
      bands.back().to_s = s.time_s;
      continue;
    }
    if (bands.size() > 1 && bands.back().to_s - bands.back().from_s < shortest) {
      const double to = bands.back().to_s;
      bands.pop_back();
      bands.back().to_s = to;
      if (bands.back().contact == s.contact) {
        bands.back().to_s = s.time_s;
        continue;
      }
    }
    if (!bands.empty()) bands.back().to_s = s.time_s;
    bands.push_back({s.time_s, s.time_s, s.contact});
  }
  return bands;
}

// Columns: time, tool ×3, proxy ×3 (mm), push of the hand, contact force, friction (N).
std::string PlotBuilder::data(const Axes& axes) const {
  std::string text;
  char line[320];
  for (const Sample& s : samples_) {
    std::array<double, 6> x{};
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = 1e3 * axes.directions[i].dot(vec3(s.tool) - axes.origin);
      x[3 + i] = 1e3 * axes.directions[i].dot(vec3(s.proxy) - axes.origin);
    }
    const Vec3 h = vec3(s.hand), f = vec3(s.contact_force);
    std::array<double, 3> forces{h.x(), h.y(), h.z()};
    if (axes.wall) {
      const Vec3 n = axes.directions[0];
      forces = {-n.dot(h), n.dot(f), -axes.directions[1].dot(f)};
    }
    std::snprintf(line, sizeof line, "%.6f %.6g %.6g %.6g %.6g %.6g %.6g %.5g %.5g %.5g\n", s.time_s, x[0], x[1], x[2],
                  x[3], x[4], x[5], forces[0], forces[1], forces[2]);
    text += line;
  }
  return text;
}

// The force panel leaves out single peaks (the impulse of an impact is M v/T, hundreds of newtons in one step), the
// near panel shows the tool's depth in the wall.
PlotBuilder::Ranges PlotBuilder::ranges(const Axes& axes) const {
  const Vec3 n = axes.directions[0];
  std::vector<double> forces;
  double deepest_mm = 0.0;
  for (const Sample& s : samples_) {
    if (axes.wall) {
      forces.insert(forces.end(), {-n.dot(vec3(s.hand)), n.dot(vec3(s.contact_force))});
      if (s.contact != ContactPhase::free) {
        deepest_mm = std::max(deepest_mm, std::abs(1e3 * n.dot(vec3(s.tool) - axes.origin)));
      }
    } else {
      forces.insert(forces.end(), s.hand.begin(), s.hand.end());
    }
  }
  std::sort(forces.begin(), forces.end());
  const auto rank = [&forces](double part) {
    return forces[static_cast<std::size_t>(part * (static_cast<double>(forces.size()) - 1.0))];
  };
  const double low = std::min(0.0, rank(0.005)), high = std::max(0.0, rank(0.995));
  const double margin = 0.1 * std::max(high - low, 1.0);
  return {low - margin, high + margin, std::clamp(1.3 * deepest_mm, 0.2, 20.0)};
}

std::string PlotBuilder::script(const Axes& axes) const {
  std::ostringstream gp;
  const double from = samples_.front().time_s, to = std::max(samples_.back().time_s, from + 1e-3);
  gp << "set terminal svg size 1200,1150 font 'sans,21' background 'white' noenhanced\n"
     << "set output 'plot.svg'\nset encoding utf8\n"
     << "set style line 1 lc rgb '#0072b2' lw 3.2\n"           // tool: solid, wide, blue
     << "set style line 2 lc rgb '#000000' lw 1.8 dt (8,6)\n"  // proxy: dashed, thin, black
     << "set style line 3 lc rgb '#d55e00' lw 2.4 dt (10,5)\n"
     << "set style line 4 lc rgb '#009e73' lw 2.8 dt (2,4)\n"
     << "set xrange [" << from << ":" << to << "]\nset grid lc rgb '#b0b0b0' lw 0.6\n"
     << "set lmargin 11\nset rmargin 3\nset format x ''\n";
  const std::string labels = shade_contacts(gp, 0.04 * (to - from));
  gp << "set multiplot\nset label 100000 " << gnuplot_string(title_) << " at screen 0.02, screen 0.98 left\n"
     << labels << "set key at screen 0.97, screen 0.98 horizontal maxrows 1 samplen 3\n";
  const Ranges range = ranges(axes);
  draw_positions(gp, axes.wall, range);
  draw_forces(gp, axes.wall, range);
  return gp.str();
}

// Returns the labels of those that last long enough to bear one.
std::string PlotBuilder::shade_contacts(std::ostream& gp, double shortest_labelled_s) const {
  int object = 0;
  std::ostringstream labels;
  for (const Band& band : bands()) {
    if (band.contact == ContactPhase::free) continue;
    const bool slip = band.contact == ContactPhase::slip;
    gp << "set object " << ++object << " rectangle from " << band.from_s << ", graph 0 to " << band.to_s
       << ", graph 1 fillcolor rgb '" << (slip ? "#c9dff0" : "#e4e4e4") << "' fillstyle solid noborder behind\n";
    if (band.to_s - band.from_s <= shortest_labelled_s) continue;
    labels << "set label " << object << " '" << contact_phase_name(band.contact) << "' at "
           << 0.5 * (band.from_s + band.to_s) << ", graph 1.07 center\n";
  }
  return labels.str();
}

void PlotBuilder::draw_positions(std::ostream& gp, bool wall, const Ranges& range) const {
  const char* const tool = truth_ ? "tool" : "tool (by encoders)";
  const auto panel = [&gp, tool](int row, const char* ylabel, int tool_column) {
    place(gp, row);
    gp << "set ylabel '" << ylabel << "' offset 1\n"
       << "plot 'data' using 1:" << tool_column << " with lines ls 1 title '" << tool
       << "', '' using 1:" << tool_column + 3 << " with lines ls 2 title 'proxy'\n"
       << "unset key\nunset label\n";
  };
  if (wall) {
    panel(0, "from wall (mm)", 2);
    gp << "set yrange [" << -range.near_mm << ":" << range.near_mm << "]\n";
    panel(1, "same, near (mm)", 2);
    gp << "set yrange [*:*]\n";
    panel(2, "along wall (mm)", 3);
  } else {
    panel(0, "x (mm)", 2);
    panel(1, "y (mm)", 3);
    panel(2, "z (mm)", 4);
  }
}

void PlotBuilder::draw_forces(std::ostream& gp, bool wall, const Ranges& range) {
  const std::array<const char*, 3> at_wall{"hand, into wall", "contact, normal", "friction"};
  const std::array<const char*, 3> anywhere{"hand, x", "hand, y", "hand, z"};
  const auto& names = wall ? at_wall : anywhere;
  place(gp, 3);
  gp << "set format x\nset label 1 'time (s)' at graph 0.5, graph -0.27 center\n"
     << "set yrange [" << range.force_low_N << ":" << range.force_high_N << "]\nset ylabel 'force (N)' offset 1\n"
     << "set key at screen 0.97, screen 0.035 horizontal maxrows 1 samplen 3\n"
     << "plot 'data' using 1:8 with lines ls 1 title '" << names[0] << "', '' using 1:9 with lines ls 3 title '"
     << names[1] << "', '' using 1:10 with lines ls 4 title '" << names[2] << "'\nunset multiplot\n";
}

std::string PlotBuilder::write(const fs::path& svg) const {
  if (is_empty()) return "no plot: nothing was rendered";
  const Axes drawn = axes();
  return draw_svg(gnuplot_, script(drawn), data(drawn), svg);
}

}  // namespace proxarm::controller
