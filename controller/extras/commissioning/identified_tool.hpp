// Prints the result of `proxarm identify` as text and JSON, compares it with the cell and CELL.zero, and writes it
// there.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/extras/identification/identification.hpp"
#include "controller/extras/proof/proof.hpp"
#include "controller/preparation/zero_file.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {

// One quantity: the value in the cell or in CELL.zero, and the identified value.
struct ToolDifference {
  std::string key;
  std::vector<double> in_cell, found, half;  // half: half the width of the 95 % interval

  // Returns whether in any component the values differ by more than half the interval's width.
  [[nodiscard]] bool differs() const noexcept;
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

// Returns all quantities with both values. `zero` is the zero that is kept beside the cell; nullopt: none is kept.
std::vector<ToolDifference> compare(const IdentifiedTool& tool, const description::Cell& cell,
                                    const std::optional<controller::ZeroFile>& zero);

std::string text(const IdentifiedTool& tool);
std::string text(const std::vector<ToolDifference>& differences);
description::Json json(const IdentifiedTool& tool);
description::Json json(const std::vector<ToolDifference>& differences);

// Returns the cell's text with tool.mass_kg and tool.centre_of_mass_S_m set to these values; all other text stays.
// Throws SetupError if a key isn't found.
std::string with_tool(const std::string& text, const description::Cell& cell, double mass_kg,
                      const std::array<double, 3>& centre_S_m);

// Writes the mass and the centre of mass into the cell's file, and the zero, with the hash of the new cell, into
// CELL.zero. Returns the path of the backup of the cell's file. Precondition: tool.whole(). Throws SetupError.
std::filesystem::path write_tool(const IdentifiedTool& tool, const controller::PreparedSession& session);

}  // namespace proxarm::command_line
