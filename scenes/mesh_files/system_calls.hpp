// Restricts the process that parses an untrusted file: it may only read files, use memory, write its result, and end.
//
// The restriction is a filter of system calls (seccomp). It is written without a library, because it needs only about
// two dozen call numbers. Opening files for reading is allowed, because the parser opens the mesh file. Any other call
// (a socket, another process, writing a file, a signal to other processes, executable memory) kills the process with
// SIGSYS.
#pragma once

namespace proxarm::scenes {

// False if there is no filter: with AddressSanitizer and ThreadSanitizer, whose runtimes need more calls, and on
// processors other than x86-64 and AArch64.
extern const bool sandbox_filters_system_calls;

// Installs the filter for the rest of this process. Writing is then only allowed to `results` (pwrite) and to standard
// output and error. Has no effect on a kernel without seccomp.
void filter_system_calls(int results) noexcept;

}  // namespace proxarm::scenes
