// Readers in a process of their own.
#include "scenes/apart.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>

namespace proxarm::tests {
namespace {

using Bytes = std::vector<std::byte>;
using scenes::read_apart;
using scenes::ReaderLimits;

std::string error_of(const std::function<Bytes()>& read, const ReaderLimits& limits = {}) {
  try {
    read_apart(read, limits);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

TEST(ReadApart, ReturnsWhatIsRead) {
  EXPECT_TRUE(read_apart([] { return Bytes{}; }, {}).empty());
  const Bytes large(20'000'000, std::byte{7});
  EXPECT_EQ(read_apart([&] { return large; }, {.seconds = 20.0}), large);
}

TEST(ReadApart, HappensElsewhere) {
  int changed = 0;
  const pid_t here = ::getpid();
  read_apart(
      [&] {
        changed = ::getpid() == here ? 1 : 2;
        return Bytes{};
      },
      {});
  EXPECT_EQ(changed, 0);
}

TEST(ReadApart, SaysWhatEndedIt) {
  EXPECT_EQ(error_of([]() -> Bytes { throw std::runtime_error("no triangles"); }), "no triangles");
  EXPECT_THAT(error_of([]() -> Bytes { std::abort(); }), testing::HasSubstr("ends its reader: Aborted"));
  EXPECT_THAT(error_of([]() -> Bytes { ::_exit(3); }), testing::HasSubstr("without a result"));
  EXPECT_THAT(error_of([]() -> Bytes { throw std::bad_alloc(); }, {.memory = 5'000'000}), testing::HasSubstr("5 MB"));
}

// One that computes for ever and one that sleeps.
TEST(ReadApart, EndsWhatTakesForEver) {
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

TEST(ReadApart, EndsWhatWantsAllMemory) {
  if (!scenes::reader_memory_is_limited) GTEST_SKIP() << "a sanitizer has the addresses";
  EXPECT_THAT(error_of(
                  []() -> Bytes {
                    for (std::size_t size = 1'000'000;; size *= 2) Bytes(size, std::byte{1});
                  },
                  {.seconds = 20.0, .memory = 300'000'000}),
              testing::HasSubstr("more than 300 MB"));
}

}  // namespace
}  // namespace proxarm::tests
