// The columns of a record's signals: what each is called, its unit, its frame and what it means; and a row of them, as
// text (signals.csv) or as numbers (signals.bin, signal_table.hpp).
//
// New ones come last, so that who reads by place isn't wrong.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
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
  // How its values are written as text. Those of the last two are numbers of `words`: one of them, or a bit for each.
  enum class Form : std::uint8_t { number, integer, seconds, word, flags };
  std::string name, unit, frame, meaning;
  Form form = Form::number;
  std::vector<std::string> words{};
};

// Stands for a field that has nothing in it: a NaN that no calculation gives, since it says "EMPTY".
inline constexpr std::uint64_t empty_bits = 0x7FF8'0045'4D50'5459;
inline bool is_empty(double value) noexcept { return std::bit_cast<std::uint64_t>(value) == empty_bits; }

// Contacts that have columns here; contact_columns.hpp has all that are recorded, with their places.
inline constexpr std::size_t contacts_in_signals = 3;

// Of these axes; `with_truth`: with those of the simulation's truth.
std::vector<SignalColumn> signal_columns(const std::vector<std::string>& axis_names, bool with_truth);
// The first row of a table, without its end.
std::string header_of(const std::vector<SignalColumn>& columns);
std::string signals_header(const std::vector<std::string>& axis_names, bool with_truth);
// What they mean, as JSON: [{"name", "unit", "frame", "meaning"}, …].
std::string json_of(const std::vector<SignalColumn>& columns);
// A row, without its end.
void append_signals(std::string& row, const CycleRecord& record, std::size_t axes, bool with_truth,
                    const DerivedSignals& derived = {});
// The same row as numbers, each `apart` places behind the one before; none of them loses a bit (cycle numbers and
// nanoseconds below 2^53).
void store_signals(double* first, std::size_t apart, const CycleRecord& record, std::size_t axes, bool with_truth,
                   const DerivedSignals& derived);
// What such a number is in append_signals' row.
void append_stored(std::string& text, SignalColumn::Form form, const std::vector<std::string>& words, double value);

}  // namespace proxarm::controller
