// Runs `proxarm calibrate`, which finds the zeros of the encoders.
#pragma once

#include <filesystem>
#include <vector>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct CalibrateOptions {
  controller::RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  // For each pose, the angles of all joints as marked on the arm. Empty: one pose, start_rad.
  std::vector<std::vector<double>> at;
  bool home = false;  // move the joints with incremental encoders to their home
  // Largest difference that is allowed between marks and encoders, in the poses after the first.
  double tolerance_rad = 0.01;
};

// Finds the zeros and writes them into the cell. Returns the exit status, which is 1 if the poses don't fit one
// another; then the cell is unchanged.
int calibrate(const controller::PreparedSession& session, const controller::PreparedSession& arm,
              const CalibrateOptions& options);

}  // namespace proxarm::command_line
