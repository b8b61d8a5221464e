// EDS and DCF files: what is read from them, and where a mistake is said to be.
#include "models/files/eds_file.hpp"

#include <gmock/gmock.h>

#include "models/base/setup_error.hpp"
#include "models/files/eds_bitrates.hpp"
#include "tests/source_file.hpp"

namespace proxarm::description {
namespace {

using ::testing::HasSubstr;

TEST(EdsBitrates, AreThoseThatTheFileLists) {
  const std::string text = "[DeviceInfo]\nBaudRate_500=1\nbaudrate_1000=0x1\nBaudRate_250=0\n";
  EXPECT_NO_THROW(require_bitrate(text, "drive.eds", 500'000));
  EXPECT_NO_THROW(require_bitrate(text, "drive.eds", 1'000'000));
  EXPECT_NO_THROW(require_bitrate("[DeviceInfo]\n", "drive.eds", 123'456)) << "it says nothing of them";
  try {
    require_bitrate(text, "drive.eds", 250'000);
    FAIL();
  } catch (const SetupError& error) {
    EXPECT_STREQ(error.what(),
                 "drive.eds:4: [deviceinfo] BaudRate_250: found not there, or 0, expected 1: the cell's bus runs at "
                 "250000 bit/s, this device at 500000, 1000000");
  }
}

// As makers' tools write them: any case, comments, signed and octal numbers, $NODEID, compact arrays.
constexpr const char* small = R"([FileInfo]
FileName=small.eds
; a comment
[DeviceInfo]
VendorName=Somebody
vendornumber=0x000000AB
ProductNumber=17

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=const
DefaultValue=0x00020192
PDOMapping=0

[1016]
ParameterName=Consumer heartbeat time
ObjectType=0x8
DataType=0x0007
AccessType=rw
CompactSubObj=3

[60c2]
ParameterName=Interpolation time period
ObjectType=0x9
SubNumber=3

[60C2sub2]
ParameterName=Interpolation time index
DataType=0x0002
AccessType=RW
DefaultValue=-3
PDOMapping=0

[1008]
ParameterName=Name
DataType=0x0009
AccessType=ro
DefaultValue=a drive

[1014]
ParameterName=COB-ID EMCY
DataType=0x0007
AccessType=ro
DefaultValue=$NODEID+0x80
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  try {
    parse_eds(text, "drive.eds");
  } catch (const SetupError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(EdsFile, HoldsIdentityAndObjects) {
  const EdsFile eds = parse_eds(small, "drive.eds");
  EXPECT_EQ(eds.vendor, 0xABu);
  EXPECT_EQ(eds.product, 17u);
  EXPECT_FALSE(eds.revision);
  EXPECT_FALSE(eds.node);
  ASSERT_NE(eds.find(0x100000), nullptr);
  EXPECT_EQ(eds.find(0x100000)->default_value, 0x00020192u);
  EXPECT_FALSE(eds.find(0x100000)->writable);
  EXPECT_EQ(eds.find(0x100000)->line, 9);
  EXPECT_EQ(eds.find(0x60C202)->default_value, 0xFDu) << "−3 as its eight bits are";
  EXPECT_TRUE(eds.find(0x60C202)->writable);
  EXPECT_EQ(eds.find(0x60C200), nullptr) << "it has no section of its own here";
  EXPECT_EQ(eds.find(0x101603)->bits, 32);
  EXPECT_EQ(eds.find(0x101600)->bits, 8);
  EXPECT_EQ(eds.find(0x101604), nullptr);
  EXPECT_EQ(eds.find(0x100800)->bits, 0) << "a text";
  EXPECT_FALSE(eds.find(0x101400)->default_value) << "by the node's number";
}

TEST(EdsFile, HoldsWhatADcfSets) {
  std::string text = with(small, "DefaultValue=-3", "DefaultValue=-3\nParameterValue=-6");
  text += "[DeviceComissioning]\nNodeID=5\n";
  const EdsFile dcf = parse_eds(text, "drive.dcf");
  EXPECT_EQ(dcf.node, 5);
  EXPECT_EQ(dcf.find(0x60C202)->value, 0xFAu);
}

TEST(EdsFile, SaysWhereItIsWrong) {
  EXPECT_THAT(refusal(with(small, "DefaultValue=0x00020192", "DefaultValue=0x20192x")),
              HasSubstr("drive.eds:14: [1000] DefaultValue: found \"0x20192x\", expected a whole number"));
  EXPECT_THAT(refusal(with(small, "DefaultValue=-3", "DefaultValue=-300")),
              HasSubstr("drive.eds:33: [60c2sub2] Default"));
  EXPECT_THAT(refusal(with(small, "DataType=0x0002\n", "")),
              HasSubstr("drive.eds:29: [60c2sub2] DataType: found none"));
  EXPECT_THAT(refusal(with(small, "AccessType=RW", "AccessType=maybe")),
              HasSubstr("drive.eds:32: [60c2sub2] AccessType"));
  EXPECT_THAT(refusal(with(small, "PDOMapping=0", "PDOMapping=2")), HasSubstr("drive.eds:15: [1000] PDOMapping"));
  EXPECT_THAT(refusal(with(small, "CompactSubObj=3", "CompactSubObj=300")), HasSubstr("CompactSubObj"));
  EXPECT_THAT(refusal(with(small, "vendornumber=0x000000AB", "VendorNumber=0x1000000AB")), HasSubstr("drive.eds:6:"));
  EXPECT_THAT(refusal(with(small, "ObjectType=0x9", "no equals sign")), HasSubstr("drive.eds:26: "));
  EXPECT_THAT(refusal(with(small, "[1014]", "[1008]")), HasSubstr("duplicate"));
  EXPECT_THAT(refusal(with(small, "[DeviceInfo]", "[Device]")), HasSubstr("[DeviceInfo]"));
  EXPECT_THAT(refusal("hello"), HasSubstr("drive.eds:1: "));
  EXPECT_THAT(refusal(""), HasSubstr("drive.eds"));
}

TEST(EdsFile, OfTheSimulatedDriveIsShipped) {
  const EdsFile eds = load_eds(source_file("models/drives/simulated_drive.eds"));
  EXPECT_EQ(eds.find(0x650200)->default_value, 0x2C0u);
  EXPECT_TRUE(eds.find(0x607100)->mappable);
  EXPECT_THROW((void)load_eds("/nowhere/drive.eds"), SetupError);
}

}  // namespace
}  // namespace proxarm::description
