// SDO conversations, byte by byte as CiA 301 (7.2.4.3) lays them out; none of these bytes come from our own client.
#include "sim/canopen/sdo_server.hpp"

#include <numeric>
#include <random>

#include "tests/sim/devices/device_harness.hpp"

namespace proxarm::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct SdoServerTest : ::testing::Test {
  SdoServerTest() {
    od.add(0x1000, 0, DataType::unsigned32, Access::constant, 0x00020192);
    od.add(0x1017, 0, DataType::unsigned16, Access::read_write, 0);
    od.add(0x6040, 0, DataType::unsigned16, Access::write_only, 0);
    od.add(0x6060, 0, DataType::integer8, Access::read_write, 0);
    ObjectEntry& limited = od.add(0x60C2, 2, DataType::integer8, Access::read_write, -3);
    limited.minimum = -6;
    limited.maximum = 0;
    od.add(0x607A, 0, DataType::integer32, Access::read_write, 0);
    od.add_text(0x1008, 0, "proxarm drive");
    od.add_domain(0x2100, 0, Access::read_write, 2000);
  }
  std::vector<std::string> ask(const std::string& bytes) {
    const fieldbus::CanFrame frame = testing::from_text("601#" + bytes);
    SdoServer::Message request;
    std::copy_n(frame.data.begin(), 8, request.begin());
    std::vector<std::string> texts;
    for (const auto& message : server.on_request(request)) {
      fieldbus::CanFrame answer;
      answer.length = 8;
      std::copy(message.begin(), message.end(), answer.data.begin());
      texts.push_back(testing::to_text(answer).substr(4));
    }
    return texts;
  }
  ObjectDictionary od;
  SdoServer server{od};
};

TEST_F(SdoServerTest, AnswersExpeditedUploads) {
  EXPECT_THAT(ask("40 00 10 00 00 00 00 00"), ElementsAre("4300100092010200"));
  EXPECT_THAT(ask("40 17 10 00 00 00 00 00"), ElementsAre("4B17100000000000"));
  EXPECT_THAT(ask("40 C2 60 02 00 00 00 00"), ElementsAre("4FC26002FD000000"));
}

TEST_F(SdoServerTest, TakesExpeditedDownloads) {
  EXPECT_THAT(ask("2B 17 10 00 64 00 00 00"), ElementsAre("6017100000000000"));
  EXPECT_EQ(od.number(0x1017), 100);
  EXPECT_THAT(ask("23 7A 60 00 FE FF FF FF"), ElementsAre("607A600000000000"));
  EXPECT_EQ(od.number(0x607A), -2);
  EXPECT_THAT(ask("2F 60 60 00 08 00 00 00"), ElementsAre("6060600000000000"));
  EXPECT_EQ(od.number(0x6060), 8);
  // e = 1, s = 0: the object's own length counts
  EXPECT_THAT(ask("22 17 10 00 C8 00 77 77"), ElementsAre("6017100000000000"));
  EXPECT_EQ(od.number(0x1017), 200);
}

TEST_F(SdoServerTest, AbortsWithTheStandardsCodes) {
  EXPECT_THAT(ask("40 34 12 00 00 00 00 00"), ElementsAre("8034120000000206"));  // object does not exist
  EXPECT_THAT(ask("40 C2 60 07 00 00 00 00"), ElementsAre("80C2600711000906"));  // subindex does not exist
  EXPECT_THAT(ask("23 00 10 00 00 00 00 00"), ElementsAre("8000100002000106"));  // write of a read-only object
  EXPECT_THAT(ask("40 40 60 00 00 00 00 00"), ElementsAre("8040600001000106"));  // read of a write-only object
  EXPECT_THAT(ask("23 17 10 00 64 00 00 00"), ElementsAre("8017100012000706"));  // length too high
  EXPECT_THAT(ask("2F 17 10 00 64 00 00 00"), ElementsAre("8017100013000706"));  // length too low
  EXPECT_THAT(ask("2F C2 60 02 01 00 00 00"), ElementsAre("80C2600231000906"));  // value too high
  EXPECT_THAT(ask("2F C2 60 02 F0 00 00 00"), ElementsAre("80C2600232000906"));  // value too low
  EXPECT_THAT(ask("E0 00 10 00 00 00 00 00"), ElementsAre("8000100001000405"));  // command specifier unknown
  EXPECT_THAT(ask("60 00 00 00 00 00 00 00"), ElementsAre(::testing::EndsWith("01000405")));  // segment of nothing
  EXPECT_EQ(od.number(0x1017), 0);
}

TEST_F(SdoServerTest, UploadsATextInSegments) {
  EXPECT_THAT(ask("40 08 10 00 00 00 00 00"), ElementsAre("410810000D000000"));
  EXPECT_THAT(ask("60 00 00 00 00 00 00 00"), ElementsAre("0070726F7861726D"));  // "proxarm"
  EXPECT_THAT(ask("70 00 00 00 00 00 00 00"), ElementsAre("1320647269766500"));  // " drive", one byte unused, last
  EXPECT_THAT(ask("60 00 00 00 00 00 00 00"), ElementsAre(::testing::EndsWith("01000405")));
}

TEST_F(SdoServerTest, DownloadsInSegmentsAndRefusesAToggleBitThatStays) {
  EXPECT_THAT(ask("21 00 21 00 09 00 00 00"), ElementsAre("6000210000000000"));
  EXPECT_THAT(ask("00 01 02 03 04 05 06 07"), ElementsAre("2000000000000000"));
  EXPECT_THAT(ask("1B 08 09 00 00 00 00 00"), ElementsAre("3000000000000000"));
  EXPECT_THAT(od.at(0x2100).value, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));

  EXPECT_THAT(ask("21 00 21 00 09 00 00 00"), ElementsAre("6000210000000000"));
  EXPECT_THAT(ask("10 FF 02 03 04 05 06 07"), ElementsAre("8000210000000305"));  // toggle bit not alternated
  EXPECT_EQ(od.at(0x2100).value.size(), 9u);
}

TEST_F(SdoServerTest, RefusesASegmentedDownloadThatIsNotAsLongAsAnnounced) {
  ask("21 00 21 00 09 00 00 00");
  ask("00 01 02 03 04 05 06 07");
  EXPECT_THAT(ask("1D 08 00 00 00 00 00 00"), ElementsAre("8000210010000706"));  // length doesn't match
  EXPECT_THAT(ask("21 00 21 00 D1 07 00 00"), ElementsAre("8000210012000706"));  // 2001 bytes: too long
}

TEST_F(SdoServerTest, ComputesTheCrcOfTheStandardsExample) {
  const std::string digits = "123456789";  // check value of this CRC in catalogues: 31C3h
  EXPECT_EQ(sdo_block_crc({reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size()}), 0x31C3);
}

TEST_F(SdoServerTest, DownloadsABlock) {
  EXPECT_THAT(ask("C6 00 21 00 09 00 00 00"), ElementsAre("A40021007F000000"));
  EXPECT_THAT(ask("01 31 32 33 34 35 36 37"), IsEmpty());
  EXPECT_THAT(ask("82 38 39 00 00 00 00 00"), ElementsAre("A2027F0000000000"));
  EXPECT_THAT(ask("D5 C3 31 00 00 00 00 00"), ElementsAre("A100000000000000"));  // 5 bytes unused, CRC 31C3h
  EXPECT_EQ(std::string(od.at(0x2100).value.begin(), od.at(0x2100).value.end()), "123456789");
}

TEST_F(SdoServerTest, AsksForLostSegmentsOfABlockAgain) {
  ask("C6 00 21 00 0F 00 00 00");
  EXPECT_THAT(ask("01 01 02 03 04 05 06 07"), IsEmpty());
  EXPECT_THAT(ask("83 0F 00 00 00 00 00 00"), ElementsAre("A2017F0000000000"));  // 2 never came
  EXPECT_THAT(ask("01 08 09 0A 0B 0C 0D 0E"), IsEmpty());
  EXPECT_THAT(ask("82 0F 00 00 00 00 00 00"), ElementsAre("A2027F0000000000"));
  std::vector<std::uint8_t> sent(15);
  std::iota(sent.begin(), sent.end(), std::uint8_t{1});
  const std::uint16_t crc = sdo_block_crc(sent);
  char end[32];
  std::snprintf(end, sizeof end, "D9 %02X %02X 00 00 00 00 00", crc & 0xFFu, crc >> 8u);
  EXPECT_THAT(ask(end), ElementsAre("A100000000000000"));
  EXPECT_EQ(od.at(0x2100).value, sent);
}

TEST_F(SdoServerTest, RefusesABlockWithAWrongCrc) {
  ask("C6 00 21 00 09 00 00 00");
  ask("01 31 32 33 34 35 36 37");
  ask("82 38 39 00 00 00 00 00");
  EXPECT_THAT(ask("D5 C4 31 00 00 00 00 00"), ElementsAre("8000210004000405"));
  EXPECT_THAT(od.at(0x2100).value, IsEmpty());
}

// The end request says how many bytes of the last segment are no data. gcc took the subtraction for one that may go
// below zero; it can't: the phase is reached with one segment at least, and the number has three bits.
TEST_F(SdoServerTest, ABlockOfWhichNoByteIsDataIsEmpty) {
  ask("C0 00 21 00 00 00 00 00");
  ask("81 31 32 33 34 35 36 37");
  EXPECT_THAT(ask("DD 00 00 00 00 00 00 00"), ElementsAre("A100000000000000"));
  EXPECT_THAT(od.at(0x2100).value, IsEmpty());
}

TEST_F(SdoServerTest, ABlockCannotEndBeforeItsFirstSegment) {
  ask("C0 00 21 00 00 00 00 00");
  // In this phase it is a segment, 5Dh, and out of order.
  EXPECT_THAT(ask("DD 00 00 00 00 00 00 00"), ElementsAre("A2007F0000000000"));
  EXPECT_THAT(od.at(0x2100).value, IsEmpty());
}

TEST_F(SdoServerTest, UploadsABlockAndRepeatsWhatWasLost) {
  const std::string digits = "123456789";
  od.at(0x2100).value.assign(digits.begin(), digits.end());
  EXPECT_THAT(ask("A4 00 21 00 7F 00 00 00"), ElementsAre("C600210009000000"));
  EXPECT_THAT(ask("A3 00 00 00 00 00 00 00"), ElementsAre("0131323334353637", "8238390000000000"));
  EXPECT_THAT(ask("A2 01 7F 00 00 00 00 00"), ElementsAre("8138390000000000"));
  EXPECT_THAT(ask("A2 01 7F 00 00 00 00 00"), ElementsAre("D5C3310000000000"));
  EXPECT_THAT(ask("A1 00 00 00 00 00 00 00"), IsEmpty());
}

TEST_F(SdoServerTest, SwitchesABlockUploadToTheNormalOneBelowTheThreshold) {
  EXPECT_THAT(ask("A4 00 10 00 7F 04 00 00"), ElementsAre("4300100092010200"));
  EXPECT_THAT(ask("A4 00 10 00 00 00 00 00"), ElementsAre("8000100002000405"));  // invalid block size
}

// Whatever comes, each request gets at most a sub-block of answers, and the server still works afterwards.
TEST_F(SdoServerTest, SurvivesRandomRequests) {
  constexpr unsigned seed = 20070322;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> byte(0, 255);
  const std::uint16_t indices[] = {0x1000, 0x1008, 0x1017, 0x2100, 0x60C2, 0x1234};
  for (int i = 0; i < testing::scaled(200'000); ++i) {
    SdoServer::Message request;
    for (auto& b : request) b = static_cast<std::uint8_t>(byte(random));
    if (i % 2 == 0) {
      const std::uint16_t index = indices[static_cast<std::size_t>(byte(random)) % std::size(indices)];
      request[1] = static_cast<std::uint8_t>(index);
      request[2] = static_cast<std::uint8_t>(index >> 8);
      request[3] &= 0x03;
    }
    ASSERT_LE(server.on_request(request).size(), 127u);
  }
  EXPECT_LE(od.at(0x2100).value.size(), 2000u);
  EXPECT_EQ(od.at(0x1017).value.size(), 2u);
  ask("80 00 00 00 00 00 04 05");
  EXPECT_THAT(ask("40 00 10 00 00 00 00 00"), ElementsAre("4300100092010200"));
}

}  // namespace
}  // namespace proxarm::sim
