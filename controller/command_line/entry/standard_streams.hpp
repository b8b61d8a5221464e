// Keeps the standard streams safe to use, even if the program was started with some of them closed.
#pragma once

namespace proxarm::command_line {

// Call this first. Opens /dev/null as each closed descriptor among 0, 1 and 2, in the direction in which using it still
// fails. Otherwise the next opened file, such as a record or a bus, would get the closed descriptor's number and
// receive printed text.
void open_standard_descriptors() noexcept;

// Call this last. Flushes standard output. Returns `status`. If flushing fails (full disk, closed pipe), prints an
// error on standard error, and returns `set_up_mistake` instead of `fine`.
int flush_standard_output(int status) noexcept;

}  // namespace proxarm::command_line
