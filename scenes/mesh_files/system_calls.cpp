#include "scenes/mesh_files/system_calls.hpp"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <vector>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PROXARM_UNFILTERED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PROXARM_UNFILTERED
#endif
#endif

#if defined(__x86_64__)
#define PROXARM_AUDIT_ARCH AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define PROXARM_AUDIT_ARCH AUDIT_ARCH_AARCH64
#elif !defined(PROXARM_UNFILTERED)
#define PROXARM_UNFILTERED
#endif

namespace proxarm::scenes {

#ifdef PROXARM_UNFILTERED

const bool sandbox_filters_system_calls = false;
void filter_system_calls(int) noexcept {}

#else

const bool sandbox_filters_system_calls = true;

namespace {

// Calls that are harmless with any arguments.
constexpr std::uint32_t allowed[] = {
    SYS_read,
    SYS_readv,
    SYS_pread64,
    SYS_close,
    SYS_lseek,
    SYS_fstat,
    SYS_newfstatat,
    SYS_statx,
    SYS_faccessat,
    SYS_readlinkat,
    SYS_getcwd,
    SYS_fadvise64,
    SYS_munmap,
    SYS_mremap,
    SYS_brk,
    SYS_madvise,
    SYS_futex,
    SYS_clock_gettime,
    SYS_gettimeofday,
    SYS_getrandom,
    SYS_rt_sigreturn,
    SYS_rt_sigprocmask,
    SYS_getpid,
    SYS_gettid,
    SYS_rt_sigaction,
    SYS_sched_yield,
    SYS_nanosleep,
    SYS_clock_nanosleep,
    SYS_sched_getaffinity,
    SYS_sysinfo,
    SYS_exit,
    SYS_exit_group,
#ifdef SYS_access
    SYS_pause,
    SYS_access,
    SYS_stat,
    SYS_lstat,
    SYS_readlink,
#endif
};

using Program = std::vector<sock_filter>;

constexpr std::uint32_t argument(unsigned i) {  // the low half of the argument: these processors are little-endian
  return static_cast<std::uint32_t>(offsetof(seccomp_data, args) + 8 * i);
}
void load(Program& p, std::uint32_t offset) { p.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offset)); }
void answer(Program& p, std::uint32_t action) { p.push_back(BPF_STMT(BPF_RET | BPF_K, action)); }

// Adds a rule: `call` is allowed if the test of its i-th argument succeeds, that is, continues with the next
// instruction. Otherwise the process is killed.
void allow_where(Program& p, std::uint32_t call, unsigned i, const sock_filter& test) {
  p.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 4));
  load(p, argument(i));
  p.push_back(test);
  answer(p, SECCOMP_RET_ALLOW);
  answer(p, SECCOMP_RET_KILL_PROCESS);
}

// Allows the call if its i-th argument equals `value`.
void allow_with(Program& p, std::uint32_t call, unsigned i, std::uint32_t value) {
  allow_where(p, call, i, BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1));
}

// Allows the call if none of the `bits` is set in its i-th argument.
void allow_without(Program& p, std::uint32_t call, unsigned i, std::uint32_t bits) {
  allow_where(p, call, i, BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, bits, 1, 0));
}

// Allows the call if its i-th argument is at most `most`.
void allow_up_to(Program& p, std::uint32_t call, unsigned i, std::uint32_t most) {
  allow_where(p, call, i, BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, most, 1, 0));
}

Program program_for(int results) {
  constexpr std::uint32_t writing = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC | O_APPEND | (O_TMPFILE & ~O_DIRECTORY);
  Program p;
  load(p, offsetof(seccomp_data, arch));
  p.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PROXARM_AUDIT_ARCH, 1, 0));
  answer(p, SECCOMP_RET_KILL_PROCESS);
  load(p, offsetof(seccomp_data, nr));
  for (const std::uint32_t call : allowed) {
    p.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
    answer(p, SECCOMP_RET_ALLOW);
  }
  allow_without(p, SYS_openat, 2, writing);
#ifdef SYS_open
  allow_without(p, SYS_open, 1, writing);
#endif
  allow_without(p, SYS_mmap, 2, PROT_EXEC);
  allow_without(p, SYS_mprotect, 2, PROT_EXEC);
  allow_with(p, SYS_pwrite64, 0, static_cast<std::uint32_t>(results));
  allow_up_to(p, SYS_write, 0, STDERR_FILENO);  // for last messages, such as those of abort()
  allow_up_to(p, SYS_writev, 0, STDERR_FILENO);
  allow_with(p, SYS_tgkill, 0, static_cast<std::uint32_t>(::getpid()));  // used by abort()
  p.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_ioctl, 0, 1));     // used by isatty()
  answer(p, SECCOMP_RET_ERRNO | ENOTTY);
  answer(p, SECCOMP_RET_KILL_PROCESS);
  return p;
}

}  // namespace

void filter_system_calls(int results) noexcept {
  Program program = program_for(results);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return;
  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter);
}

#endif

}  // namespace proxarm::scenes
