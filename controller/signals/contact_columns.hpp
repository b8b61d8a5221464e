// The columns of a record's contacts (contacts.csv, contacts.bin): a row for each contact of each cycle.
#pragma once

#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

[[nodiscard]] const std::vector<SignalColumn>& contact_columns();

// About the rendered point.
[[nodiscard]] Triple contact_torque_W_Nm(const CycleRecord& record, const RecordedContact& contact) noexcept;

// Appends one contact's row as text, without its end. Precondition: index < record.recorded_contacts().
void append_contact(std::string& row, const CycleRecord& record, std::size_t index);
// The same as numbers, at a spacing of `apart` values.
void store_contact(double* first, std::size_t apart, const CycleRecord& record, std::size_t index);

}  // namespace proxarm::controller
