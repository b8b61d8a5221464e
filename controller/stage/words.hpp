// Texts that explain a session's flags, phases and faults to people.
#pragma once

#include <string>

#include "controller/record/cycle_record.hpp"
#include "controller/record/flag_words.hpp"
#include "models/description/cell.hpp"

namespace proxarm::view {

using controller::flag_words;
using controller::FlagWords;

struct PhaseWords {
  const char* name;
  const char* words;
};
[[nodiscard]] PhaseWords phase_words(controller::Phase phase) noexcept;
// Returns words for the state of the drives, for an arm that another program controls.
[[nodiscard]] PhaseWords drive_words(controller::Phase phase) noexcept;

// Returns a text on the fault that stopped the arm, or for which the arm is held, with its place and figures; empty if
// there is no fault.
[[nodiscard]] std::string fault_text(const controller::CycleRecord& record, const description::Cell& cell);

}  // namespace proxarm::view
