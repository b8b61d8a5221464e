// Texts that explain a session's flags, phases and faults to people.
#pragma once

#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "models/description/cell.hpp"

namespace proxarm::view {

// What is limited or out of the ordinary while a flag is set.
struct FlagWords {
  controller::RecordFlag flag;
  const char* words;
  bool holds_back;  // an active limit
};
[[nodiscard]] const std::vector<FlagWords>& flag_words();

// What the arm does in a phase.
struct PhaseWords {
  const char* name;
  const char* words;
};
[[nodiscard]] PhaseWords phase_words(controller::Phase phase) noexcept;
// The state of the drives, for an arm whose controller is elsewhere.
[[nodiscard]] PhaseWords drive_words(controller::Phase phase) noexcept;

// The fault that stopped the arm or for which it is held, with its place and figures; empty if there is none.
[[nodiscard]] std::string fault_text(const controller::CycleRecord& record, const description::Cell& cell);

}  // namespace proxarm::view
