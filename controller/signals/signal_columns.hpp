// The columns of a record's signals: name, unit, frame and meaning. Writes a row of values as text (signals.csv) or as
// numbers (signals.bin, signal_table.hpp).
//
// New columns come last, because some readers find columns by their position.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

// The values of a row that aren't in the cycle's record (derived_signals.hpp).
struct DerivedSignals {
  std::array<double, max_axes> target_rad{}, actual_rad{};  // angles of the motors at the joints
  std::array<double, max_axes> target_Nm{};                 // torques at the joints, if drives take torques
  bool torques = false;                                // whether drives take torques; target_rad is then meaningless
  std::array<double, 4> tool_q_W{0.0, 0.0, 0.0, 1.0};  // orientation of T in W by the encoders: x y z w
};

struct SignalColumn {
  // How a value is written as text. A value of the form `word` is an index into `words`; a value of the form `flags`
  // has a bit for each of `words`.
  enum class Form : std::uint8_t { number, integer, seconds, word, flags };
  std::string name, unit, frame, meaning;
  Form form = Form::number;
  std::vector<std::string> words{};
};

// The bits of a NaN that marks an empty field. No calculation yields this NaN, since it spells "EMPTY".
inline constexpr std::uint64_t empty_bits = 0x7FF8'0045'4D50'5459;
inline bool is_empty(double value) noexcept { return std::bit_cast<std::uint64_t>(value) == empty_bits; }

// Number of contacts with columns in the signals. contact_columns.hpp has columns for all recorded contacts, with their
// places.
inline constexpr std::size_t contacts_in_signals = 3;

// Returns the columns for these axes. `with_truth` adds the columns of the simulation's true state.
std::vector<SignalColumn> signal_columns(const std::vector<std::string>& axis_names, bool with_truth);
// Returns the first row of a table, without the line's end.
std::string header_of(const std::vector<SignalColumn>& columns);
std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth);
// Returns names, units, frames and meanings as JSON: [{"name", "unit", "frame", "meaning"}, …].
std::string json_of(const std::vector<SignalColumn>& columns);
// Appends a row as text, without the line's end.
void append_signals(std::string& row, const CycleRecord& record, std::size_t axes, bool with_truth,
                    const DerivedSignals& derived = {});
// Stores the same row as numbers, at a spacing of `apart` values. Nothing is lost: cycle numbers and nanoseconds are
// below 2^53.
void store_signals(double* first, std::size_t apart, const CycleRecord& record, std::size_t axes, bool with_truth,
                   const DerivedSignals& derived);
// Appends a number of store_signals() as the text that append_signals() would write.
void append_stored(std::string& text, SignalColumn::Form form, const std::vector<std::string>& words, double value);

}  // namespace proxarm::controller
