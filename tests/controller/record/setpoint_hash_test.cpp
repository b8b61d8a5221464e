#include "controller/record/setpoint_hash.hpp"

#include <gtest/gtest.h>

#include <array>

namespace proxarm::controller {
namespace {

// FIPS 180-4's examples: of nothing, and (from the little-endian bytes of these counts) of the 56 letters
// "abcdbcde…nopq".
TEST(SetpointHash, IsSha256OfTheCountsLittleEndian) {
  SetpointHash hash;
  EXPECT_EQ(hash.hex(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const std::string text = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
  for (std::size_t i = 0; i < text.size(); i += 4) {
    const std::int32_t count = text[i] | text[i + 1] << 8 | text[i + 2] << 16 | text[i + 3] << 24;
    hash.add(std::array{count});
  }
  EXPECT_EQ(hash.hex(), "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

// Made with `printf '\x00\x00\x00\x80\xff\xff\xff\xff\xff\xff\xff\x7f' | sha256sum`.
TEST(SetpointHash, TakesNegativeCountsAsTwosComplement) {
  SetpointHash hash;
  hash.add(std::array<std::int32_t, 3>{INT32_MIN, -1, INT32_MAX});
  EXPECT_EQ(hash.hex(), "b423437f7c261ceb2b912184db9708a8f074b01fbe9f5654d10c4161911e4cb0");
}

TEST(SetpointHash, GoesOnAfterItWasRead) {
  SetpointHash whole, pieces;
  whole.add(std::array{1, 2, 3, 4});
  pieces.add(std::array{1, 2});
  EXPECT_NE(pieces.hex(), whole.hex());
  pieces.add(std::array{3, 4});
  EXPECT_EQ(pieces.hex(), whole.hex());
}

}  // namespace
}  // namespace proxarm::controller
