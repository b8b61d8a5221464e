// The columns of a record's signals: name, unit, frame and meaning; and a row of values, as text (signals.csv) or as
// numbers (signals.bin, signal_table.hpp).
//
// New columns come last, for readers that go by position.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// Values of a row that aren't in the cycle's record (derived_signals.hpp).
struct DerivedSignals {
  std::array<double, max_axes> target_rad{}, actual_rad{};  // of the motors, as angles at the joints
  std::array<double, max_axes> target_Nm{};                 // if drives take torques
  bool torques = false;                                     // drives take torques; target_rad is then meaningless
  std::array<double, 4> tool_q_W{0.0, 0.0, 0.0, 1.0};       // orientation of T in W by the encoders: x y z w
};

struct SignalColumn {
  // The text form of its values. A word is a number of `words`; flags have a bit for each of `words`.
  enum class Form : std::uint8_t { number, integer, seconds, word, flags };
  std::string name, unit, frame, meaning;
  Form form = Form::number;
  std::vector<std::string> words{};
};

// Marks an empty field: a NaN that no calculation yields, since it spells "EMPTY".
inline constexpr std::uint64_t empty_bits = 0x7FF8'0045'4D50'5459;
inline bool is_empty(double value) noexcept { return std::bit_cast<std::uint64_t>(value) == empty_bits; }

// Number of contacts with columns here; contact_columns.hpp has all recorded ones, with their places.
inline constexpr std::size_t contacts_in_signals = 3;

// Columns for these axes; `with_truth` adds the simulation's true state.
std::vector<SignalColumn> signal_columns(const std::vector<std::string>& axis_names, bool with_truth);
// The first row of a table, without its end.
std::string header_of(const std::vector<SignalColumn>& columns);
std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth);
// Names, units, frames and meanings as JSON: [{"name", "unit", "frame", "meaning"}, …].
std::string json_of(const std::vector<SignalColumn>& columns);
// A row, without its end.
void append_signals(std::string& row, const CycleRecord& record, std::size_t axes, bool with_truth,
                    const DerivedSignals& derived = {});
// The same row as numbers, at a spacing of `apart` values, without loss (cycle numbers and nanoseconds below 2^53).
void store_signals(double* first, std::size_t apart, const CycleRecord& record, std::size_t axes, bool with_truth,
                   const DerivedSignals& derived);
// Appends such a number as text, as in append_signals().
void append_stored(std::string& text, SignalColumn::Form form, const std::vector<std::string>& words, double value);

}  // namespace proxarm::controller
