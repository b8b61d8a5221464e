// What the process that parses a stranger's file may ask of the kernel: to read files, for memory, and to end.
//
// A filter of system calls (seccomp), made by hand: two dozen calls by number need no library. Assimp opens a mesh's
// files by itself, some beside the one that is named (an OBJ file's materials), so opening stays allowed, for reading
// only. Anything else (a socket, another process, a file to write, a signal to others, executable memory) ends the
// process with SIGSYS.
#pragma once

namespace proxarm::scenes {

// False where there is no filter: with AddressSanitizer and ThreadSanitizer, whose runtimes need more, and on
// processors other than x86-64 and AArch64.
extern const bool sandbox_filters_system_calls;

// For the rest of this process' life: writing is allowed to `results` (pwrite) and to standard output and error. On a
// kernel without seccomp nothing happens.
void filter_system_calls(int results) noexcept;

}  // namespace proxarm::scenes
