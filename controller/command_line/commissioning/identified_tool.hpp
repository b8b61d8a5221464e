// What `proxarm identify` has found: told in words and as JSON, compared with the cell, and written into it.
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

// A value of the cell, or of its CELL.zero, beside the one that was found.
struct ToolDifference {
  std::string key;
  std::vector<double> in_cell, found, half;  // of the 95 % interval

  [[nodiscard]] bool differs() const noexcept;  // by more than the interval, somewhere
};

struct IdentifiedTool {
  identification::ToolFit fit;
  identification::Allowances allowances;
  std::string failure;    // what ended the session, or why the result isn't to be believed; empty: nothing
  std::string not_shown;  // what isn't identifiable, and why
  std::vector<proof::Reading> readings;
  bool real_arm = false;

  [[nodiscard]] bool found() const noexcept { return failure.empty() && fit.mass_found; }
  // All that belongs into the cell and its zero.
  [[nodiscard]] bool whole() const noexcept { return found() && fit.centre_found; }
};

// `zero`: the one that is kept beside the cell, if any.
std::vector<ToolDifference> compare(const IdentifiedTool& tool, const description::Cell& cell,
                                    const std::optional<ZeroFile>& zero);

std::string text(const IdentifiedTool& tool);
std::string text(const std::vector<ToolDifference>& differences);
description::Json json(const IdentifiedTool& tool);
description::Json json(const std::vector<ToolDifference>& differences);

// The cell's text with this tool.mass_kg and tool.centre_of_mass_S_m; everything else stays as it is. Throws SetupError
// where one of them isn't found.
std::string with_tool(const std::string& text, const description::Cell& cell, double mass_kg,
                      const std::array<double, 3>& centre_S_m);

// Writes both to the cell's file, and the zero of that cell to CELL.zero. Returns the path of the cell's backup.
// Precondition: whole(). Throws SetupError.
std::filesystem::path write_tool(const IdentifiedTool& tool, const PreparedSession& session);

}  // namespace proxarm::command_line
