// Keeps the standard streams safe to use, however the program was started.
#pragma once

namespace proxarm::command_line {

// Call this first. Opens each closed descriptor among 0, 1 and 2 so that reading or writing still fails. Otherwise the
// next file opened, such as a record or a bus, would get that number and receive printed text.
void open_standard_descriptors() noexcept;

// Call this last. Flushes standard output. If that fails (full disk, closed pipe), prints so on standard error and
// turns a status of `fine` into `set_up_mistake`.
int flush_standard_output(int status) noexcept;

}  // namespace proxarm::command_line
