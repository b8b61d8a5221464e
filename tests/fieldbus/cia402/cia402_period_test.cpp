// The conversation by which a drive that is enabled takes another period: exact bytes, CiA 301 7.2.4.3.
#include "fieldbus/cia402/cia402_period.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "tests/fieldbus/can/scripted_network.hpp"
#include "tests/fieldbus/cia402/described_drive.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ms = 1'000'000;

CanFrame answer(std::uint8_t node, const std::array<std::uint8_t, 8>& bytes) {
  CanFrame frame;
  frame.id = 0x580u + node;
  frame.length = 8;
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

class PeriodExchangeTest : public ::testing::Test {
 protected:
  PeriodExchangeTest() : one(drive_of(1), {}), two(drive_of(2), {}), exchange(slots()) {}
  std::vector<DriveSlot> slots() { return {{&one, 0}, {&two, 0}}; }
  std::string request() {
    CanFrame frame;
    std::size_t bus = 9;
    if (!exchange.next_request(now_ns, bus, frame)) return "";
    EXPECT_EQ(bus, 0u);
    return text_of(frame);
  }
  void expect(const char* wanted, std::uint8_t node, const std::array<std::uint8_t, 8>& said) {
    EXPECT_EQ(request(), wanted);
    EXPECT_EQ(request(), "") << "one at a time on a bus";
    EXPECT_TRUE(exchange.on_frame(0, answer(node, said)));
  }

  ServoDrive one, two;
  PeriodExchange exchange;
  std::int64_t now_ns = 0;
};

// 1 to 2 ms: the exponent stays −3. The RPDO's timer is five periods.
TEST_F(PeriodExchangeTest, WritesAndReadsBackWhatChanges) {
  exchange.tell(1 * ms, 2 * ms);
  for (const std::uint8_t node : {std::uint8_t{1}, std::uint8_t{2}}) {
    const std::string to = node == 1 ? "601#" : "602#";
    expect((to + "2FC2600102000000").c_str(), node, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0});
    expect((to + "40C2600100000000").c_str(), node, {0x4F, 0xC2, 0x60, 0x01, 0x02, 0, 0, 0});
    expect((to + "23061000D0070000").c_str(), node, {0x60, 0x06, 0x10, 0x00, 0, 0, 0, 0});
    expect((to + "4006100000000000").c_str(), node, {0x43, 0x06, 0x10, 0x00, 0xD0, 0x07, 0, 0});
    EXPECT_FALSE(exchange.done());
    expect((to + "2B0014050A000000").c_str(), node, {0x60, 0x00, 0x14, 0x05, 0, 0, 0, 0});
    expect((to + "4000140500000000").c_str(), node, {0x4B, 0x00, 0x14, 0x05, 0x0A, 0, 0, 0});
  }
  EXPECT_TRUE(exchange.done());
  EXPECT_EQ(request(), "");
}

// 1 ms = 1·10⁻³, 0.5 ms = 5·10⁻⁴: by way of 5 ms, there and back, not of 0.1 ms.
TEST_F(PeriodExchangeTest, PassesThroughTheLongerPeriod) {
  const PeriodSteps shorter = one.period_steps(1 * ms, ms / 2);
  EXPECT_EQ(shorter[0].object, (ObjectAddress{0x60C2, 1}));
  EXPECT_EQ(shorter[0].value, 5u);
  EXPECT_EQ(shorter[1].object, (ObjectAddress{0x60C2, 2}));
  EXPECT_EQ(shorter[1].value, 0xFCu);
  const PeriodSteps longer = one.period_steps(ms / 2, 1 * ms);
  EXPECT_EQ(longer[0].object, (ObjectAddress{0x60C2, 2})) << "5·10⁻³ s in between";
}

// The second drive refuses; the first one has taken it and is read, written and read again; the second one is read.
TEST_F(PeriodExchangeTest, TakesBackFromWhoeverTookIt) {
  exchange.tell(1 * ms, 2 * ms);
  expect("601#2FC2600102000000", 1, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0});
  expect("601#40C2600100000000", 1, {0x4F, 0xC2, 0x60, 0x01, 0x02, 0, 0, 0});
  // 1006h and 1400h:05 are the maker's choice: it hasn't them.
  expect("601#23061000D0070000", 1, {0x80, 0x06, 0x10, 0x00, 0x00, 0x00, 0x02, 0x06});
  expect("601#2B0014050A000000", 1, {0x80, 0x00, 0x14, 0x05, 0x11, 0x00, 0x09, 0x06});
  expect("602#2FC2600102000000", 2, {0x80, 0xC2, 0x60, 0x01, 0x22, 0x00, 0x00, 0x08});
  ASSERT_TRUE(exchange.failed());
  EXPECT_EQ(exchange.refusal().drive, 1);
  EXPECT_EQ(exchange.refusal().index, 0x60C2);
  EXPECT_EQ(exchange.refusal().code, 0x08000022u);
  EXPECT_EQ(request(), "");
  exchange.take_back();
  expect("601#4000140500000000", 1, {0x80, 0x00, 0x14, 0x05, 0x11, 0x00, 0x09, 0x06});
  expect("601#4006100000000000", 1, {0x80, 0x06, 0x10, 0x00, 0x00, 0x00, 0x02, 0x06});
  expect("601#40C2600100000000", 1, {0x4F, 0xC2, 0x60, 0x01, 0x02, 0, 0, 0});
  expect("601#2FC2600101000000", 1, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0});
  expect("601#40C2600100000000", 1, {0x4F, 0xC2, 0x60, 0x01, 0x01, 0, 0, 0});
  expect("602#4000140500000000", 2, {0x4B, 0x00, 0x14, 0x05, 0x05, 0, 0, 0});
  expect("602#4006100000000000", 2, {0x43, 0x06, 0x10, 0x00, 0xE8, 0x03, 0, 0});
  expect("602#40C2600100000000", 2, {0x4F, 0xC2, 0x60, 0x01, 0x01, 0, 0, 0});
  EXPECT_TRUE(exchange.done());
}

TEST_F(PeriodExchangeTest, AsksTwiceAndSaysWhatAValueThatWasNotKeptIs) {
  exchange.tell(1 * ms, 2 * ms);
  EXPECT_EQ(request(), "601#2FC2600102000000");
  now_ns = 199 * ms;
  exchange.on_cycle(now_ns);
  EXPECT_EQ(request(), "");
  now_ns = 200 * ms;
  exchange.on_cycle(now_ns);
  // An answer to something else, and one that is too short, are none.
  EXPECT_EQ(request(), "601#2FC2600102000000");
  EXPECT_TRUE(exchange.on_frame(0, answer(1, {0x60, 0x06, 0x10, 0x00, 0, 0, 0, 0})));
  CanFrame cut = answer(1, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0});
  cut.length = 4;
  EXPECT_TRUE(exchange.on_frame(0, cut));
  EXPECT_FALSE(exchange.on_frame(1, answer(1, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0}))) << "another bus";
  EXPECT_EQ(request(), "");
  EXPECT_TRUE(exchange.on_frame(0, answer(1, {0x60, 0xC2, 0x60, 0x01, 0, 0, 0, 0})));
  expect("601#40C2600100000000", 1, {0x4F, 0xC2, 0x60, 0x01, 0x01, 0, 0, 0});
  ASSERT_TRUE(exchange.failed());
  EXPECT_EQ(exchange.refusal().code, 0u);

  exchange.tell(1 * ms, 2 * ms);
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_FALSE(exchange.failed());
    EXPECT_EQ(request(), "601#2FC2600102000000");
    now_ns += 200 * ms;
    exchange.on_cycle(now_ns);
  }
  ASSERT_TRUE(exchange.failed());
  EXPECT_EQ(exchange.refusal().code, 0x05040000u);
}

}  // namespace
}  // namespace proxarm::fieldbus
