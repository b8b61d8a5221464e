// NMT, SYNC, heartbeat, EMCY and PDO parameters, byte for byte as CiA 301 has them.
#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "fieldbus/canopen/canopen_emcy.hpp"
#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/canopen/canopen_nmt.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ms = 1'000'000;

TEST(Nmt, CommandsAreTwoBytesOnIdentifierZero) {
  EXPECT_EQ(text_of(nmt_frame(NmtCommand::start, 5)), "000#0105");
  EXPECT_EQ(text_of(nmt_frame(NmtCommand::stop, 5)), "000#0205");
  EXPECT_EQ(text_of(nmt_frame(NmtCommand::enter_pre_operational, 127)), "000#807F");
  EXPECT_EQ(text_of(nmt_frame(NmtCommand::reset_node, all_nodes)), "000#8100");
  EXPECT_EQ(text_of(nmt_frame(NmtCommand::reset_communication, 1)), "000#8201");
}

TEST(Sync, HasNoDataUnlessACounterIsAskedFor) {
  SyncProducer plain;
  EXPECT_EQ(text_of(plain.next()), "080#");
  EXPECT_EQ(text_of(plain.next()), "080#");
  SyncProducer counting(3);
  EXPECT_EQ(text_of(counting.next()), "080#01");
  EXPECT_EQ(text_of(counting.next()), "080#02");
  EXPECT_EQ(text_of(counting.next()), "080#03");
  EXPECT_EQ(text_of(counting.next()), "080#01");
}

TEST(Sync, PeriodIsHeldInWholeMicrosecondsOrNotAtAll) {
  EXPECT_EQ(sync_period_us(1 * ms), 1000U);
  EXPECT_EQ(sync_period_us(500'000), 500U);
  EXPECT_EQ(sync_period_us(1'000'500), std::nullopt);
  EXPECT_EQ(sync_period_us(0), std::nullopt);
  EXPECT_EQ(sync_period_us(-1000), std::nullopt);
  EXPECT_EQ(sync_period_us(4'294'967'296'000), std::nullopt);
}

TEST(HeartbeatProducer, SpeaksOnlyWhileTheCycleMoves) {
  HeartbeatProducer producer(127, 20 * ms);
  CanFrame frame;
  ASSERT_TRUE(producer.due(0, 0, frame));
  EXPECT_EQ(text_of(frame), "77F#05");
  EXPECT_FALSE(producer.due(19 * ms, 19, frame));
  EXPECT_TRUE(producer.due(20 * ms, 20, frame));
  EXPECT_FALSE(producer.due(60 * ms, 20, frame)) << "a hung cycle must fall silent";
  EXPECT_TRUE(producer.due(61 * ms, 21, frame));
}

TEST(HeartbeatConsumer, FollowsTheStateAndNoticesSilence) {
  HeartbeatConsumer consumer(3, 100 * ms);
  EXPECT_FALSE(consumer.lost(10'000 * ms)) << "watching starts with the first heartbeat";
  EXPECT_TRUE(consumer.on_frame(frame_of("703#00"), 0));
  EXPECT_EQ(consumer.state(), NmtState::boot_up);
  EXPECT_EQ(consumer.boot_ups(), 1U);
  EXPECT_TRUE(consumer.on_frame(frame_of("703#7F"), 10 * ms));
  EXPECT_EQ(consumer.state(), NmtState::pre_operational);
  EXPECT_TRUE(consumer.on_frame(frame_of("703#05"), 20 * ms));
  EXPECT_EQ(consumer.state(), NmtState::operational);
  EXPECT_TRUE(consumer.on_frame(frame_of("703#04"), 30 * ms));
  EXPECT_EQ(consumer.state(), NmtState::stopped);
  EXPECT_FALSE(consumer.lost(130 * ms));
  EXPECT_TRUE(consumer.lost(130 * ms + 1));
  EXPECT_FALSE(consumer.on_frame(frame_of("704#05"), 40 * ms));
  EXPECT_FALSE(consumer.on_frame(frame_of("703#"), 40 * ms));
}

TEST(Emcy, CarriesCodeRegisterAndTheMakersBytes) {
  Emergency emergency;
  ASSERT_TRUE(decode_emcy(frame_of("083#3081110102030405"), 7, 3, emergency));
  EXPECT_EQ(emergency.code, 0x8130);
  EXPECT_EQ(emergency.error_register, 0x11);
  EXPECT_EQ(emergency.vendor, (std::array<std::uint8_t, 5>{1, 2, 3, 4, 5}));
  EXPECT_EQ(emergency.time_ns, 7);
  EXPECT_EQ(describe(emergency),
            "EMCY 8130: life guard error or heartbeat error (error register 11: generic, communication), maker's "
            "bytes 01 02 03 04 05");
  EXPECT_FALSE(decode_emcy(frame_of("084#3081110102030405"), 7, 3, emergency));
  EXPECT_FALSE(decode_emcy(frame_of("080#"), 7, 0, emergency)) << "SYNC is no EMCY of node 0";
}

TEST(Emcy, IsReadInWords) {
  const std::pair<std::uint16_t, const char*> wordings[] = {{0x0000, "error reset or no error"},
                                                            {0x8110, "CAN overrun (objects lost)"},
                                                            {0x8120, "CAN in error passive mode"},
                                                            {0x8130, "life guard error or heartbeat error"},
                                                            {0x8140, "recovered from bus off"},
                                                            {0x8210, "PDO not processed due to length error"},
                                                            {0x8250, "RPDO timeout"},
                                                            {0x8611, "following error"},
                                                            {0x3221, "voltage inside the device"},
                                                            {0xFF07, "device specific"}};
  for (const auto& [code, text] : wordings) EXPECT_EQ(emcy_text(code), text) << std::hex << code;
}

TEST(Emcy, EveryCodeHasSomeWording) {
  for (unsigned code = 0; code <= 0xFFFF; ++code) EXPECT_FALSE(emcy_text(static_cast<std::uint16_t>(code)).empty());
}

TEST(Pdo, IdentifiersAreThoseOfThePredefinedConnectionSet) {
  EXPECT_EQ(pdo_id(PdoDirection::transmit, 1, 1), 0x181U);
  EXPECT_EQ(pdo_id(PdoDirection::transmit, 4, 127), 0x4FFU);
  EXPECT_EQ(pdo_id(PdoDirection::receive, 1, 1), 0x201U);
  EXPECT_EQ(pdo_id(PdoDirection::receive, 4, 127), 0x57FU);
}

TEST(Pdo, RestrictedIdentifiersAreRefused) {
  for (const std::uint32_t id : {0x000U, 0x001U, 0x07FU, 0x080U, 0x101U, 0x180U, 0x581U, 0x5FFU, 0x601U, 0x67FU, 0x6E0U,
                                 0x6FFU, 0x701U, 0x77FU, 0x7FFU}) {
    EXPECT_TRUE(is_restricted_id(id)) << std::hex << id;
  }
  for (const std::uint32_t id : {0x081U, 0x181U, 0x200U, 0x57FU, 0x680U, 0x68FU, 0x6DFU}) {
    EXPECT_FALSE(is_restricted_id(id)) << std::hex << id;
  }
  PdoConfiguration pdo{.id = 0x601, .mapping = {{{0x6040, 0}, 16}}};
  EXPECT_THROW((void)pdo_steps(pdo), std::invalid_argument);
}

TEST(Pdo, MappingsThatDoNotFitAreRefused) {
  PdoConfiguration pdo{.id = 0x201};
  EXPECT_THROW((void)pdo_steps(pdo), std::invalid_argument) << "nothing mapped";
  pdo.mapping = {{{0x607A, 0}, 32}, {{0x60FF, 0}, 32}, {{0x6040, 0}, 8}};
  EXPECT_THROW((void)pdo_steps(pdo), std::invalid_argument) << "72 bits";
  pdo.fd = true;
  EXPECT_EQ(pdo_steps(pdo).size(), 8U) << "disable, clear, three objects, count, type, enable";
  pdo.mapping.assign(16, {{0x607A, 0}, 32});
  EXPECT_EQ(pdo_steps(pdo).size(), 21U) << "64 bytes";
  pdo.mapping.push_back({{0x6060, 0}, 8});
  EXPECT_THROW((void)pdo_steps(pdo), std::invalid_argument) << "65 bytes";
}

// Writes and read-backs of one PDO: disable, clear, map, count, type, timer, enable; each is read back.
TEST(Pdo, IsMappedInTheOrderOfTheStandard) {
  ScriptedNetwork network;
  ScriptedBus& bus = network.bus(0);
  const auto steps = pdo_steps({.direction = PdoDirection::receive,
                                .number = 1,
                                .id = 0x203,
                                .transmission_type = every_sync,
                                .event_timer_ms = 5,
                                .mapping = {{{0x6040, 0}, 16}, {{0x607A, 0}, 32}}});
  Conversation talk(bus, {"> 603#2300140103020080", "< 583#6000140100000000", "> 603#4000140100000000",
                          "< 583#4300140103020080",  // does not exist
                          "> 603#2F00160000000000", "< 583#6000160000000000", "> 603#4000160000000000",
                          "< 583#4F00160000000000",  // nothing mapped
                          "> 603#2300160110004060", "< 583#6000160100000000", "> 603#4000160100000000",
                          "< 583#4300160110004060",  // 6040:00, 16 bits
                          "> 603#2300160220007A60", "< 583#6000160200000000", "> 603#4000160200000000",
                          "< 583#4300160220007A60",  // 607A:00, 32 bits
                          "> 603#2F00160002000000", "< 583#6000160000000000", "> 603#4000160000000000",
                          "< 583#4F00160002000000",  // two objects
                          "> 603#2F00140201000000", "< 583#6000140200000000", "> 603#4000140200000000",
                          "< 583#4F00140201000000",  // every SYNC
                          "> 603#2B00140505000000", "< 583#6000140500000000", "> 603#4000140500000000",
                          "< 583#4B00140505000000",  // timeout 5 ms
                          "> 603#2300140103020000", "< 583#6000140100000000", "> 603#4000140100000000",
                          "< 583#4300140103020000"});  // exists
  SdoSequence sequence(bus, 3, "axes", "drive of axis", steps);
  sequence.start(network.time_ns);
  TimedFrame received;
  while (!sequence.finished() && network.wait_for_frame(network.time_ns + 1'000 * ms)) {
    while (bus.receive(received)) sequence.on_frame(received.frame, received.time_ns);
    sequence.poll(network.time_ns);
  }
  EXPECT_TRUE(talk.complete()) << talk.mistakes;
  EXPECT_FALSE(sequence.problem());
}

TEST(CanopenDecoders, TakeAnyBytes) {
  constexpr unsigned seed = 4711;
  std::mt19937 random(seed);
  HeartbeatConsumer consumer(3, 100 * ms);
  for (int i = 0; i < 20'000; ++i) {
    CanFrame frame;
    constexpr std::uint32_t ids[] = {0x083, 0x703};
    frame.id = ids[random() % 2];
    frame.length = static_cast<std::uint8_t>(random() % 9);
    for (std::size_t n = 0; n < frame.length; ++n) frame.data[n] = static_cast<std::uint8_t>(random());
    Emergency emergency;
    if (decode_emcy(frame, i, 3, emergency)) {
      ASSERT_FALSE(describe(emergency).empty());
    }
    if (consumer.on_frame(frame, i)) {
      ASSERT_FALSE(to_string(consumer.state()).empty());
    }
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
