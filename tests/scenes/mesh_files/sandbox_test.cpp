// Parsers of untrusted files run in a process of their own.
#include "scenes/mesh_files/sandbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>

#include "scenes/mesh_files/system_calls.hpp"

namespace proxarm::tests {
namespace {

using Bytes = std::vector<std::byte>;
using scenes::read_in_sandbox;
using scenes::SandboxLimits;

std::string error_of(const std::function<Bytes()>& read, const SandboxLimits& limits = {}) {
  try {
    read_in_sandbox(read, limits);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

TEST(Sandbox, ReturnsWhatIsRead) {
  EXPECT_TRUE(read_in_sandbox([] { return Bytes{}; }, {}).empty());
  const Bytes large(20'000'000, std::byte{7});
  EXPECT_EQ(read_in_sandbox([&] { return large; }, {.seconds = 20.0}), large);
}

TEST(Sandbox, HappensElsewhere) {
  int changed = 0;
  const pid_t here = ::getpid();
  read_in_sandbox(
      [&] {
        changed = ::getpid() == here ? 1 : 2;
        return Bytes{};
      },
      {});
  EXPECT_EQ(changed, 0);
}

TEST(Sandbox, SaysWhatEndedIt) {
  EXPECT_EQ(error_of([]() -> Bytes { throw std::runtime_error("no triangles"); }), "no triangles");
  EXPECT_THAT(error_of([]() -> Bytes { std::abort(); }), testing::HasSubstr("ends its reader: Aborted"));
  EXPECT_THAT(error_of([]() -> Bytes { ::_exit(3); }), testing::HasSubstr("without a result"));
  EXPECT_THAT(error_of([]() -> Bytes { throw std::bad_alloc(); }, {.memory = 5'000'000}), testing::HasSubstr("5 MB"));
}

// One that computes for ever and one that sleeps.
TEST(Sandbox, EndsWhatTakesForEver) {
  EXPECT_THAT(error_of(
                  []() -> Bytes {
                    volatile bool goes_on = true;
                    while (goes_on) {
                    }
                    return {};
                  },
                  {.seconds = 0.5}),
              testing::HasSubstr("for more than 1 s"));
  EXPECT_THAT(error_of(
                  []() -> Bytes {
                    for (;;) ::pause();
                  },
                  {.seconds = 0.2}),
              testing::HasSubstr("for more than 1 s"));
}

// Whatever a damaged file makes of its parser: it may read, and nothing else.
TEST(Sandbox, EndsWhatAsksTheKernelForMoreThanReading) {
  if (!scenes::sandbox_filters_system_calls) GTEST_SKIP() << "a sanitizer asks for more";
  EXPECT_EQ(error_of([]() -> Bytes {
              if (!std::ifstream("/proc/self/stat")) throw std::runtime_error("a file can't be read");
              return {};
            }),
            "none");
  const std::function<void()> asked[] = {
      [] { std::ofstream("/tmp/proxarm-sandbox-test") << "written"; },
      [] { ::socket(AF_INET, SOCK_STREAM, 0); },
      [] { ::fork(); },
      [] { ::execl("/bin/true", "true", nullptr); },
      [] { ::kill(::getppid(), 0); },
      [] { ::unlink("/tmp/proxarm-sandbox-test"); },
      [] { (void)::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); },
      [] { std::thread([] {}).join(); },
  };
  for (const std::function<void()>& ask : asked) {
    EXPECT_THAT(error_of([&]() -> Bytes {
                  ask();
                  return {};
                }),
                testing::HasSubstr("ends its reader: Bad system call"))
        << &ask - asked;
  }
}

TEST(Sandbox, EndsWhatWantsAllMemory) {
  if (!scenes::sandbox_limits_memory) GTEST_SKIP() << "a sanitizer has the addresses";
  EXPECT_THAT(error_of(
                  []() -> Bytes {
                    for (std::size_t size = 1'000'000;; size *= 2) Bytes(size, std::byte{1});
                  },
                  {.seconds = 20.0, .memory = 300'000'000}),
              testing::HasSubstr("more than 300 MB"));
}

}  // namespace
}  // namespace proxarm::tests
