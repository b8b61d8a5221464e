// The result of `proxarm identify`: prints it as text and JSON, compares it with the cell, and writes it there.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/zero_file.hpp"
#include "controller/identification/identification.hpp"
#include "controller/proof/proof.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {

// A value in the cell or its CELL.zero, and the identified value.
struct ToolDifference {
  std::string key;
  std::vector<double> in_cell, found, half;  // half: half the width of the 95 % interval

  [[nodiscard]] bool differs() const noexcept;  // by more than the interval in any component
};

struct IdentifiedTool {
  identification::ToolFit fit;
  identification::Allowances allowances;
  std::string failure;    // why the session ended early, or why the result isn't credible; empty: no failure
  std::string not_shown;  // which values can't be identified, and why
  std::vector<proof::Reading> readings;
  bool real_arm = false;

  [[nodiscard]] bool found() const noexcept { return failure.empty() && fit.mass_found; }
  // Whether all values for the cell and its zero were found.
  [[nodiscard]] bool whole() const noexcept { return found() && fit.centre_found; }
};

// `zero`: the zero kept beside the cell, if any.
std::vector<ToolDifference> compare(const IdentifiedTool& tool, const description::Cell& cell,
                                    const std::optional<ZeroFile>& zero);

std::string text(const IdentifiedTool& tool);
std::string text(const std::vector<ToolDifference>& differences);
description::Json json(const IdentifiedTool& tool);
description::Json json(const std::vector<ToolDifference>& differences);

// Returns the cell's text with this tool.mass_kg and tool.centre_of_mass_S_m; everything else stays. Throws SetupError
// if a key isn't found.
std::string with_tool(const std::string& text, const description::Cell& cell, double mass_kg,
                      const std::array<double, 3>& centre_S_m);

// Writes both values to the cell's file, and the new cell's zero to CELL.zero. Returns the path of the cell's backup.
// Precondition: whole(). Throws SetupError.
std::filesystem::path write_tool(const IdentifiedTool& tool, const PreparedSession& session);

}  // namespace proxarm::command_line
