// What a session's flags, phases and faults mean, in words for people who look at it.
#pragma once

#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "models/description/cell.hpp"

namespace proxarm::view {

// What holds the arm back, or is otherwise out of the ordinary, while a flag is set.
struct FlagWords {
  controller::RecordFlag flag;
  const char* words;
  bool holds_back;  // it is a limit that acts
};
[[nodiscard]] const std::vector<FlagWords>& flag_words();

// What the arm does in a phase.
struct PhaseWords {
  const char* name;
  const char* words;
};
[[nodiscard]] PhaseWords phase_words(controller::Phase phase) noexcept;
// What its drives do, of an arm whose controller is elsewhere.
[[nodiscard]] PhaseWords drive_words(controller::Phase phase) noexcept;

// The fault that stopped the arm or that it is held for, with its place and figures; empty where there is none.
[[nodiscard]] std::string fault_text(const controller::CycleRecord& record, const description::Cell& cell);

}  // namespace proxarm::view
