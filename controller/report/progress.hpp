// Shows the progress of a long run as one line on a terminal:
//   "  43 % [=========>           ]  4.3 of 10 s, sliding at 5.2 N"
//
// The line is drawn to standard error at most ten times a second, and only on a terminal that can move its cursor. Not
// for the cycle.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>

namespace proxarm::controller {

class Progress {
 public:
  // `total_s`: the run's length in seconds, or a number of things if `unit` names things. `stream` is for tests.
  explicit Progress(double total_s, std::FILE* stream = stderr, std::string unit = "s");
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress() { clear(); }

  // Draws the line: `done_s` of total_s are done. `note` follows, cut to the terminal's width.
  void update(double done_s, std::string_view note);
  // Removes the line. Must be called before anything else is printed.
  void clear();

  [[nodiscard]] bool enabled() const noexcept { return enabled_; }

 private:
  double total_s_;
  std::FILE* stream_;
  std::string unit_;
  bool enabled_ = false, drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

// Returns the line, at most `columns` wide.
std::string progress_line(double done_s, double total_s, std::string_view note, std::size_t columns,
                          std::string_view unit = "s");

}  // namespace proxarm::controller
