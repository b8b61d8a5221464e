#include "models/packed/packed.hpp"

#include <gtest/gtest.h>

#include <random>
#include <sstream>

namespace proxarm::models {
namespace {

TEST(Packed, AnyBytesComeBack) {
  std::mt19937 generator(1);
  std::printf("seed 1\n");
  for (const std::size_t size : {0, 1, 100, 4096, 1 << 20}) {
    std::string bytes(size, '\0');
    for (char& byte : bytes) byte = static_cast<char>(generator() % 7);
    EXPECT_EQ(unpacked(packed(bytes), size), bytes);
  }
}

TEST(Packed, WhatRepeatsBecomesSmaller) { EXPECT_LT(packed(std::string(100'000, 'x')).size(), 100U); }

std::string text_in(const std::string& frames, bool& sound) {
  std::istringstream in(frames);
  std::string text;
  sound = unpack(in, [&](std::string_view piece) {
    text += piece;
    return true;
  });
  return text;
}

TEST(Packed, FramesThatFollowEachOtherAreReadAsOneText) {
  std::string frames, expected;
  for (int i = 0; i < 300; ++i) {
    const std::string piece(static_cast<std::size_t>(100 * i), static_cast<char>('a' + i % 26));
    frames += packed(piece);
    expected += piece;
  }
  bool sound = false;
  EXPECT_EQ(text_in(frames, sound), expected);
  EXPECT_TRUE(sound);
  // Cut off anywhere: what comes out is a beginning of the text.
  for (std::size_t cut = 1; cut < frames.size(); cut += 37) {
    const std::string text = text_in(frames.substr(0, cut), sound);
    ASSERT_TRUE(sound);
    ASSERT_EQ(text, expected.substr(0, text.size()));
  }
  EXPECT_EQ(text_in("no frame", sound), "");
  EXPECT_FALSE(sound);
}

TEST(Packed, DamageIsToldOrChangesOnlyTheBytes) {
  std::mt19937 generator(2);
  std::printf("seed 2\n");
  const std::string bytes(5000, 'x'), whole = packed(bytes);
  EXPECT_FALSE(unpacked(whole, bytes.size() - 1));
  EXPECT_FALSE(unpacked(whole, bytes.size() + 1));
  for (std::size_t cut = 0; cut < whole.size(); ++cut) EXPECT_FALSE(unpacked(whole.substr(0, cut), bytes.size()));
  for (int run = 0; run < 2000; ++run) {
    std::string spoiled = whole;
    spoiled[generator() % spoiled.size()] ^= static_cast<char>(1 + generator() % 255);
    const std::optional<std::string> found = unpacked(spoiled, bytes.size());
    EXPECT_TRUE(!found || found->size() == bytes.size());
  }
}

}  // namespace
}  // namespace proxarm::models
