// Draws a session as a picture (SVG, by gnuplot): positions of tool and proxy, forces, and contact phases as bands.
//
// If there is a contact, positions are drawn along the first contact's normal, and along the direction in which the
// proxy slid farthest; the surface is at 0. If there is no contact, the panels show x, y and z. For a tool that turns,
// two more panels show rotations since the start, and torques about the rendered point, along the axis of the proxy's
// widest turn. Only Phase::rendering is drawn. Long sessions are thinned out to some thousand points, so memory is
// bounded. Curves differ in dash and width as well as in colour; sticking and slipping differ in shade and label.
//
// If gnuplot is missing, there is a warning instead of a picture. gnuplot is started without a shell, in a temporary
// folder, and its script quotes all paths and names that come from outside. Not for the cycle.
// and its script quotes all paths and names from outside. Not for the cycle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

class PlotBuilder {
 public:
  // `title`: one line of plain text above the picture. `gnuplot`: the program, looked up in PATH.
  explicit PlotBuilder(std::string title, std::string gnuplot = "gnuplot");

  void add(const CycleRecord& record);

  // Returns whether there is nothing to draw, because nothing was rendered.
  [[nodiscard]] bool is_empty() const noexcept { return samples_.size() < 2; }
  // Writes the SVG. Returns a warning of one line on failure, else an empty string. `answer` becomes the first line of
  // the picture; it is plot_headline() of a summary.
  [[nodiscard]] std::string write(const std::filesystem::path& svg, const std::string& answer = "") const;

 private:
  struct Sample {
    double time_s = 0.0;
    ContactPhase contact = ContactPhase::free;
    Triple tool{}, proxy{}, hand{}, contact_force{}, normal{};
    std::array<double, 4> tool_q{}, proxy_q{};  // x y z w
    Triple torque{}, contact_torque{};
  };
  struct Axes;
  struct Range;
  struct Ranges;
  struct Band;

  [[nodiscard]] Axes axes() const;
  [[nodiscard]] std::vector<models::Vec3> turns(std::array<double, 4> Sample::*orientation) const;
  [[nodiscard]] models::Vec3 turning_axis(const std::vector<models::Vec3>& turns) const;
  [[nodiscard]] std::vector<Band> bands() const;
  [[nodiscard]] std::string data(const Axes& axes) const;
  [[nodiscard]] static Range without_peaks(std::vector<double> values, double least);
  [[nodiscard]] Ranges ranges(const Axes& axes) const;
  [[nodiscard]] std::string script(const Axes& axes, const std::string& answer) const;
  void label_peak(std::ostream& gp, const Axes& axes, const Range& range) const;
  std::string shade_contacts(std::ostream& gp, double shortest_labelled_s) const;
  void draw_positions(std::ostream& gp, bool wall, const Ranges& range) const;
  void draw_turn(std::ostream& gp, const models::Vec3& axis, const Range& torque_Nm) const;
  void draw_forces(std::ostream& gp, bool wall, const Ranges& range) const;
  void place(std::ostream& gp, int row) const;
  [[nodiscard]] int rows() const noexcept { return turns_ ? 6 : 4; }
  [[nodiscard]] double height_px() const noexcept;

  std::string title_, gnuplot_;
  std::vector<Sample> samples_;
  Sample peak_{};  // the cycle with the largest contact force
  std::uint64_t stride_ = 1, seen_ = 0;
  bool truth_ = false, turns_ = false;
};

}  // namespace proxarm::controller
