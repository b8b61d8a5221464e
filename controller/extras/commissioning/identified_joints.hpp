// Prints the result of `proxarm identify --joints` as text and JSON, compares it with the cell, and writes it into the
// cell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/identification/joints/joint_fit.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {

struct IdentifiedJoints {
  identification::JointsFit fit;
  std::string failure;  // why the session ended early, or why the result isn't credible; empty: no failure
  bool real_arm = false;

  [[nodiscard]] bool found() const noexcept;  // whether any value was found, and there was no failure
};

// One quantity of a joint: the identified value and the cell's value.
struct JointFigure {
  std::string joint, key;  // key: in the drive's map, such as simulation.coulomb_friction_Nm
  std::string unit;
  double in_cell = 0.0;
  identification::Estimate estimate;

  // Returns whether the identified value and the cell's value differ by more than the interval. False if no value was
  // found.
  [[nodiscard]] bool differs() const noexcept;
};

// Returns the five figures of each joint, in the order of the drives. Precondition: `joints` has no failure.
std::vector<JointFigure> figures(const IdentifiedJoints& joints, const description::Cell& cell);

// Both functions return the result as text for output. `compare`: the cell's values are included.
std::string text(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);
description::Json json(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);

// Writes the values that were found into the cell's file; all other text stays. Returns the path of the file's backup.
// Throws SetupError if a key isn't in the file or can't be changed there; then nothing is written.
std::filesystem::path write_joints(const std::vector<JointFigure>& figures, const controller::PreparedSession& session);

}  // namespace proxarm::command_line
