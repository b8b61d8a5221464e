// The columns of a record's signals.csv: what each is called, its unit, its frame and what it means.
//
// New ones come last, so that who reads by place isn't wrong.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// What a row has beside the cycle's own record, derived outside of it (derived_signals.hpp).
struct DerivedSignals {
  std::array<double, max_axes> target_rad{}, actual_rad{};  // of the motors, as angles at the joints
  std::array<double, max_axes> target_Nm{};                 // where drives take torques
  bool torques = false;                                     // they do: target_rad says nothing then
  std::array<double, 4> tool_q_W{0.0, 0.0, 0.0, 1.0};       // orientation of T in W by the encoders: x y z w
};

struct SignalColumn {
  std::string name, unit, frame, meaning;
};

// Of these axes; `with_truth`: with those of the simulation's truth.
std::vector<SignalColumn> signal_columns(const std::vector<std::string>& axis_names, bool with_truth);
// The first row, without its end.
std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth);
// The same as JSON: [{"name", "unit", "frame", "meaning"}, …].
std::string columns_json(const std::vector<std::string>& axis_names, bool with_truth);
// A row, without its end.
void append_signals(std::string& row, const CycleRecord& record, std::size_t axes, bool with_truth,
                    const DerivedSignals& derived = {});

}  // namespace proxarm::controller
