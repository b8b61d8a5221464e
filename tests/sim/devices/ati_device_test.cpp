// Requests and answers of an ATI Net CAN OEM, bytes as in its manual: identifiers base << 4 | operation, big-endian.
#include "sim/devices/ati_device.hpp"

#include <random>

#include "tests/sim/devices/device_harness.hpp"

namespace proxarm::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct FixedGauges final : GaugeSource {
  std::array<std::int16_t, 6> gauges(std::int64_t) noexcept override { return values; }
  std::array<std::int16_t, 6> values{1, -2, 3, -32768, 32767, 256};
};

struct AtiDeviceTest : ::testing::Test {
  AtiDeviceTest() {
    config.counts_per_force = 1'000'000;  // 000F4240h
    config.counts_per_torque = 1'000;     // 000003E8h
    config.serial_number = "FT12345";
    config.matrix[2] = {1.0f, -2.0f, 0.5f, 0.0f, -0.15625f, 3.0f};
    device = std::make_unique<AtiDevice>(config, gauges, port);
    device->power_on(0);
  }
  std::vector<std::string> ask(const std::string& text) {
    device->on_frame(testing::from_text(text), 100 * testing::ms);
    return port.take();
  }
  AtiDeviceConfig config;
  FixedGauges gauges;
  testing::RecordingPort port;
  std::unique_ptr<AtiDevice> device;
};

TEST_F(AtiDeviceTest, AnswersAPollWithTwoFrames) {
  EXPECT_THAT(ask("680#"), ElementsAre("680#0000000100037FFF", "681#FFFE80000100"));
}

TEST_F(AtiDeviceTest, GivesTheRowsOfItsMatrixAsFloats) {
  EXPECT_THAT(ask("682#02"), ElementsAre("682#3F800000C0000000", "683#3F00000000000000", "684#BE20000040400000"));
  EXPECT_THAT(ask("682#06"), IsEmpty());
  EXPECT_THAT(ask("682#"), IsEmpty());
}

TEST_F(AtiDeviceTest, SaysWhatItIs) {
  EXPECT_THAT(ask("685#"), ElementsAre("685#4654313233343520"));
  EXPECT_THAT(ask("686#00"), ElementsAre("686#00"));
  EXPECT_THAT(ask("686#03"), ElementsAre("686#00"));  // not there: the old one stays active
  EXPECT_THAT(ask("687#"), ElementsAre("687#000F4240000003E8"));
  EXPECT_THAT(ask("688#"), ElementsAre("688#0203"));
  EXPECT_THAT(ask("68F#"), ElementsAre("68F#0100002A"));
}

TEST_F(AtiDeviceTest, IsSilentForAWhileAfterAReset) {
  EXPECT_THAT(ask("68C#"), IsEmpty());
  EXPECT_THAT(ask("680#"), IsEmpty());
  device->on_frame(testing::from_text("680#"), 100 * testing::ms + config.start_time_ns);
  EXPECT_EQ(port.take().size(), 2u);
}

TEST_F(AtiDeviceTest, LeavesOtherIdentifiersAndOtherLengthsAlone) {
  EXPECT_THAT(ask("690#"), IsEmpty());
  EXPECT_THAT(ask("080#"), IsEmpty());
  EXPECT_THAT(ask("680#00"), IsEmpty());
  fieldbus::CanFrame frame = testing::from_text("680#");
  frame.extended = true;
  device->on_frame(frame, 100 * testing::ms);
  EXPECT_THAT(port.take(), IsEmpty());
}

TEST_F(AtiDeviceTest, AnswersAfterItsOwnTime) {
  device->on_frame(testing::from_text("680#"), 100 * testing::ms);
  EXPECT_THAT(port.times_ns, ElementsAre(100 * testing::ms + 30'000, 100 * testing::ms + 30'000));
}

TEST_F(AtiDeviceTest, HasFaultsThatCanBeSwitchedOn) {
  device->faults() = {.half_sample = true};
  EXPECT_THAT(ask("680#"), ElementsAre("680#0000000100037FFF"));
  device->faults() = {.swapped = true};
  EXPECT_THAT(ask("680#"), ElementsAre("681#FFFE80000100", "680#0000000100037FFF"));
  device->faults() = {.duplicated = true};
  EXPECT_EQ(ask("680#").size(), 4u);
  device->faults() = {.short_frames = true};
  EXPECT_THAT(ask("680#"), ElementsAre("680#0000000100037F", "681#FFFE800001"));
  device->faults() = {.status_bits = 0x4000};
  EXPECT_THAT(ask("680#"), ElementsAre("680#C000000100037FFF", "681#FFFE80000100"));
  device->faults() = {.silent_samples = true};
  EXPECT_THAT(ask("680#"), IsEmpty());
  EXPECT_EQ(ask("687#").size(), 1u);
  device->faults() = {.silent = true};
  EXPECT_THAT(ask("687#"), IsEmpty());
  device->faults() = {};
  ask("680#");
  device->faults() = {.frozen = true};
  gauges.values = {};
  EXPECT_THAT(ask("680#"), ElementsAre("680#0000000100037FFF", "681#FFFE80000100"));
}

TEST_F(AtiDeviceTest, SurvivesRandomFrames) {
  constexpr unsigned seed = 6801;
  std::mt19937 random(seed);
  for (int i = 0; i < testing::scaled(100'000); ++i) {
    fieldbus::CanFrame frame;
    frame.id = random() % 4 == 0 ? random() % 0x800 : 0x680 + random() % 16;
    frame.extended = random() % 16 == 0;
    frame.length = static_cast<std::uint8_t>(random() % 9);
    for (std::size_t b = 0; b < frame.length; ++b) frame.data[b] = static_cast<std::uint8_t>(random());
    device->on_frame(frame, 100 * testing::ms + i);
    ASSERT_LE(port.frames.size(), 3u) << "seed " << seed;
    port.take();
  }
}

}  // namespace
}  // namespace proxarm::sim
