// The person's enabling switch: nothing but a message that says "pressed", young enough and after one that said
// "released", may let an arm start.
#include "controller/supervision/enabling_input.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::controller {
namespace {

using fieldbus::CanFrame;

constexpr std::int64_t ms = 1'000'000;
constexpr std::size_t bus = 2;
constexpr std::uint32_t identifier = 0x1A0;

CanFrame message(std::initializer_list<std::uint8_t> bytes, std::uint32_t id = identifier) {
  CanFrame frame;
  frame.id = id;
  for (const std::uint8_t byte : bytes) frame.data[frame.length++] = byte;
  return frame;
}

// The switch is bit 3 of byte 1 of a message of its own; a message is good for 50 ms. The other bits are set in one
// message and not in the other, the wrong way round: they mustn't count.
class EnablingInputTest : public ::testing::TestWithParam<bool> {
 protected:
  EnablingInputTest() : input(description_of(GetParam()), {}, bus) {}

  static description::EnablingInputDescription description_of(bool pressed_is) {
    description::EnablingInputDescription description;
    description.bus = "sensor";
    description.identifier = identifier;
    description.byte = 1;
    description.bit = 3;
    description.pressed_is = pressed_is;
    description.timeout_s = 0.05;
    return description;
  }
  static CanFrame bit(bool set) { return set ? message({0x00, 0x08}) : message({0xFF, 0xF7}); }
  static CanFrame says_pressed() { return bit(GetParam()); }
  static CanFrame says_released() { return bit(!GetParam()); }

  // The message comes in, and the cycle asks at the same time.
  void hear(const CanFrame& frame, std::int64_t time_ns) {
    EXPECT_TRUE(input.on_frame(bus, frame, time_ns));
    input.on_cycle(time_ns);
  }

  EnablingInput input;
};

INSTANTIATE_TEST_SUITE_P(BothPolarities, EnablingInputTest, ::testing::Bool(),
                         [](const auto& polarity) { return polarity.param ? "OneIsPressed" : "ZeroIsPressed"; });

TEST_P(EnablingInputTest, IsReleasedBeforeAnyMessage) {
  for (const std::int64_t time_ns : {0 * ms, 1 * ms, 49 * ms}) {
    input.on_cycle(time_ns);
    EXPECT_FALSE(input.pressed());
    EXPECT_FALSE(input.take_press());
  }
}

TEST_P(EnablingInputTest, APressAfterAReleaseCountsOnce) {
  hear(says_released(), 10 * ms);
  EXPECT_FALSE(input.pressed());
  EXPECT_FALSE(input.take_press());
  hear(says_pressed(), 20 * ms);
  EXPECT_TRUE(input.pressed());
  EXPECT_TRUE(input.take_press());
  EXPECT_FALSE(input.take_press()) << "the same press starts nothing a second time";
  hear(says_pressed(), 30 * ms);
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.take_press()) << "held isn't pressed anew";
  hear(says_released(), 40 * ms);
  hear(says_pressed(), 50 * ms);
  EXPECT_TRUE(input.take_press()) << "let go and pressed again";
}

TEST_P(EnablingInputTest, OneThatIsHeldFromTheBeginningNeverStarts) {
  for (int k = 0; k < 100; ++k) {
    hear(says_pressed(), k * ms);
    EXPECT_TRUE(input.pressed());
    EXPECT_FALSE(input.take_press()) << "tied down, or its wire is stuck at this level";
  }
}

TEST_P(EnablingInputTest, LettingGoActsWithItsMessage) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 20 * ms);
  ASSERT_TRUE(input.pressed());
  hear(says_released(), 21 * ms);
  EXPECT_FALSE(input.pressed());
}

TEST_P(EnablingInputTest, APressThatEndedBeforeAnybodyAskedIsForgotten) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 20 * ms);
  hear(says_released(), 30 * ms);
  EXPECT_FALSE(input.take_press());
}

// A broken wire: no messages any more.
TEST_P(EnablingInputTest, IsReleasedAsSoonAsTheLastMessageIsOlderThanTheTimeout) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 20 * ms);
  input.on_cycle(70 * ms);
  EXPECT_TRUE(input.pressed()) << "50 ms old, the timeout itself";
  input.on_cycle(70 * ms + 1);
  EXPECT_FALSE(input.pressed());
  EXPECT_FALSE(input.take_press());
}

TEST_P(EnablingInputTest, AfterAGapAMessageThatSaysPressedIsNoPressAnew) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 20 * ms);
  ASSERT_TRUE(input.take_press());
  // Nobody has let go, as far as anybody knows.
  hear(says_pressed(), 200 * ms);
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.take_press());
}

TEST_P(EnablingInputTest, AReleaseBeforeAGapIsForgotten) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 60 * ms + 1);
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.take_press());
}

TEST_P(EnablingInputTest, TheGapCountsThoughTheCycleDidNotAskMeanwhile) {
  ASSERT_TRUE(input.on_frame(bus, says_released(), 10 * ms));
  ASSERT_TRUE(input.on_frame(bus, says_pressed(), 100 * ms));
  EXPECT_FALSE(input.take_press());
}

// A device that lost its configuration sends a message without the byte; it says neither pressed nor released.
TEST_P(EnablingInputTest, AMessageTooShortToHoldTheBitIsReleasedAndNoReleaseBeforeAPress) {
  hear(says_released(), 10 * ms);
  hear(says_pressed(), 20 * ms);
  hear(message({0xFF}), 30 * ms);
  EXPECT_FALSE(input.pressed());
  EXPECT_FALSE(input.take_press());
  hear(says_pressed(), 40 * ms);
  EXPECT_TRUE(input.pressed());
  EXPECT_FALSE(input.take_press());
}

TEST_P(EnablingInputTest, OnlyItsOwnMessageCounts) {
  hear(says_released(), 10 * ms);
  CanFrame extended = says_pressed(), remote = says_pressed(), error = says_pressed(), other = says_pressed();
  extended.extended = true;
  remote.remote = true;
  error.error = true;
  other.id = identifier + 1;
  for (const CanFrame& frame : {extended, remote, error, other}) {
    EXPECT_FALSE(input.on_frame(bus, frame, 20 * ms));
    EXPECT_FALSE(input.pressed());
  }
  EXPECT_FALSE(input.on_frame(bus + 1, says_pressed(), 20 * ms));
  EXPECT_FALSE(input.pressed());
  // Nor do they keep an old message alive.
  hear(says_pressed(), 30 * ms);
  EXPECT_FALSE(input.on_frame(bus, other, 79 * ms));
  input.on_cycle(81 * ms);
  EXPECT_FALSE(input.pressed());
}

TEST_P(EnablingInputTest, GoesOnFromItsArchiveAsIfNothingHadHappened) {
  hear(says_released(), 10 * ms);
  for (const bool pressed_meanwhile : {false, true}) {
    if (pressed_meanwhile) hear(says_pressed(), 20 * ms);
    std::array<std::byte, 64> bytes{};
    auto written = fieldbus::StateArchive::writer(bytes);
    input.archive(written);
    ASSERT_TRUE(written.whole());

    EnablingInput copy(description_of(GetParam()), {}, bus);
    auto read = fieldbus::StateArchive::reader(std::span<const std::byte>(bytes).first(written.bytes()));
    copy.archive(read);
    ASSERT_TRUE(read.whole());
    EXPECT_EQ(copy.pressed(), pressed_meanwhile);
    // The release, or the press that nobody has taken yet, is known; so is how old the message is.
    ASSERT_TRUE(copy.on_frame(bus, says_pressed(), 30 * ms));
    EXPECT_TRUE(copy.take_press());
    copy.on_cycle(81 * ms);
    EXPECT_FALSE(copy.pressed());
  }
}

TEST(EnablingInput, IsFoundInTheDigitalInputsThatADriveSends) {
  description::Cell cell;
  cell.drives.resize(2);
  cell.drives[0].joint = "axis_1";
  cell.drives[0].node = 1;
  cell.drives[1].joint = "axis_3";
  cell.drives[1].node = 5;
  description::EnablingInputDescription description;
  description.drive = "axis_3";
  description.bit = 18;  // byte 2, bit 2 of the 32 bits of 60FDh
  EnablingInput input(description, cell, bus);
  EXPECT_EQ(input.wanted_id(), 0x285u) << "TPDO2 of node 5";
  EXPECT_EQ(input.bus(), bus);
  ASSERT_TRUE(input.on_frame(bus, message({0xFF, 0xFF, 0xFB, 0xFF}, 0x285), 1 * ms));
  EXPECT_FALSE(input.pressed());
  ASSERT_TRUE(input.on_frame(bus, message({0x00, 0x00, 0x04, 0x00}, 0x285), 2 * ms));
  EXPECT_TRUE(input.take_press());
  EXPECT_FALSE(input.on_frame(bus, message({0x00, 0x00, 0x04, 0x00}, 0x281), 2 * ms)) << "another drive's";
}

TEST(EnablingInput, AnIdentifierOf29BitsIsAskedForAsSuch) {
  description::EnablingInputDescription description;
  description.identifier = identifier;
  description.extended = true;
  EnablingInput input(description, {}, bus);
  EXPECT_EQ(input.wanted_id(), identifier | fieldbus::extended_id_flag);
  EXPECT_FALSE(input.on_frame(bus, message({0x01}), 1 * ms)) << "the same number in 11 bits is another message";
  CanFrame frame = message({0x01});
  frame.extended = true;
  EXPECT_TRUE(input.on_frame(bus, frame, 1 * ms));
  EXPECT_TRUE(input.pressed());
}

// ---- three positions

enum class Says { released, middle, squeezed, both, nothing };

// Middle is bit 3 of byte 1, panic bit 0 of byte 2; all other bits stand the wrong way round.
CanFrame three(Says says, bool panic_is) {
  const bool middle = says == Says::middle || says == Says::both;
  const bool panic = says == Says::squeezed || says == Says::both;
  if (says == Says::nothing) return message({0x00, 0x08});  // the byte of the panic contact is missing
  const bool panic_bit = panic == panic_is;
  return message(
      {0xFF, static_cast<std::uint8_t>(middle ? 0x08 : 0xF7), static_cast<std::uint8_t>(panic_bit ? 1 : 0xFE)});
}

description::EnablingInputDescription with_three_positions(bool panic_is) {
  description::EnablingInputDescription description;
  description.identifier = identifier;
  description.byte = 1;
  description.bit = 3;
  description.three_position = description::PanicContact{.byte = 2, .bit = 0, .squeezed_is = panic_is};
  return description;
}

struct AfterAll {
  std::vector<Says> said;
  bool pressed, anew, squeezed;
};

// Every way of at most three steps that matters; `anew` is whether the last message was a press.
const std::vector<AfterAll>& ways() {
  using enum Says;
  static const std::vector<AfterAll> all{
      {{released}, false, false, false},
      {{middle}, false, false, false},
      {{squeezed}, false, false, true},
      {{both}, false, false, true},
      {{nothing}, false, false, false},
      {{released, middle}, true, true, false},
      {{released, squeezed}, false, false, true},
      {{released, nothing, middle}, false, false, false},
      {{released, middle, middle}, true, false, false},
      {{released, middle, released}, false, false, false},
      {{released, middle, squeezed}, false, false, true},
      {{released, middle, both}, false, false, true},
      {{released, middle, nothing}, false, false, false},
      {{released, middle, nothing, middle}, false, false, false},
      {{released, middle, released, middle}, true, true, false},
      {{released, middle, squeezed, middle}, false, false, true},
      {{released, middle, squeezed, middle, middle}, false, false, true},
      {{released, middle, squeezed, nothing, middle}, false, false, true},
      {{released, middle, squeezed, released}, false, false, false},
      {{released, middle, squeezed, released, middle}, true, true, false},
      {{released, middle, squeezed, middle, released, middle}, true, true, false},
      {{middle, released, middle}, true, true, false},
      {{squeezed, middle}, false, false, true},
      {{squeezed, released, middle}, true, true, false},
  };
  return all;
}

TEST(ThreePositions, OnlyTheMiddleReachedFromReleasedEnables) {
  for (const bool panic_is : {true, false}) {
    for (const AfterAll& way : ways()) {
      std::string told = panic_is ? "one is squeezed:" : "zero is squeezed:";
      EnablingInput input(with_three_positions(panic_is), {}, bus);
      bool anew = false;
      std::int64_t time_ns = 0;
      for (const Says says : way.said) {
        told += " " + std::to_string(static_cast<int>(says));
        time_ns += 10 * ms;
        ASSERT_TRUE(input.on_frame(bus, three(says, panic_is), time_ns));
        input.on_cycle(time_ns);
        anew = input.take_press();
      }
      EXPECT_EQ(input.pressed(), way.pressed) << told;
      EXPECT_EQ(anew, way.anew) << told;
      EXPECT_EQ(input.squeezed(), way.squeezed) << told;
    }
  }
}

// Whoever lets the switch fall silent and then says "middle" hasn't let it go.
TEST(ThreePositions, AGapIsNoReleaseAndForgetsNoSqueeze) {
  EnablingInput input(with_three_positions(true), {}, bus);
  for (const Says says : {Says::released, Says::middle}) input.on_frame(bus, three(says, true), 10 * ms);
  ASSERT_TRUE(input.pressed());
  input.on_cycle(100 * ms);
  EXPECT_FALSE(input.pressed());
  input.on_frame(bus, three(Says::middle, true), 110 * ms);
  EXPECT_FALSE(input.pressed());
  input.on_frame(bus, three(Says::squeezed, true), 120 * ms);
  input.on_cycle(300 * ms);
  input.on_frame(bus, three(Says::middle, true), 310 * ms);
  EXPECT_TRUE(input.squeezed());
  EXPECT_FALSE(input.pressed());
}

TEST(ThreePositions, ASqueezeIsArchived) {
  EnablingInput input(with_three_positions(true), {}, bus);
  for (const Says says : {Says::released, Says::middle, Says::squeezed})
    input.on_frame(bus, three(says, true), 10 * ms);
  std::array<std::byte, 64> bytes{};
  auto written = fieldbus::StateArchive::writer(bytes);
  input.archive(written);
  EnablingInput copy(with_three_positions(true), {}, bus);
  auto read = fieldbus::StateArchive::reader(std::span<const std::byte>(bytes).first(written.bytes()));
  copy.archive(read);
  ASSERT_TRUE(read.whole());
  EXPECT_TRUE(copy.squeezed());
  copy.on_frame(bus, three(Says::middle, true), 20 * ms);
  EXPECT_FALSE(copy.pressed());
}

}  // namespace
}  // namespace proxarm::controller
