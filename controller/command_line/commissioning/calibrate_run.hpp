// `proxarm calibrate`: finds the zeros of the encoders.
#pragma once

#include <filesystem>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct CalibrateOptions {
  RunOptions run;
  std::filesystem::path arm;            // cell of the simulated arm; empty: the same cell
  std::vector<std::vector<double>> at;  // angles of all joints as marked on the arm; empty: start_rad, once
  bool home = false;                    // move incremental encoders to their home
  double tolerance_rad = 0.01;          // largest difference between marks and encoders, in the poses after the first
};

// Exit status 1: the poses don't fit one another; the cell is unchanged.
int calibrate(const PreparedSession& session, const PreparedSession& arm, const CalibrateOptions& options);

}  // namespace proxarm::command_line
