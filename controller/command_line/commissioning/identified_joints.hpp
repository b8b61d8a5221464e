// The result of `proxarm identify --joints`: prints it as text and JSON, compares it with the cell, and writes it
// there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/identification/joints/joint_fit.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {

struct IdentifiedJoints {
  identification::JointsFit fit;
  std::string failure;  // why the session ended early, or why the result isn't credible; empty: no failure
  bool real_arm = false;

  [[nodiscard]] bool found() const noexcept;  // any value, and no failure
};

// An identified value of a joint and the cell's value.
struct JointFigure {
  std::string joint, key;  // the key within its drive, such as simulation.coulomb_friction_Nm
  std::string unit;
  double in_cell = 0.0;
  identification::Estimate estimate;

  [[nodiscard]] bool differs() const noexcept;  // by more than the interval; false if nothing was found
};

// All five values of each joint, in the order of the drives. Precondition: no failure.
std::vector<JointFigure> figures(const IdentifiedJoints& joints, const description::Cell& cell);

// `compare`: also print the cell's values.
std::string text(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);
description::Json json(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);

// Writes the values found to the cell's file; everything else stays. Returns the path of the backup. Throws SetupError
// if a key isn't in the file or can't be changed where it is; then nothing is written.
std::filesystem::path write_joints(const std::vector<JointFigure>& figures, const PreparedSession& session);

}  // namespace proxarm::command_line
