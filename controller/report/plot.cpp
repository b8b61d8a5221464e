#include "controller/report/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

#include "controller/drawing/gnuplot.hpp"
#include "controller/drawing/palette.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;
using models::Vec3;

constexpr std::size_t most_samples = 4000;
constexpr double nothing_rad = 1e-6;  // a smaller turn has no reliable axis; turns are known to 1e-9 rad

// Sizes in the picture, in pixels.
constexpr double head = 112.0, row_height = 236.0, between_rows = 21.0, foot = 108.0;

}  // namespace

double PlotBuilder::height_px() const noexcept { return head + row_height * rows() + foot; }

// Places the next panel in this row.
void PlotBuilder::place(std::ostream& gp, int row) const {
  const double top = head + row_height * row, bottom = top + row_height - between_rows;
  gp << "set tmargin at screen " << 1.0 - top / height_px() << "\nset bmargin at screen " << 1.0 - bottom / height_px()
     << "\n";
}

// Coordinates of the position panels: `directions` from `origin`.
struct PlotBuilder::Axes {
  bool wall = false;  // true: directions[0] is the normal, directions[1] is along the slide
  Vec3 origin = Vec3::Zero();
  std::array<Vec3, 3> directions{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  Vec3 turn = Vec3::UnitZ();  // axis of the shown rotations and torques
};

struct PlotBuilder::Range {
  double low, high;
};

struct PlotBuilder::Ranges {
  Range force_N, torque_Nm;
  double near_mm;
};

struct PlotBuilder::Band {
  double from_s, to_s;
  ContactPhase contact;
};

PlotBuilder::PlotBuilder(std::string title, std::string gnuplot)
    : title_(std::move(title)), gnuplot_(std::move(gnuplot)) {}

void PlotBuilder::add(const CycleRecord& record) {
  if (record.phase != Phase::rendering) return;
  if (vec3(record.contact_force_W_N).norm() > vec3(peak_.contact_force).norm()) {
    peak_.time_s = 1e-9 * static_cast<double>(record.time_ns);
    peak_.contact_force = record.contact_force_W_N;
  }
  if (seen_++ % stride_ != 0) return;
  if (samples_.size() >= most_samples) {
    // Halves the resolution of the samples so far and of those to come.
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
  sample.normal = record.contacts[0].normal_W;
  sample.proxy_q = record.proxy_q_W;
  sample.tool_q = truth ? record.true_tool_q_W : record.proxy_q_W;
  sample.torque = record.torque_W_Nm;
  sample.contact_torque = record.contact_torque_W_Nm;
  turns_ = turns_ || record.proxy_inertia_kg_m2 > 0.0;
  samples_.push_back(sample);
}

PlotBuilder::Axes PlotBuilder::axes() const {
  Axes axes;
  axes.turn = turning_axis(turns(&Sample::proxy_q));
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
  // Nothing slid, so any direction along the wall serves.
  if (!(farthest.norm() > 1e-6)) farthest = n.unitOrthogonal();
  axes.wall = true;
  axes.origin = vec3(first->proxy);
  axes.directions = {n, farthest.normalized(), n.cross(farthest.normalized())};
  return axes;
}

// Returns the rotation vectors in W since the first sample. Of equivalent rotation vectors, takes the one nearest to
// the last sample's.
std::vector<Vec3> PlotBuilder::turns(std::array<double, 4> Sample::*orientation) const {
  std::vector<Vec3> turns;
  const models::Quaternion first = models::Quaternion((samples_.front().*orientation).data());
  Vec3 before = Vec3::Zero();
  for (const Sample& s : samples_) {
    Vec3 turn = models::rotation_vector(models::Quaternion((s.*orientation).data()) * first.conjugate());
    // A whole revolution: its axis is lost to rounding, so the last sample's axis is taken.
    const bool whole = turn.norm() < nothing_rad && before.norm() > 1.0;
    const Vec3 revolution = 2.0 * std::numbers::pi * (whole ? before : turn).stableNormalized();
    if (!turn.isZero(0.0) || whole)
      turn += std::round((before - turn).dot(revolution) / revolution.squaredNorm()) * revolution;
    turns.push_back(before = turn);
  }
  return turns;
}

// Returns the axis of the widest turn; if nothing turned, the axis of the largest torque. The axis's largest coordinate
// is positive.
Vec3 PlotBuilder::turning_axis(const std::vector<Vec3>& turns) const {
  const auto less = [](const Vec3& a, const Vec3& b) { return a.squaredNorm() < b.squaredNorm(); };
  Vec3 most = *std::max_element(turns.begin(), turns.end(), less);
  if (!(most.norm() > nothing_rad)) {
    for (const Sample& s : samples_) most = std::max({most, vec3(s.torque), vec3(s.contact_torque)}, less);
  }
  if (most.isZero(0.0)) return Vec3::UnitZ();
  Eigen::Index largest = 0;
  most.cwiseAbs().maxCoeff(&largest);
  return most[largest] < 0.0 ? Vec3(-most.normalized()) : Vec3(most.normalized());
}

// Returns the contact phases as intervals. An interval too short to be seen is merged with the interval before it.
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

// Returns the lines of the data file. Columns: time; tool ×3 and proxy ×3 (mm); push of the hand, contact force,
// friction (N); rotation of tool, rotation of proxy (°); torque of hand, torque of contact (Nm).
std::string PlotBuilder::data(const Axes& axes) const {
  const std::vector<Vec3> tool_turns = turns(&Sample::tool_q), proxy_turns = turns(&Sample::proxy_q);
  constexpr double degrees = 180.0 / std::numbers::pi;
  std::string text;
  char line[400];
  for (std::size_t k = 0; k < samples_.size(); ++k) {
    const Sample& s = samples_[k];
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
    const Vec3& a = axes.turn;
    std::snprintf(line, sizeof line, "%.6f %.6g %.6g %.6g %.6g %.6g %.6g %.5g %.5g %.5g %.6g %.6g %.5g %.5g\n",
                  s.time_s, x[0], x[1], x[2], x[3], x[4], x[5], forces[0], forces[1], forces[2],
                  degrees * a.dot(tool_turns[k]), degrees * a.dot(proxy_turns[k]), a.dot(vec3(s.torque)),
                  a.dot(vec3(s.contact_torque)));
    text += line;
  }
  return text;
}

// Returns the range of a panel without single peaks: the impulse of an impact is M v/T, hundreds of newtons in one
// step. The margin beside the values is a tenth of their range, and of at least `least`.
PlotBuilder::Range PlotBuilder::without_peaks(std::vector<double> values, double least) {
  std::sort(values.begin(), values.end());
  const auto rank = [&values](double part) {
    return values[static_cast<std::size_t>(part * (static_cast<double>(values.size()) - 1.0))];
  };
  const double low = std::min(0.0, rank(0.005)), high = std::max(0.0, rank(0.995));
  const double margin = 0.1 * std::max(high - low, least);
  return {low - margin, high + margin};
}

// The range of the panel "near" shows the tool's depth in the wall.
PlotBuilder::Ranges PlotBuilder::ranges(const Axes& axes) const {
  const Vec3 n = axes.directions[0];
  std::vector<double> forces, torques;
  double deepest_mm = 0.0;
  for (const Sample& s : samples_) {
    torques.insert(torques.end(), {axes.turn.dot(vec3(s.torque)), axes.turn.dot(vec3(s.contact_torque))});
    if (axes.wall) {
      forces.insert(forces.end(), {-n.dot(vec3(s.hand)), n.dot(vec3(s.contact_force))});
      if (s.contact != ContactPhase::free) {
        deepest_mm = std::max(deepest_mm, std::abs(1e3 * n.dot(vec3(s.tool) - axes.origin)));
      }
    } else {
      forces.insert(forces.end(), s.hand.begin(), s.hand.end());
    }
  }
  return {without_peaks(forces, 1.0), without_peaks(torques, 0.01), std::clamp(1.3 * deepest_mm, 0.2, 20.0)};
}

std::string PlotBuilder::script(const Axes& axes, const std::string& answer) const {
  std::ostringstream gp;
  const std::string hand = css(on_white(colour("hand").light));
  const double from = samples_.front().time_s, to = std::max(samples_.back().time_s, from + 1e-3);
  gp << "set terminal svg size 1200," << height_px() << " font 'sans,21' background 'white' noenhanced\n"
     << "set output 'plot.svg'\nset encoding utf8\n"
     << "set style line 1 " << gnuplot_line("tool") << " lw 3.2\nset style line 2 " << gnuplot_line("proxy")
     << " lw 1.8\nset style line 3 " << gnuplot_line("contact") << " lw 2.4\nset style line 4 "
     << gnuplot_line("friction") << " lw 2.8\nset style line 5 " << gnuplot_line("hand")
     << " lw 3.2\n"
     // Styles 6 and 7 are for y and z of the hand's force, without a wall.
     << "set style line 6 lc rgb '" << hand << "' lw 2.4 dt (10,5)\nset style line 7 lc rgb '" << hand
     << "' lw 2.8 dt (2,4)\n"
     << "set xrange [" << from << ":" << to << "]\nset grid lc rgb '#b0b0b0' lw 0.6\n"
     << "set lmargin 11\nset rmargin 3\nset format x ''\n";
  const double top = 1.0 - 23.0 / height_px();
  const std::string labels = shade_contacts(gp, 0.04 * (to - from));
  const double second = 1.0 - 56.0 / height_px();  // height of the second line
  gp << "set multiplot\nset label 100000 " << gnuplot_string(answer.empty() ? title_ : answer)
     << " at screen 0.02, screen " << top << " left font 'sans,23'\nset label 100001 "
     << gnuplot_string(answer.empty() ? "" : title_) << " at screen 0.02, screen " << second
     << " left font 'sans,19' textcolor rgb '" << colour("soft").light << "'\n"
     << labels << "set key at screen 0.97, screen " << second << " horizontal maxrows 1 samplen 3\n";
  const Ranges range = ranges(axes);
  draw_positions(gp, axes.wall, range);
  if (turns_) draw_turn(gp, axes.turn, range.torque_Nm);
  label_peak(gp, axes, range.force_N);
  draw_forces(gp, axes.wall, range);
  return gp.str();
}

// Returns the labels of the phases that are long enough for a label.
std::string PlotBuilder::shade_contacts(std::ostream& gp, double shortest_labelled_s) const {
  int object = 0;
  std::ostringstream labels;
  for (const Band& band : bands()) {
    if (band.contact == ContactPhase::free) continue;
    const bool slip = band.contact == ContactPhase::slip;
    gp << "set object " << ++object << " rectangle from " << band.from_s << ", graph 0 to " << band.to_s
       << ", graph 1 fillcolor rgb '" << css(on_white(colour(slip ? "shade-slip" : "shade-stick").light))
       << "' fillstyle solid noborder behind\n";
    if (band.to_s - band.from_s <= shortest_labelled_s) continue;
    labels << "set label " << object << " '" << contact_phase_name(band.contact) << "' at "
           << 0.5 * (band.from_s + band.to_s) << ", graph 1.07 center\n";
  }
  return labels.str();
}

void PlotBuilder::draw_positions(std::ostream& gp, bool wall, const Ranges& range) const {
  const char* const tool = truth_ ? "tool" : "tool (by encoders)";
  const auto panel = [this, &gp, tool](int row, const char* ylabel, int tool_column) {
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

// Draws the rotation of the proxy, and of the tool if the tool is simulated.
void PlotBuilder::draw_turn(std::ostream& gp, const Vec3& axis, const Range& torque_Nm) const {
  char about[80];
  const auto hundredths = [](double x) { return 0.01 * std::round(100.0 * x) + 0.0; };  // also turns −0 into 0
  std::snprintf(about, sizeof about, "about (%.2f, %.2f, %.2f)", hundredths(axis.x()), hundredths(axis.y()),
                hundredths(axis.z()));
  place(gp, 3);
  gp << "set ylabel 'turn (°)' offset 1\nset label 1 '" << about
     << "' at graph 0.01, graph 0.92 left front\nplot 'data' ";
  if (truth_) gp << "using 1:11 with lines ls 1 notitle, '' ";
  gp << "using 1:12 with lines ls 2 notitle\nunset label 1\n";
  place(gp, 4);
  gp << "set ylabel 'torque (Nm)' offset 1\nset key inside top right horizontal maxrows 1 samplen 3\n"
     << "set yrange [" << torque_Nm.low << ":" << torque_Nm.high << "]\n"
     << "plot 'data' using 1:13 with lines ls 5 title 'hand', '' using 1:14 with lines ls 3 title 'contact'\n";
}

void PlotBuilder::draw_forces(std::ostream& gp, bool wall, const Ranges& range) const {
  const std::array<const char*, 3> at_wall{"hand, into wall", "contact, normal", "friction"};
  const std::array<const char*, 3> anywhere{"hand, x", "hand, y", "hand, z"};
  const auto& names = wall ? at_wall : anywhere;
  place(gp, rows() - 1);
  gp << "set format x\nset label 1 'time (s)' at graph 0.5, graph -0.27 center\n"
     << "set yrange [" << range.force_N.low << ":" << range.force_N.high << "]\nset ylabel 'force (N)' offset 1\n"
     << "set key at screen 0.97, screen " << 40.0 / height_px() << " horizontal maxrows 1 samplen 3\n"
     << "plot 'data' using 1:8 with lines ls 5 title '" << names[0] << "', '' using 1:9 with lines ls "
     << (wall ? 3 : 6) << " title '" << names[1] << "', '' using 1:10 with lines ls " << (wall ? 4 : 7) << " title '"
     << names[2] << "'\nunset multiplot\n";
}

// Labels the largest contact force if it leaves the panel: the force of an impact is M v/T in a single cycle.
void PlotBuilder::label_peak(std::ostream& gp, const Axes& axes, const Range& range) const {
  const double peak_N = axes.directions[0].dot(vec3(peak_.contact_force));
  if (!axes.wall || !(peak_N > range.high)) return;
  const double middle_s = 0.5 * (samples_.front().time_s + samples_.back().time_s);
  char text[40];
  std::snprintf(text, sizeof text, peak_.time_s > middle_s ? "%.3g N ▲" : "▲ %.3g N", peak_N);
  gp << "set label 2 '" << text << "' at " << peak_.time_s << ", graph 0.92 "
     << (peak_.time_s > middle_s ? "right offset 0.5,0" : "left offset -0.5,0") << " front\n";
}

std::string PlotBuilder::write(const fs::path& svg, const std::string& answer) const {
  if (is_empty()) return "no plot: nothing was rendered";
  const Axes drawn = axes();
  return draw_svg(gnuplot_, script(drawn, answer), data(drawn), svg);
}

}  // namespace proxarm::controller
