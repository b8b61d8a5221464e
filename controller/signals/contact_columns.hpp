// The contacts of a record (contacts.csv, contacts.bin): a row for each contact of each cycle, none for a cycle
// without.
#pragma once

#include <string>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

[[nodiscard]] const std::vector<SignalColumn>& contact_columns();

// About the rendered point, in W, Nm.
[[nodiscard]] Triple contact_torque_W_Nm(const CycleRecord& record, const RecordedContact& contact) noexcept;

// The row of one of a record's contacts as text, without its end. Precondition: index < record.recorded_contacts().
void append_contact(std::string& row, const CycleRecord& record, std::size_t index);
// The same as numbers, each `apart` places behind the one before.
void store_contact(double* first, std::size_t apart, const CycleRecord& record, std::size_t index);

}  // namespace proxarm::controller
