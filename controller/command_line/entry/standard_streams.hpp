// Standard input, output and error as the program was given them.
#pragma once

namespace proxarm::command_line {

// First of all: a descriptor among 0, 1 and 2 that is closed is opened so that reading or writing fails as it would
// have. Else the next file, a record or a bus, would get its number and what is printed.
void open_standard_descriptors() noexcept;

// Last of all: what was printed is handed over. Where that fails (a full disk, a closed pipe) it is said on standard
// error, and a status of `fine` becomes `set_up_mistake`.
int flush_standard_output(int status) noexcept;

}  // namespace proxarm::command_line
