#include "controller/live/realtime.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

namespace proxarm::controller {
namespace {

constexpr int priority = 80;  // above the kernel's threaded interrupts (50), below the kernel's watchdogs (99)
constexpr std::size_t stack_bytes = 256 * 1024;

void missing(const std::string& what, const char* means, const char* helps) {
  std::fprintf(stderr, "proxarm: real time: %s: %s; %s\n", what.c_str(), means, helps);
}

std::string first_word(const std::string& file) {
  std::ifstream in(file);
  std::string word;
  in >> word;
  return word;
}

// Touches the pages of the stack that the cycle may use, so that no page fault happens during a cycle.
__attribute__((noinline)) void touch_stack() noexcept {
  std::array<volatile char, stack_bytes> room;
  for (std::size_t i = 0; i < room.size(); i += 1024) room[i] = 0;
}

// Returns the last processor that this process may use, because the first processors get most interrupts. Returns -1 if
// the process may use only one.
int last_processor() noexcept {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return -1;
  int last = -1;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &allowed)) last = cpu;
  }
  return last;
}

void pin(int cpu) {
  if (cpu < 0) {
    missing("one processor only", "whatever else runs on this machine may delay a cycle", "use one with two or more");
    return;
  }
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(cpu, &one);
  if (pthread_setaffinity_np(pthread_self(), sizeof one, &one) != 0) {
    missing("no processor of its own", "the cycle moves between processors and finds their caches cold",
            "see sched_setaffinity(2)");
  }
}

void check_kernel() {
  utsname name{};
  const bool preemptible = first_word("/sys/kernel/realtime") == "1" ||
                           (uname(&name) == 0 && std::strstr(name.version, "PREEMPT_RT") != nullptr);
  if (!preemptible) {
    missing("the kernel isn't PREEMPT_RT", "a driver may hold a cycle up for milliseconds",
            "install linux-image-rt-amd64 before a person stands next to the arm");
  }
}

void check_governor(int cpu) {
  const std::string folder = "/sys/devices/system/cpu/cpu" + std::to_string(cpu < 0 ? 0 : cpu) + "/cpufreq/";
  const std::string governor = first_word(folder + "scaling_governor");
  if (governor.empty() || governor == "performance") return;
  missing("the frequency governor is " + governor, "a cycle after a quiet time is computed slowly",
          "cpupower frequency-set -g performance");
}

}  // namespace

RealtimeThread::RealtimeThread() {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  scheduled_ = refused == 0;
  if (!scheduled_) {
    missing(std::string("SCHED_FIFO refused (") + std::strerror(refused) + ")",
            "cycles are late whenever the machine is busy", "grant rtprio in /etc/security/limits.conf");
    prctl(PR_SET_TIMERSLACK, 1UL);  // 1 ns instead of 50 µs
  }
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    missing(std::string("mlockall refused (") + std::strerror(errno) + ")",
            "a page that was swapped out costs a cycle milliseconds", "grant memlock in /etc/security/limits.conf");
  }
  touch_stack();
  const int cpu = last_processor();
  // A thread without priority isn't pinned: it is better off moving between processors than sharing one with other
  // threads.
  if (scheduled_) pin(cpu);
  check_kernel();
  check_governor(cpu);
  sleep_states_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t none_us = 0;
  if (sleep_states_ < 0 || write(sleep_states_, &none_us, sizeof none_us) != sizeof none_us) {
    missing("deep sleep of processors can't be kept off", "waking up may take 100 µs and more",
            "run as root, or let your group write /dev/cpu_dma_latency");
  }
}

RealtimeThread::~RealtimeThread() {
  if (sleep_states_ >= 0) close(sleep_states_);
  if (!scheduled_) return;
  const sched_param parameters{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameters);
}

}  // namespace proxarm::controller
