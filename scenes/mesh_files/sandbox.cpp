#include "scenes/mesh_files/sandbox.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string_view>

#include "scenes/mesh_files/system_calls.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PROXARM_HUGE_ADDRESS_SPACE
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PROXARM_HUGE_ADDRESS_SPACE
#endif
#endif

namespace proxarm::scenes {

#ifdef PROXARM_HUGE_ADDRESS_SPACE
const bool sandbox_limits_memory = false;
#else
const bool sandbox_limits_memory = true;
#endif

namespace {

// How the child ended. It is the first part of the child's result.
enum class Outcome : std::uint64_t { none, read, refused, no_memory };
struct Header {
  Outcome outcome = Outcome::none;
  std::uint64_t bytes = 0;
};

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {
    if (fd < 0) throw std::runtime_error(std::string("no process to read it in: ") + std::strerror(errno));
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  void close() noexcept {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

// Repeats transfer(bytes, size, at), which is pread() or pwrite(), until all bytes are transferred.
template <typename Byte, typename Transfer>
bool all(Byte* bytes, std::size_t size, off_t at, Transfer transfer) noexcept {
  while (size > 0) {
    const ssize_t n = transfer(bytes, size, at);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes += n;
    at += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

bool write_all(int fd, const void* data, std::size_t size, off_t at) noexcept {
  return all(static_cast<const char*>(data), size, at,
             [fd](const char* bytes, std::size_t left, off_t from) { return ::pwrite(fd, bytes, left, from); });
}

bool read_all(int fd, void* data, std::size_t size, off_t at) noexcept {
  return all(static_cast<char*>(data), size, at,
             [fd](char* bytes, std::size_t left, off_t from) { return ::pread(fd, bytes, left, from); });
}

void limit(int resource, rlim_t most) noexcept {
  rlimit now{};
  if (::getrlimit(resource, &now) != 0 || (now.rlim_cur != RLIM_INFINITY && now.rlim_cur <= most)) return;
  now.rlim_cur = most;
  ::setrlimit(resource, &now);
}

void confine(const SandboxLimits& limits) noexcept {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGXCPU, SIGTERM, SIGINT}) {
    ::signal(signal, SIG_DFL);
  }
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.seconds)));
  if (sandbox_limits_memory) {
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    limit(RLIMIT_AS, static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + limits.memory);
  }
  const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nowhere >= 0) {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, fd);
  }
}

// Writes the child's result. The header is written last, so a result without a header is incomplete.
void leave(int fd, Outcome outcome, const void* data, std::size_t size) noexcept {
  const Header header{outcome, size};
  if (write_all(fd, data, size, sizeof header)) write_all(fd, &header, sizeof header, 0);
}

[[noreturn]] void run_child(const std::function<std::vector<std::byte>()>& read, const SandboxLimits& limits,
                            int results) noexcept {
  confine(limits);
  filter_system_calls(results);
  try {
    const std::vector<std::byte> bytes = read();
    leave(results, Outcome::read, bytes.data(), bytes.size());
  } catch (const std::bad_alloc&) {
    leave(results, Outcome::no_memory, nullptr, 0);
  } catch (const std::exception& error) {
    const std::string_view text = error.what();
    leave(results, Outcome::refused, text.data(), text.size());
  } catch (...) {
    leave(results, Outcome::refused, nullptr, 0);
  }
  ::_exit(0);
}

// Waits until the end of the child closes the pipe. False if this takes longer than `seconds`.
bool wait_until_closed(int fd, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0) return false;
    pollfd wait{fd, POLLIN, 0};
    const int n = ::poll(&wait, 1, static_cast<int>(std::min<std::int64_t>(left, 60'000)));
    if (n > 0) return true;
    if (n < 0 && errno != EINTR) return true;
  }
}

std::string what_ended(int status, bool in_time, const SandboxLimits& limits) {
  const std::string seconds = std::to_string(static_cast<int>(std::ceil(limits.seconds)));
  if (!in_time || (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))) {
    return "it keeps its reader for more than " + seconds + " s";
  }
  if (WIFSIGNALED(status)) return std::string("it ends its reader: ") + ::strsignal(WTERMSIG(status));
  return "its reader ended without a result";
}

}  // namespace

std::vector<std::byte> read_in_sandbox(const std::function<std::vector<std::byte>()>& read,
                                       const SandboxLimits& limits) {
  const Descriptor results(::memfd_create("proxarm-reader", MFD_CLOEXEC));
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) ends = {-1, -1};
  const Descriptor alive(ends[0]);
  Descriptor child_end(ends[1]);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(std::string("no process to read it in: ") + std::strerror(errno));
  if (child == 0) run_child(read, limits, results.get());
  child_end.close();
  const bool in_time = wait_until_closed(alive.get(), 3.0 * limits.seconds);
  if (!in_time) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  Header header;
  if (!read_all(results.get(), &header, sizeof header, 0) || header.outcome == Outcome::none) {
    throw std::runtime_error(what_ended(status, in_time, limits));
  }
  if (header.outcome == Outcome::no_memory) {
    throw std::runtime_error("its reader wants more than " + std::to_string(limits.memory / 1'000'000) + " MB");
  }
  std::vector<std::byte> bytes(header.bytes);
  if (!read_all(results.get(), bytes.data(), bytes.size(), sizeof header)) {
    throw std::runtime_error("what its reader has left can't be read");
  }
  if (header.outcome == Outcome::read) return bytes;
  throw std::runtime_error(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace proxarm::scenes
