// Conversations with a simulated CANopen device: what goes in and what must come out, as candump shows it.
#include "sim/canopen/canopen_slave.hpp"

#include <random>

#include "tests/sim/devices/device_harness.hpp"

namespace proxarm::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::ms;

struct Application final : CanopenApplication {
  void on_sync(std::int64_t) override { ++syncs; }
  void on_nmt_state(NmtState, NmtState to, std::int64_t) override { states.push_back(to); }
  void on_communication_lost(std::uint16_t code, std::int64_t) override { lost.push_back(code); }
  void on_reset(std::int64_t) override { ++resets; }
  int syncs = 0, resets = 0;
  std::vector<NmtState> states;
  std::vector<std::uint16_t> lost;
};

struct CanopenSlaveTest : ::testing::Test {
  CanopenSlaveTest() {
    ObjectDictionary& od = slave.dictionary();
    od.add(0x6040, 0, DataType::unsigned16, Access::read_write, 0, true);
    od.add(0x6041, 0, DataType::unsigned16, Access::read_only, 0x0240, true);
    od.add(0x6064, 0, DataType::integer32, Access::read_only, 0x12345678, true);
    od.add(0x607A, 0, DataType::integer32, Access::read_write, 0, true);
    od.add(0x6065, 0, DataType::unsigned32, Access::read_write, 0);
    slave.receive_pdo(1).set_default_mapping({0x60400010});
    slave.transmit_pdo(1).set_default_mapping({0x60410010});
    slave.power_on(0);
  }
  // Lets time pass in steps of 1 ms.
  std::vector<std::string> until(std::int64_t time_ms) {
    for (; now_ms < time_ms; ++now_ms) slave.on_time((now_ms + 1) * ms);
    return port.take();
  }
  std::vector<std::string> ask(const std::string& text) {
    slave.on_frame(testing::from_text(text), now_ms * ms);
    return port.take();
  }
  void expect_ok(const std::string& request) {
    const auto answers = ask(request);
    ASSERT_EQ(answers.size(), 1u) << request;
    EXPECT_EQ(answers[0].substr(0, 6), "585#60") << request << " answered " << answers[0];
  }
  void boot() { ASSERT_THAT(until(30), ElementsAre("705#00")); }
  // RPDO1 {6040, 607A} and TPDO1 {6041, 6064}, both with every SYNC.
  void map_pdos() {
    for (const char* request :
         {"605#2300140105020080", "605#2F00160000000000", "605#2300160110004060", "605#2300160220007A60",
          "605#2F00160002000000", "605#2F00140201000000", "605#2300140105020000", "605#2300180185010080",
          "605#2F001A0000000000", "605#23001A0110004160", "605#23001A0220006460", "605#2F001A0002000000",
          "605#2F00180201000000", "605#2300180185010000"}) {
      expect_ok(request);
    }
  }

  static CanopenSlaveConfig config() {
    return {.node = 5,
            .device_type = 0x00020192,
            .vendor = 0x11,
            .product = 0x22,
            .revision = 0x33,
            .serial = 0x44,
            .device_name = "test"};
  }
  Application application;
  testing::RecordingPort port;
  CanopenSlave slave{config(), application, port};
  std::int64_t now_ms = 0;
};

TEST_F(CanopenSlaveTest, BootsUpOnceAndSaysNothingMore) {
  EXPECT_THAT(until(19), IsEmpty());
  EXPECT_THAT(until(20), ElementsAre("705#00"));
  EXPECT_THAT(until(500), IsEmpty());
  EXPECT_EQ(slave.state(), NmtState::pre_operational);
}

TEST_F(CanopenSlaveTest, FollowsNmtCommandsForItAndForAll) {
  boot();
  ask("000#0105");
  EXPECT_EQ(slave.state(), NmtState::operational);
  ask("000#0205");
  EXPECT_EQ(slave.state(), NmtState::stopped);
  ask("000#8000");
  EXPECT_EQ(slave.state(), NmtState::pre_operational);
  ask("000#0106");  // for another node
  ask("000#01");    // too short
  ask("000#7705");  // no such command
  EXPECT_EQ(slave.state(), NmtState::pre_operational);
}

TEST_F(CanopenSlaveTest, ForgetsItsSettingsOnResetAndKeepsTheApplicationsOnCommunicationReset) {
  boot();
  expect_ok("605#2B17100064000000");
  expect_ok("605#237A600001000000");
  ask("000#8205");
  EXPECT_EQ(slave.state(), NmtState::initialising);
  EXPECT_THAT(ask("605#4017100000000000"), IsEmpty());
  EXPECT_THAT(until(60), ElementsAre("705#00"));
  EXPECT_THAT(ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));
  EXPECT_THAT(ask("605#407A600000000000"), ElementsAre("585#437A600001000000"));
  EXPECT_EQ(application.resets, 1);  // power alone
  ask("000#8100");
  EXPECT_THAT(until(100), ElementsAre("705#00"));
  EXPECT_THAT(ask("605#407A600000000000"), ElementsAre("585#437A600000000000"));
  EXPECT_EQ(application.resets, 2);
}

TEST_F(CanopenSlaveTest, AnswersSdoInPreOperationalAndOperationalOnly) {
  boot();
  EXPECT_THAT(ask("605#4018100100000000"), ElementsAre("585#4318100111000000"));
  EXPECT_THAT(ask("605#40181001"), IsEmpty());  // not eight bytes
  EXPECT_THAT(ask("606#4018100100000000"), IsEmpty());
  ask("000#0100");
  EXPECT_THAT(ask("605#4000100000000000"), ElementsAre("585#4300100092010200"));
  ask("000#0200");
  EXPECT_THAT(ask("605#4000100000000000"), IsEmpty());
}

TEST_F(CanopenSlaveTest, SendsItsHeartbeatWithItsState) {
  boot();
  expect_ok("605#2B1710000A000000");
  EXPECT_THAT(until(51), ElementsAre("705#7F", "705#7F", "705#7F"));
  ask("000#0100");
  EXPECT_THAT(until(61), ElementsAre("185#4002", "705#05"));  // and TPDO1 of the default settings
  ask("000#0200");
  EXPECT_THAT(until(71), ElementsAre("705#04"));
}

TEST_F(CanopenSlaveTest, MissesTheMastersHeartbeatOnlyAfterItHasHeardIt) {
  boot();
  expect_ok("605#2316100132007F00");  // node 127, 50 ms
  ask("000#0100");
  EXPECT_THAT(until(500), ElementsAre("185#4002"));  // TPDO1 of the default settings goes out once
  EXPECT_THAT(application.lost, IsEmpty());
  ask("77F#05");
  EXPECT_THAT(until(550), IsEmpty());
  EXPECT_THAT(until(552), ElementsAre("085#3081110000000000"));
  EXPECT_THAT(application.lost, ElementsAre(0x8130));
  EXPECT_EQ(slave.state(), NmtState::pre_operational);  // 1029h:01 is 0
  EXPECT_THAT(ask("605#4001100000000000"), ElementsAre("585#4F01100011000000"));
  EXPECT_THAT(ask("605#4003100100000000"), ElementsAre("585#4303100130810000"));
  EXPECT_THAT(ask("77F#05"), ElementsAre("085#0000000000000000"));
}

TEST_F(CanopenSlaveTest, BehavesOnErrorsAs1029Says) {
  for (const auto& [behaviour, state] : {std::pair{"01", NmtState::operational}, std::pair{"02", NmtState::stopped}}) {
    slave.power_on(now_ms * ms);
    until(now_ms + 30);
    expect_ok("605#2316100132007F00");
    expect_ok(std::string("605#2F291001") + behaviour + "000000");
    ask("000#0100");
    ask("77F#05");
    until(now_ms + 60);
    EXPECT_EQ(slave.state(), state) << behaviour;
  }
}

TEST_F(CanopenSlaveTest, RefusesTwoConsumersForOneNode) {
  boot();
  expect_ok("605#2316100132007F00");
  EXPECT_THAT(ask("605#2316100232007F00"), ElementsAre("585#8016100243000406"));
}

TEST_F(CanopenSlaveTest, ExchangesPdosWithEverySync) {
  boot();
  map_pdos();
  ask("000#0105");
  EXPECT_THAT(ask("205#0F0078563412"), IsEmpty());
  EXPECT_EQ(slave.dictionary().number(0x607A), 0);  // not before SYNC
  EXPECT_THAT(ask("080#"), ElementsAre("185#400278563412"));
  EXPECT_EQ(slave.dictionary().number(0x6040), 0x0F);
  EXPECT_EQ(slave.dictionary().number(0x607A), 0x12345678);
  EXPECT_THAT(ask("080#"), ElementsAre("185#400278563412"));
  EXPECT_EQ(application.syncs, 2);
}

TEST_F(CanopenSlaveTest, TransmitsWithEveryNthSyncOrOnChange) {
  boot();
  expect_ok("605#2F00180203000000");
  ask("000#0105");
  EXPECT_THAT(ask("080#"), IsEmpty());
  EXPECT_THAT(ask("080#"), IsEmpty());
  EXPECT_THAT(ask("080#"), ElementsAre("185#4002"));
  expect_ok("605#2F00180200000000");
  EXPECT_THAT(ask("080#"), IsEmpty());
  slave.dictionary().at(0x6041).set(0x0231);
  EXPECT_THAT(ask("080#"), ElementsAre("185#3102"));
  expect_ok("605#2F001802FF000000");
  EXPECT_THAT(until(now_ms + 10), IsEmpty());
  slave.dictionary().at(0x6041).set(0x0233);
  EXPECT_THAT(until(now_ms + 10), ElementsAre("185#3302"));
}

TEST_F(CanopenSlaveTest, RefusesPdosThatAreTooShortAndTakesTheStartOfLongOnes) {
  boot();
  map_pdos();
  ask("000#0105");
  EXPECT_THAT(ask("205#0F0078"), ElementsAre("085#1082110000000000"));
  EXPECT_THAT(ask("205#0F0078"), IsEmpty());  // the error is there already
  ask("080#");
  EXPECT_EQ(slave.dictionary().number(0x6040), 0);
  EXPECT_THAT(ask("205#0600010000000000"), ElementsAre("085#2082110000000000", "085#2082110000000000"));
  ask("080#");
  EXPECT_EQ(slave.dictionary().number(0x607A), 1);
  EXPECT_THAT(ask("205#060002000000"), ElementsAre("085#0000000000000000"));
}

TEST_F(CanopenSlaveTest, MissesAReceivePdoAfterItsEventTimer) {
  boot();
  map_pdos();
  expect_ok("605#2B00140505000000");  // 5 ms
  ask("000#0105");
  EXPECT_THAT(until(100), IsEmpty());  // supervised from the first one on
  ask("205#060000000000");
  EXPECT_THAT(until(105), IsEmpty());
  EXPECT_THAT(until(106), ElementsAre("085#5082110000000000"));
  EXPECT_THAT(application.lost, ElementsAre(0x8250));
  EXPECT_EQ(slave.state(), NmtState::operational);
  EXPECT_THAT(ask("205#060000000000"), ElementsAre("085#0000000000000000"));
}

TEST_F(CanopenSlaveTest, LeavesOutPdosAfterTheSynchronousWindow) {
  boot();
  map_pdos();
  expect_ok("605#23071000E8030000");  // 1 ms
  ask("000#0105");
  ask("080#");
  until(now_ms + 2);
  ask("205#060005000000");
  ask("080#");
  EXPECT_EQ(slave.dictionary().number(0x607A), 0);
  ask("205#060005000000");
  ask("080#");
  EXPECT_EQ(slave.dictionary().number(0x607A), 5);
}

// CAN FD: the PDOs are FD frames of up to 64 bytes, everything else is classic; each frame in the other format is
// nobody's.
TEST(CanopenFdSlave, HasLongPdosAndClassicServices) {
  Application application;
  testing::RecordingPort port;
  CanopenSlave slave({.node = 5, .device_name = "test", .fd = true, .boot_time_ns = ms}, application, port);
  ObjectDictionary& od = slave.dictionary();
  od.add(0x6040, 0, DataType::unsigned16, Access::read_write, 0, true);
  od.add(0x6041, 0, DataType::unsigned16, Access::read_only, 0x0240, true);
  od.add(0x6064, 0, DataType::integer32, Access::read_only, 0x12345678, true);
  slave.receive_pdo(1).set_default_mapping({0x60400010});
  slave.transmit_pdo(1).set_default_mapping({0x60410010, 0x60640020, 0x60640020, 0x60640020, 0x60640020, 0x60640020});
  slave.power_on(0);
  slave.on_time(2 * ms);
  EXPECT_THAT(port.take(), ElementsAre("705#00"));
  slave.on_frame(testing::from_text("605#2F00180201000000"), 2 * ms);
  EXPECT_THAT(port.take(), ElementsAre("585#6000180200000000"));
  slave.on_frame(testing::from_text("000#0105"), 2 * ms);
  slave.on_frame(testing::from_text("080#"), 3 * ms);
  ASSERT_EQ(port.frames.size(), 1U);
  EXPECT_TRUE(port.frames[0].fd);
  EXPECT_TRUE(port.frames[0].bit_rate_switch);
  EXPECT_THAT(port.take(), ElementsAre("185#400278563412785634127856341278563412785634120000"))
      << "22 bytes, filled up to 24";
  fieldbus::CanFrame target = testing::from_text("205#0F00");
  slave.on_frame(target, 3 * ms);
  slave.on_frame(testing::from_text("080#"), 4 * ms);
  EXPECT_EQ(od.number(0x6040), 0) << "a classic frame is no PDO of this node";
  target.fd = true;
  slave.on_frame(target, 4 * ms);
  slave.on_frame(testing::from_text("080#"), 5 * ms);
  EXPECT_EQ(od.number(0x6040), 0x0F);
  port.take();
  fieldbus::CanFrame request = testing::from_text("605#4000100000000000");
  request.fd = true;
  slave.on_frame(request, 5 * ms);
  EXPECT_THAT(port.take(), IsEmpty()) << "an SDO is a classic frame";
}

TEST_F(CanopenSlaveTest, KeepsTheRulesOfPdoMapping) {
  boot();
  EXPECT_THAT(ask("605#2F00160000000000"), ElementsAre("585#8000160000000106"));  // while the PDO is valid
  expect_ok("605#2300140105020080");
  EXPECT_THAT(ask("605#2300160110004060"), ElementsAre("585#8000160100000106"));  // while sub 0 isn't 0
  expect_ok("605#2F00160000000000");
  EXPECT_THAT(ask("605#2300160120006560"), ElementsAre("585#8000160141000406"));  // 6065h can't be mapped
  EXPECT_THAT(ask("605#2300160110004160"), ElementsAre("585#8000160141000406"));  // 6041h isn't writable
  EXPECT_THAT(ask("605#2300160108004060"), ElementsAre("585#8000160141000406"));  // 6040h has 16 bits
  EXPECT_THAT(ask("605#2300160110002271"), ElementsAre("585#8000160100000206"));  // 7122h doesn't exist
  expect_ok("605#2300160120007A60");
  expect_ok("605#2300160220007A60");
  expect_ok("605#2300160310004060");
  EXPECT_THAT(ask("605#2F00160003000000"), ElementsAre("585#8000160042000406"));  // ten bytes
  expect_ok("605#2F00160002000000");
  EXPECT_THAT(ask("605#2F001402FA000000"), ElementsAre("585#8000140230000906"));  // type 250 is reserved
  EXPECT_THAT(ask("605#2300140181050000"), ElementsAre("585#8000140130000906"));  // 581h is an SDO's
  expect_ok("605#2300140100030000");
  EXPECT_THAT(ask("605#2300140101030000"), ElementsAre("585#8000140130000906"));  // valid: the identifier stays
}

TEST_F(CanopenSlaveTest, TellsOfASyncThatIsTooLong) {
  boot();
  EXPECT_THAT(ask("080#01"), ElementsAre("085#4082110000000000"));
  EXPECT_EQ(application.syncs, 0);
}

TEST_F(CanopenSlaveTest, SurvivesRandomFrames) {
  constexpr unsigned seed = 301;
  std::mt19937 random(seed);
  const std::uint32_t ids[] = {0x000, 0x080, 0x205, 0x305, 0x605, 0x605, 0x77F, 0x701};
  std::int64_t time_ns = 0;
  for (int i = 0; i < testing::scaled(200'000); ++i) {
    fieldbus::CanFrame frame;
    frame.id = random() % 8 == 0 ? random() % 0x800 : ids[random() % std::size(ids)];
    frame.length = static_cast<std::uint8_t>(random() % 3 == 0 ? random() % 9 : 8);
    for (std::size_t b = 0; b < frame.length; ++b) frame.data[b] = static_cast<std::uint8_t>(random());
    if (frame.id == 0 && random() % 2 == 0) frame = testing::from_text("000#0105");
    if (frame.id == 0x605 && random() % 2 == 0) {  // meaningful objects more often than chance has them
      const std::uint16_t indices[] = {0x1005, 0x1016, 0x1017, 0x1400, 0x1600, 0x1800, 0x1A00, 0x1003};
      const std::uint16_t index = indices[random() % std::size(indices)];
      frame.data[1] = static_cast<std::uint8_t>(index);
      frame.data[2] = static_cast<std::uint8_t>(index >> 8);
      frame.data[3] &= 0x07;
    }
    slave.on_frame(frame, time_ns);
    slave.on_time(time_ns += 250'000);
    for (const auto& sent : port.frames) {
      ASSERT_LE(sent.length, 8) << "seed " << seed;
      ASSERT_LT(sent.id, 0x800u) << "seed " << seed;
    }
    port.take();
  }
  slave.power_on(time_ns);
  slave.on_time(time_ns + 30 * ms);
  EXPECT_THAT(port.take(), ElementsAre("705#00"));
}

}  // namespace
}  // namespace proxarm::sim
