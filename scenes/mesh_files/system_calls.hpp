// Restricts the process that parses an untrusted file: it may only read files, use memory, write its result, and end.
//
// A filter of system calls (seccomp), without a library: it needs only two dozen call numbers. Opening files is
// allowed, read-only: the parser opens the mesh file. Any other call (a socket, another process, writing a file, a
// signal to others, executable memory) kills the process with SIGSYS.
#pragma once

namespace proxarm::scenes {

// False without a filter: with AddressSanitizer and ThreadSanitizer, whose runtimes need more calls, and on processors
// other than x86-64 and AArch64.
extern const bool sandbox_filters_system_calls;

// For the rest of this process: writing is only allowed to `results` (pwrite) and to standard output and error. No
// effect on a kernel without seccomp.
void filter_system_calls(int results) noexcept;

}  // namespace proxarm::scenes
