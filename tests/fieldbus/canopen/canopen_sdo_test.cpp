// Conversations of the SDO client, byte for byte: the examples of CiA 301 and of published CANopen tutorials.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

#include "fieldbus/can/frame_pump.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr ObjectAddress device_name{0x1008, 0};
constexpr ObjectAddress writable_string{0x2000, 0};

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

struct SdoTest : ::testing::Test {
  ScriptedNetwork network;
  ScriptedBus& bus = network.bus(0);
  SdoClient client{bus, 2};
  std::vector<std::string> others;

  void run() {
    pump_frames(
        network, network.time_ns + 60'000'000'000,
        [this](std::size_t, const TimedFrame& received) {
          if (!client.on_frame(received.frame, received.time_ns)) others.push_back(text_of(received.frame));
        },
        [this](std::int64_t now_ns) {
          client.poll(now_ns);
          return client.finished() ? pump_done : client.wake_ns(now_ns);
        });
  }
  void upload(ObjectAddress object, SdoTransfer transfer = SdoTransfer::automatic) {
    client.start_upload(object, network.time_ns, transfer);
    run();
  }
  void download(ObjectAddress object, const std::vector<std::uint8_t>& data,
                SdoTransfer transfer = SdoTransfer::automatic) {
    client.start_download(object, data, network.time_ns, transfer);
    run();
  }
  [[nodiscard]] std::string text() const { return {client.data().begin(), client.data().end()}; }
};

TEST_F(SdoTest, ReadsFourBytesExpedited) {
  Conversation c(bus, {"> 602#4018100100000000", "< 582#4318100104000000"});
  upload({0x1018, 1});
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
  EXPECT_EQ(text(), std::string("\x04\x00\x00\x00", 4));
}

TEST_F(SdoTest, ReadsOneByteOfAnAnswerWithoutPadding) {
  Conversation c(bus, {"> 602#4000140200000000", "< 582#4F001402FE"});
  upload({0x1400, 2});
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(text(), "\xFE");
}

TEST_F(SdoTest, ReadsExpeditedWithoutGivenSizeAsFourBytes) {
  Conversation c(bus, {"> 602#4000140200000000", "< 582#42001402FE000000"});
  upload({0x1400, 2});
  EXPECT_EQ(text(), std::string("\xFE\x00\x00\x00", 4));
}

TEST_F(SdoTest, WritesTwoBytesExpedited) {
  Conversation c(bus, {"> 602#2B171000A00F0000", "< 582#6017100000000000"});
  download({0x1017, 0}, {0xA0, 0x0F});
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, MarksTheSizeOfExpeditedWrites) {
  // n, the bytes that carry nothing, is in bits 2 and 3: 2F, 2B, 27, 23 for one to four bytes.
  const std::vector<std::pair<std::vector<std::uint8_t>, std::string>> cases = {
      {{0x11}, "> 602#2F60600011000000"},
      {{0x11, 0x22}, "> 602#2B60600011220000"},
      {{0x11, 0x22, 0x33}, "> 602#2760600011223300"},
      {{0x11, 0x22, 0x33, 0x44}, "> 602#2360600011223344"}};
  for (const auto& [data, request] : cases) {
    Conversation c(bus, {request, "< 582#6060600000000000"});
    download({0x6060, 0}, data);
    EXPECT_TRUE(c.complete()) << c.mistakes;
  }
}

TEST_F(SdoTest, ReadsAStringInSegments) {
  Conversation c(bus, {"> 602#4008100000000000", "< 582#410810001A000000",    // 26 bytes
                       "> 602#6000000000000000", "< 582#0054696E79204E6F",    // Tiny No
                       "> 602#7000000000000000", "< 582#106465202D204D65",    // de - Me
                       "> 602#6000000000000000", "< 582#00676120446F6D61",    // ga Doma
                       "> 602#7000000000000000", "< 582#15696E7320210000"});  // ins !, last, 2 unused
  upload(device_name);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(text(), "Tiny Node - Mega Domains !");
}

TEST_F(SdoTest, WritesAStringInSegments) {
  Conversation c(bus, {"> 602#210020000D000000", "< 582#6000200000000000", "> 602#0041206C6F6E6720",
                       "< 582#2000200000000000", "> 602#13737472696E6700", "< 582#3000200000000000"});
  download(writable_string, bytes_of("A long string"));
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, WritesNothingAsOneEmptySegment) {
  Conversation c(
      bus, {"> 602#2100200000000000", "< 582#6000200000000000", "> 602#0F00000000000000", "< 582#2000000000000000"});
  download(writable_string, {});
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, WritesABlock) {
  Conversation c(
      bus, {"> 602#C60020001E000000", "< 582#A40020007F000000", "> 602#0141207265616C6C", "> 602#0279207265616C6C",
            "> 602#0379206C6F6E6720", "> 602#04737472696E672E", "> 602#852E2E0000000000", "< 582#A2057F0000000000",
            "> 602#D545690000000000", "< 582#A100000000000000"});
  download(writable_string, bytes_of("A really really long string..."), SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, WritesBlocksOfTheSizeTheServerWants) {
  // 20 bytes, two segments at a time at first, then one. The CRC is that of Python's binascii.crc_hqx.
  Conversation c(bus, {"> 602#C600200014000000", "< 582#A400200002000000", "> 602#0130313233343536",
                       "> 602#0237383930313233", "< 582#A202010000000000", "> 602#8134353637383900",
                       "< 582#A201010000000000", "> 602#C55C2E0000000000", "< 582#A100000000000000"});
  download(writable_string, bytes_of("01234567890123456789"), SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, RepeatsWhatTheServerDidNotGetOfABlock) {
  Conversation c(
      bus, {"> 602#C60020001E000000", "< 582#A40020007F000000", "> 602#0141207265616C6C", "> 602#0279207265616C6C",
            "> 602#0379206C6F6E6720", "> 602#04737472696E672E", "> 602#852E2E0000000000", "< 582#A2027F0000000000",
            "> 602#0179206C6F6E6720", "> 602#02737472696E672E", "> 602#832E2E0000000000", "< 582#A2037F0000000000",
            "> 602#D545690000000000", "< 582#A100000000000000"});
  download(writable_string, bytes_of("A really really long string..."), SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
}

TEST_F(SdoTest, GoesOnWithABlockWhenTheInterfaceQueueHasRoomAgain) {
  int room = 3;
  bus.refuse = [&room](const CanFrame&) { return room-- > 0 ? SendResult::sent : (room = 3, SendResult::queue_full); };
  Conversation c(
      bus, {"> 602#C60020001E000000", "< 582#A40020007F000000", "> 602#0141207265616C6C", "> 602#0279207265616C6C",
            "> 602#0379206C6F6E6720", "> 602#04737472696E672E", "> 602#852E2E0000000000", "< 582#A2057F0000000000",
            "> 602#D545690000000000", "< 582#A100000000000000"});
  download(writable_string, bytes_of("A really really long string..."), SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
}

TEST_F(SdoTest, ReadsABlock) {
  Conversation c(
      bus, {"> 602#A40810007F000000", "< 582#C60810001A000000", "> 602#A300000000000000", "< 582#0154696E79204E6F",
            "< 582#026465202D204D65", "< 582#03676120446F6D61", "< 582#84696E7320210000", "> 602#A2047F0000000000",
            "< 582#C940E10000000000", "> 602#A100000000000000"});
  upload(device_name, SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(text(), "Tiny Node - Mega Domains !");
}

TEST_F(SdoTest, AsksForALostSegmentOfABlockAgain) {
  Conversation c(bus, {"> 602#A40810007F000000", "< 582#C60810001A000000", "> 602#A300000000000000",
                       "< 582#0154696E79204E6F", "< 582#03676120446F6D61", "< 582#84696E7320210000",
                       "> 602#A2017F0000000000",  // got the first only
                       "< 582#016465202D204D65", "< 582#02676120446F6D61", "< 582#83696E7320210000",
                       "> 602#A2037F0000000000", "< 582#C940E10000000000", "> 602#A100000000000000"});
  upload(device_name, SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(text(), "Tiny Node - Mega Domains !");
}

TEST_F(SdoTest, AsksAgainWhenTheLastSegmentOfABlockIsLost) {
  Conversation c(
      bus, {"> 602#A40810007F000000", "< 582#C60810001A000000", "> 602#A300000000000000", "< 582#0154696E79204E6F",
            "< 582#026465202D204D65", "< 582#03676120446F6D61", "> 602#A2037F0000000000", "< 582#81696E7320210000",
            "> 602#A2017F0000000000", "< 582#C940E10000000000", "> 602#A100000000000000"});
  upload(device_name, SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(text(), "Tiny Node - Mega Domains !");
}

TEST_F(SdoTest, AbortsABlockOfAnotherChecksum) {
  Conversation c(
      bus, {"> 602#A40810007F000000", "< 582#C60810001A000000", "> 602#A300000000000000", "< 582#0154696E79204E6F",
            "< 582#026465202D204D65", "< 582#03676120446F6D61", "< 582#84696E7320210000", "> 602#A2047F0000000000",
            "< 582#C941E10000000000", "> 602#8008100004000405"});  // 0504 0004
  upload(device_name, SdoTransfer::block);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::aborted_by_client);
  EXPECT_EQ(sdo_abort_text(client.abort_code()), "CRC error (block mode only)");
}

TEST_F(SdoTest, SaysWhyTheServerAborted) {
  Conversation c(bus, {"> 602#4018100100000000", "< 582#8018100111000906"});
  upload({0x1018, 1});
  EXPECT_EQ(client.outcome(), SdoOutcome::aborted_by_server);
  EXPECT_EQ(client.abort_code(), 0x06090011U);
  EXPECT_EQ(describe_sdo_abort(client.abort_code()), "SDO abort 06090011: sub-index does not exist");
}

TEST_F(SdoTest, KnowsTheStandardsWordingOfEveryAbortCode) {
  for (const std::uint32_t code :
       {0x05030000U, 0x05040000U, 0x05040001U, 0x05040002U, 0x05040003U, 0x05040004U, 0x05040005U, 0x06010000U,
        0x06010001U, 0x06010002U, 0x06020000U, 0x06040041U, 0x06040042U, 0x06040043U, 0x06040047U, 0x06060000U,
        0x06070010U, 0x06070012U, 0x06070013U, 0x06090011U, 0x06090030U, 0x06090031U, 0x06090032U, 0x06090036U,
        0x060A0023U, 0x08000000U, 0x08000020U, 0x08000021U, 0x08000022U, 0x08000023U, 0x08000024U}) {
    EXPECT_NE(sdo_abort_text(code), "unknown abort code") << std::hex << code;
  }
  EXPECT_EQ(sdo_abort_text(0x12345678), "unknown abort code");
}

TEST_F(SdoTest, TellsTheServerWhenItWaitedTooLong) {
  Conversation c(bus, {"> 602#4018100100000000", "> 602#8018100100000405"});
  const std::int64_t begin_ns = network.time_ns;
  upload({0x1018, 1});
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.outcome(), SdoOutcome::timed_out);
  EXPECT_EQ(network.time_ns - begin_ns, SdoClientConfig{}.timeout_ns);
}

TEST_F(SdoTest, AbortsAToggleBitThatDoesNotAlternate) {
  Conversation c(
      bus, {"> 602#4008100000000000", "< 582#410810001A000000", "> 602#6000000000000000", "< 582#0054696E79204E6F",
            "> 602#7000000000000000", "< 582#006465202D204D65", "> 602#8008100000000305"});
  upload(device_name);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.abort_code(), sdo_abort::toggle_not_alternated);
}

TEST_F(SdoTest, AbortsSegmentsThatDoNotAddUpToTheirSize) {
  Conversation c(bus, {"> 602#4008100000000000", "< 582#410810001A000000", "> 602#6000000000000000",
                       "< 582#0154696E79204E6F", "> 602#8008100010000706"});
  upload(device_name);
  EXPECT_TRUE(c.complete()) << c.mistakes;
}

TEST_F(SdoTest, RefusesASizeThatNoObjectHas) {
  Conversation c(bus, {"> 602#4008100000000000", "< 582#41081000FFFFFFFF", "> 602#8008100005000405"});
  upload(device_name);
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(client.abort_code(), sdo_abort::out_of_memory);
}

// --- aborts of the transfer layer (CiA 301, 7.2.4.3.17), the client's own: what it is sent, and what it says to that

enum class Way { segmented_upload, segmented_download, block_upload, block_download };

struct AbortCase {
  const char* name;
  Way way;
  std::vector<std::string> lines;
  std::uint32_t code;
};

const std::vector<std::string> block_download_begin{"> 602#C60020001E000000"};
const std::vector<std::string> block_segments{"> 602#0141207265616C6C", "> 602#0279207265616C6C",
                                              "> 602#0379206C6F6E6720", "> 602#04737472696E672E",
                                              "> 602#852E2E0000000000"};
const std::vector<std::string> block_upload_begin{"> 602#A40810007F000000"};

std::vector<std::string> operator+(std::vector<std::string> one, const std::vector<std::string>& two) {
  one.insert(one.end(), two.begin(), two.end());
  return one;
}

const std::vector<std::string> block_uploaded =
    block_upload_begin + std::vector<std::string>{"< 582#C20810001A000000", "> 602#A300000000000000",
                                                  "< 582#0154696E79204E6F", "< 582#026465202D204D65",
                                                  "< 582#03676120446F6D61", "< 582#84696E7320210000",
                                                  "> 602#A2047F0000000000"};

const std::vector<AbortCase> abort_cases{
    {"toggle bit of a download",
     Way::segmented_download,
     {"> 602#210020000D000000", "< 582#6000200000000000", "> 602#0041206C6F6E6720", "< 582#3000000000000000",
      "> 602#8000200000000305"},
     0x05030000},
    {"no command of a segmented download",
     Way::segmented_download,
     {"> 602#210020000D000000", "< 582#6000200000000000", "> 602#0041206C6F6E6720", "< 582#4000000000000000",
      "> 602#8000200001000405"},
     0x05040001},
    {"no command of a segmented upload",
     Way::segmented_upload,
     {"> 602#4008100000000000", "< 582#410810001A000000", "> 602#6000000000000000", "< 582#2000000000000000",
      "> 602#8008100001000405"},
     0x05040001},
    {"a segment shorter than it says",
     Way::segmented_upload,
     {"> 602#4008100000000000", "< 582#410810001A000000", "> 602#6000000000000000", "< 582#0054696E79",
      "> 602#8008100010000706"},
     0x06070010},
    {"blocks of no segment", Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A400200000000000", "> 602#8000200002000405"}, 0x05040002},
    {"blocks of 128 segments", Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A400200080000000", "> 602#8000200002000405"}, 0x05040002},
    {"more segments acknowledged than sent", Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A40020007F000000"} + block_segments +
         std::vector<std::string>{"< 582#A2067F0000000000", "> 602#8000200003000405"},
     0x05040003},
    {"a next block of no segment", Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A40020007F000000"} + block_segments +
         std::vector<std::string>{"< 582#A205000000000000", "> 602#8000200002000405"},
     0x05040002},
    {"no acknowledgement of a block", Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A40020007F000000"} + block_segments +
         std::vector<std::string>{"< 582#A100000000000000", "> 602#8000200001000405"},
     0x05040001},
    {"segment number 0", Way::block_upload,
     block_upload_begin + std::vector<std::string>{"< 582#C20810001A000000", "> 602#A300000000000000",
                                                   "< 582#0054696E79204E6F", "> 602#8008100003000405"},
     0x05040003},
    {"a short segment in the middle", Way::block_upload,
     block_upload_begin + std::vector<std::string>{"< 582#C20810001A000000", "> 602#A300000000000000",
                                                   "< 582#0154696E79", "> 602#8008100010000706"},
     0x06070010},
    {"a block of 4 GiB", Way::block_upload,
     block_upload_begin + std::vector<std::string>{"< 582#C2081000FFFFFFFF", "> 602#8008100005000405"}, 0x05040005},
    {"no end of a block", Way::block_upload,
     block_uploaded + std::vector<std::string>{"< 582#C400000000000000", "> 602#8008100001000405"}, 0x05040001},
    {"a block of another size than announced", Way::block_upload,
     block_uploaded + std::vector<std::string>{"< 582#C500000000000000", "> 602#8008100010000706"}, 0x06070010},
};

struct SdoAborts : SdoTest {
  void transfer(Way way) {
    switch (way) {
      case Way::segmented_upload:
        return upload(device_name);
      case Way::segmented_download:
        return download(writable_string, bytes_of("A long string"));
      case Way::block_upload:
        return upload(device_name, SdoTransfer::block);
      case Way::block_download:
        return download(writable_string, bytes_of("A really really long string..."), SdoTransfer::block);
    }
  }
};

TEST_F(SdoAborts, SaysByTheStandardsNumbersWhatIsWrongWithATransfer) {
  for (const AbortCase& each : abort_cases) {
    SCOPED_TRACE(each.name);
    Conversation c(bus, each.lines);
    transfer(each.way);
    EXPECT_TRUE(c.complete()) << c.mistakes;
    EXPECT_EQ(client.outcome(), SdoOutcome::aborted_by_client);
    EXPECT_EQ(client.abort_code(), each.code);
  }
}

TEST_F(SdoAborts, RefusesToTakeMoreThanThereIsRoomFor) {
  SdoClient small(bus, 2, {.max_upload_bytes = 10});
  Conversation c(
      bus, {"> 602#4008100000000000", "< 582#4008100000000000", "> 602#6000000000000000", "< 582#0054696E79204E6F",
            "> 602#7000000000000000", "< 582#106465202D204D65", "> 602#8008100005000405"});
  small.start_upload(device_name, network.time_ns);
  pump_frames(
      network, network.time_ns + 1'000'000'000,
      [&](std::size_t, const TimedFrame& received) { small.on_frame(received.frame, received.time_ns); },
      [&](std::int64_t now_ns) {
        small.poll(now_ns);
        return small.finished() ? pump_done : small.wake_ns(now_ns);
      });
  EXPECT_TRUE(c.complete()) << c.mistakes;
  EXPECT_EQ(small.abort_code(), sdo_abort::out_of_memory);
}

// Whole conversations of each kind, cut off before each of the server's answers.
const std::vector<std::pair<Way, std::vector<std::string>>> whole_transfers{
    {Way::segmented_upload,
     {"> 602#4008100000000000", "< 582#410810001A000000", "> 602#6000000000000000", "< 582#0054696E79204E6F",
      "> 602#7000000000000000", "< 582#106465202D204D65"}},
    {Way::segmented_download,
     {"> 602#210020000D000000", "< 582#6000200000000000", "> 602#0041206C6F6E6720", "< 582#2000200000000000",
      "> 602#13737472696E6700", "< 582#3000200000000000"}},
    {Way::block_upload, block_uploaded + std::vector<std::string>{"< 582#C900000000000000"}},
    {Way::block_download,
     block_download_begin + std::vector<std::string>{"< 582#A40020007F000000"} + block_segments +
         std::vector<std::string>{"< 582#A2057F0000000000", "> 602#D545690000000000", "< 582#A100000000000000"}}};

TEST_F(SdoAborts, GivesUpWhereverAServerFallsSilent) {
  for (const auto& whole : whole_transfers) {
    const Way way = whole.first;
    const std::vector<std::string>& lines = whole.second;
    for (std::size_t cut = 0; cut < lines.size(); ++cut) {
      if (lines[cut][0] != '<') continue;
      SCOPED_TRACE(::testing::Message() << "way " << static_cast<int>(way) << ", before " << lines[cut]);
      std::vector<CanFrame> sent;
      std::size_t next = 0;
      const auto answer = [&] {
        for (; next < cut && lines[next][0] == '<'; ++next) bus.arrive(lines[next].substr(2), 100'000);
      };
      bus.on_send = [&](const CanFrame& frame) {
        sent.push_back(frame);
        if (next < cut && lines[next][0] == '>') ++next;
        answer();
      };
      const std::int64_t begun_ns = network.time_ns;
      transfer(way);
      bus.on_send = nullptr;
      EXPECT_EQ(client.outcome(), SdoOutcome::timed_out);
      ASSERT_FALSE(sent.empty());
      EXPECT_EQ(text_of(sent.back()).substr(0, 6), "602#80");
      EXPECT_EQ(text_of(sent.back()).substr(12), "00000405");
      // Each answer may take the timeout, and a block is asked for again as often as it may be.
      const std::int64_t most = static_cast<std::int64_t>(SdoClientConfig{}.max_block_repeats) + 1;
      EXPECT_LE(network.time_ns - begun_ns, most * SdoClientConfig{}.timeout_ns + 10'000'000);
    }
  }
}

TEST_F(SdoAborts, EndsWhereverAServerAborts) {
  for (const auto& [way, lines] : whole_transfers) {
    const bool upload_way = way == Way::segmented_upload || way == Way::block_upload;
    for (std::size_t cut = 0; cut < lines.size(); ++cut) {
      if (lines[cut][0] != '<') continue;
      SCOPED_TRACE(::testing::Message() << "way " << static_cast<int>(way) << ", instead of " << lines[cut]);
      std::vector<std::string> cut_off(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(cut));
      cut_off.emplace_back(upload_way ? "< 582#8008100022000008" : "< 582#8000200022000008");
      Conversation c(bus, cut_off);
      transfer(way);
      EXPECT_TRUE(c.complete()) << c.mistakes;
      EXPECT_EQ(client.outcome(), SdoOutcome::aborted_by_server);
      EXPECT_EQ(describe_sdo_abort(client.abort_code()),
                "SDO abort 08000022: data cannot be transferred or stored to the application because of the present "
                "device state");
    }
  }
}

TEST_F(SdoTest, IgnoresLateAnswersToAnotherObject) {
  Conversation c(
      bus, {"> 602#4018100100000000", "< 582#4300100092010200", "< 582#8000100000000206", "< 582#4318100104000000"});
  upload({0x1018, 1});
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
  EXPECT_EQ(text(), std::string("\x04\x00\x00\x00", 4));
  EXPECT_EQ(client.stale_answers(), 2U);
}

TEST_F(SdoTest, PassesFramesOfOthersOn) {
  Conversation c(bus, {"> 602#4018100100000000", "< 702#7F", "< 583#4318100104000000", "< 182#370600000000",
                       "< 582#4318100104000000"});
  upload({0x1018, 1});
  EXPECT_EQ(client.outcome(), SdoOutcome::done);
  EXPECT_EQ(others, (std::vector<std::string>{"702#7F", "583#4318100104000000", "182#370600000000"}));
}

TEST_F(SdoTest, NoticesAnInterfaceThatIsDown) {
  bus.refuse = [](const CanFrame&) { return SendResult::down; };
  upload({0x1018, 1});
  EXPECT_EQ(client.outcome(), SdoOutcome::not_sent);
}

TEST(SdoCrc, IsTheOneOfTheStandard) { EXPECT_EQ(sdo_crc(bytes_of("123456789")), 0x31C3); }

// A server that answers with anything: the client must end, in time, within its memory, whatever comes.
TEST_F(SdoTest, SurvivesRandomAnswers) {
  constexpr unsigned seed = 20070322;
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);
  const char* scale = std::getenv("PROXARM_TEST_SCALE");
  const int runs = static_cast<int>(3000 * (scale != nullptr ? std::atof(scale) : 1.0));
  for (int i = 0; i < runs; ++i) {
    bus.sent.clear();
    int budget = 300;
    bus.on_send = [&](const CanFrame& request) {
      if (--budget < 0) return;
      const auto count = random() % 3;
      for (unsigned n = 0; n < count; ++n) {
        CanFrame answer;
        answer.id = 0x582;
        answer.length = static_cast<std::uint8_t>(random() % 5 == 0 ? random() % 9 : 8);
        for (std::uint8_t& byte : answer.data) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? 0 : random());
        // Often the right object and a plausible command, so that the deeper states are reached.
        if (random() % 2 == 0) std::copy_n(request.data.begin() + 1, 3, answer.data.begin() + 1);
        constexpr std::uint8_t plausible[] = {0x41, 0x43, 0x60, 0x00, 0x10, 0x20, 0x30,
                                              0xA4, 0xA2, 0xA1, 0xC6, 0xC1, 0x01, 0x81};
        if (random() % 2 == 0) answer.data[0] = plausible[random() % std::size(plausible)];
        bus.arrive(answer);
      }
    };
    const auto transfer = random() % 2 == 0 ? SdoTransfer::block : SdoTransfer::automatic;
    if (random() % 2 == 0) {
      upload({0x2000, 1}, transfer);
    } else {
      download({0x2000, 1}, std::vector<std::uint8_t>(random() % 300, 0x5A), transfer);
    }
    ASSERT_TRUE(client.finished());
    ASSERT_LE(client.data().size(), SdoClientConfig{}.max_upload_bytes);
    TimedFrame left;
    network.time_ns += 1'000'000'000;
    while (bus.receive(left)) client.on_frame(left.frame, left.time_ns);
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
