// What `proxarm identify --joints` has found: told in words and as JSON, compared with the cell, and written into it.
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
  std::string failure;  // what ended the session, or why the result isn't to be believed; empty: nothing
  bool real_arm = false;

  [[nodiscard]] bool found() const noexcept;  // some figure, and no failure
};

// A figure of a joint beside the cell's.
struct JointFigure {
  std::string joint, key;  // the latter within its drive, such as simulation.coulomb_friction_Nm
  std::string unit;
  double in_cell = 0.0;
  identification::Estimate estimate;

  [[nodiscard]] bool differs() const noexcept;  // by more than the interval; false where nothing was found
};

// All five of each joint, in the order of the drives. Precondition: no failure.
std::vector<JointFigure> figures(const IdentifiedJoints& joints, const description::Cell& cell);

// `compare`: whether the cell's values are told beside them.
std::string text(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);
description::Json json(const IdentifiedJoints& joints, const std::vector<JointFigure>& figures, bool compare);

// Writes what was found to the cell's file; everything else stays as it is. Returns the path of its backup. Throws
// SetupError where a key isn't in the file or stands where it can't be changed; then nothing is written.
std::filesystem::path write_joints(const std::vector<JointFigure>& figures, const PreparedSession& session);

}  // namespace proxarm::command_line
