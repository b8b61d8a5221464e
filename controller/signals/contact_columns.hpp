// The columns of a record's contacts (contacts.csv, contacts.bin). A row is one contact of one cycle.
#pragma once

#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

[[nodiscard]] const std::vector<SignalColumn>& contact_columns();

// Returns the torque of this contact's force about the rendered point.
[[nodiscard]] Triple contact_torque_W_Nm(const CycleRecord& record, const RecordedContact& contact) noexcept;

// Appends one contact's row as text, without the line's end. Precondition: index < record.recorded_contacts().
void append_contact(std::string& row, const CycleRecord& record, std::size_t index);
// Stores the same row as numbers, at a spacing of `apart` values.
void store_contact(double* first, std::size_t apart, const CycleRecord& record, std::size_t index);

}  // namespace proxarm::controller
