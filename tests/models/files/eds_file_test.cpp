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

// One object that is wrong is told, and refused by whoever needs it (eds_check_test.cpp); the others are of use.
TEST(EdsFile, KeepsAMistakeWithItsObject) {
  const auto mistake_of = [](std::uint32_t object, const std::string& from, const std::string& to) {
    const EdsFile eds = parse_eds(with(small, from, to), "drive.eds");
    EXPECT_EQ(eds.remarks.size(), 1u) << to;
    EXPECT_NE(eds.find(object), nullptr) << to;
    std::size_t wrong = 0;
    for (const auto& [address, other] : eds.objects) wrong += other.mistake.empty() ? 0 : 1;
    EXPECT_LE(wrong, 1u) << to;
    return eds.find(object) == nullptr ? "" : eds.find(object)->mistake;
  };
  EXPECT_THAT(mistake_of(0x60C202, "DataType=0x0002\n", ""),
              HasSubstr("drive.eds:29: [60c2sub2] DataType: found none"));
  EXPECT_THAT(mistake_of(0x60C202, "AccessType=RW", "AccessType=maybe"),
              HasSubstr("drive.eds:32: [60c2sub2] AccessType"));
  EXPECT_THAT(mistake_of(0x100000, "PDOMapping=0", "PDOMapping=2"), HasSubstr("drive.eds:15: [1000] PDOMapping"));
  EXPECT_THAT(mistake_of(0x101600, "CompactSubObj=3", "CompactSubObj=300"), HasSubstr("CompactSubObj"));
  EXPECT_THAT(mistake_of(0x100000, "AccessType=const", "AccessType=const\nno equals sign"),
              HasSubstr("drive.eds:14: [1000]: found \"no equals sign\""));
  EXPECT_THAT(mistake_of(0x100800, "[1014]", "[1008]"), HasSubstr("twice"));
}

TEST(EdsFile, TakesADefaultThatItCanNotReadForUnknown) {
  for (const char* value : {"0x20192x", "0.0", "08", "1e3", "0x1FFFFFFFF", "yes", "0x", "-"}) {
    const EdsFile eds =
        parse_eds(with(small, "DefaultValue=0x00020192", std::string("DefaultValue=") + value), "drive.eds");
    EXPECT_FALSE(eds.find(0x100000)->default_value) << value;
    EXPECT_EQ(eds.find(0x100000)->mistake, "") << value;
    ASSERT_EQ(eds.remarks.size(), 1u) << value;
    EXPECT_THAT(eds.remarks[0], HasSubstr("drive.eds:14: [1000] DefaultValue: found \""));
  }
}

// What other tools write, and what it stands for: as public trackers of EDS editors and stacks tell of makers' files.
TEST(EdsFile, ReadsWhatMakersWrite) {
  struct Case {
    const char *from, *to;
    std::uint32_t object, value;  // its default
  };
  const Case cases[] = {
      {"DefaultValue=0x00020192", "DefaultValue= 0x00020192 ", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0X20192", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=131474", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=+131474", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0400622", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0x20192 ; servo", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0x20192\r", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "defaultvalue\t=\t0x20192", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0x20192\nDefaultValue=0x20192", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=0x20192\nLowLimit=\nHighLimit=\nObjFlags=0x0", 0x100000, 0x20192},
      {"DefaultValue=0x00020192", "DefaultValue=-1", 0x100000, 0xFFFFFFFF},
      {"PDOMapping=0", "PDOMapping=", 0x100000, 0x20192},
      {"PDOMapping=0", "PDOMapping=0x0", 0x100000, 0x20192},
      {"PDOMapping=0\n", "", 0x100000, 0x20192},
      {"ObjectType=0x7\nDataType=0x0007\nAccessType=const", "DataType=7\nAccessType=CONST", 0x100000, 0x20192},
      {"[1000]", "[1000] ; device type", 0x100000, 0x20192},
      {"[1000]", "[ 1000 ]", 0x100000, 0x20192},
      {"[FileInfo]", "\xEF\xBB\xBF[FileInfo]", 0x100000, 0x20192},
      {"[DeviceInfo]", "[Comments]\nLines=1\nA line that is none\n[DeviceInfo]", 0x100000, 0x20192},
      {"VendorName=Somebody", "VendorName=Some=body GmbH \xFC", 0x100000, 0x20192},
      {"[1000]", "[2000]\nParameterName=A number\nDataType=0x0008\nAccessType=rw\nDefaultValue=12.5\n[1000]", 0x200000,
       0x41480000},
      {"[1000]", "[2000]\nParameterName=A number\nDataType=8\nAccessType=rw\nDefaultValue=-1.5e2\n[1000]", 0x200000,
       0xC3160000},
      {"[1000]", "[2000]\nParameterName=A number\nDataType=0x8\nAccessType=rw\nDefaultValue=0x41480000\n[1000]",
       0x200000, 0x41480000},
      {"[1000]", "[2000]\nParameterName=A flag\nDataType=0x1\nAccessType=rw\nDefaultValue=1\n[1000]", 0x200000, 1},
      {"[1000]", "[2000sub3]\nParameterName=Without parent\nDataType=5\nAccessType=rw\nDefaultValue=9\n[1000]",
       0x200003, 9},
      {"[1000]", "[2000SUBA]\nParameterName=Tenth\nDataType=5\nAccessType=rw\nDefaultValue=9\n[1000]", 0x20000A, 9},
      {"DefaultValue=-3", "DefaultValue=0xFD", 0x60C202, 0xFD},
      {"DefaultValue=-3", "DefaultValue=0xFFFFFFFD", 0x60C202, 0xFD},
      {"DefaultValue=-3", "DefaultValue=253", 0x60C202, 0xFD},
  };
  for (const Case& test : cases) {
    const EdsFile eds = parse_eds(with(small, test.from, test.to), "drive.eds");
    ASSERT_NE(eds.find(test.object), nullptr) << test.to;
    EXPECT_EQ(eds.find(test.object)->default_value, test.value) << test.to;
    EXPECT_THAT(eds.remarks, ::testing::IsEmpty()) << test.to;
    EXPECT_EQ(eds.vendor, 0xABu) << test.to;
  }
}

TEST(EdsFile, PassesOverObjectsWithoutANumber) {
  for (const char* object :
       {"ObjectType=0x2\nDataType=0x000F\nAccessType=wo", "ObjectType=2\nAccessType=rw", "ObjectType=0x0",
        "DataType=0x0011\nAccessType=rw\nDefaultValue=12.5", "DataType=0x0009\nAccessType=const\nDefaultValue=1.2 b",
        "DataType=0x0A\nAccessType=ro", "DataType=0x001B\nAccessType=ro\nDefaultValue=0xFFFFFFFFFFFFFFFF"}) {
    const EdsFile eds =
        parse_eds(with(small, "[1000]", std::string("[2000]\nParameterName=x\n") + object + "\n[1000]"), "x.eds");
    EXPECT_THAT(eds.remarks, ::testing::IsEmpty()) << object;
    ASSERT_NE(eds.find(0x200000), nullptr) << object;
    EXPECT_FALSE(eds.find(0x200000)->default_value) << object;
  }
}

TEST(EdsFile, HoldsWhatADcfSetsByNodeAndInCompactForm) {
  const std::string text = std::string(small) +
                           "ParameterValue=0x80+$nodeid\n[1016Value]\nNrOfEntries=2\n1=0x7F0064\n3=5\n"
                           "[DeviceCommisioning]\nNodeID=0x05\n";
  const EdsFile dcf = parse_eds(text, "drive.dcf");
  EXPECT_EQ(dcf.node, 5);
  EXPECT_EQ(dcf.find(0x101400)->value, 0x85u);
  EXPECT_EQ(dcf.find(0x101601)->value, 0x7F0064u);
  EXPECT_FALSE(dcf.find(0x101602)->value);
  EXPECT_EQ(dcf.find(0x101603)->value, 5u);
}

TEST(EdsFile, RefusesADcfWhoseSettingsItCanNotRead) {
  const std::string dcf = std::string(small) + "[DeviceComissioning]\nNodeID=5\n";
  EXPECT_THAT(refusal(with(dcf, "DefaultValue=-3", "ParameterValue=-300")),
              HasSubstr("drive.eds:33: [60c2sub2] Param"));
  EXPECT_THAT(refusal(with(dcf, "DefaultValue=-3", "ParameterValue=0.5")), HasSubstr("ParameterValue"));
  EXPECT_THAT(refusal(with(dcf, "DefaultValue=$NODEID+0x80", "ParameterValue=$NODEID+x")), HasSubstr("whole number"));
  EXPECT_THAT(refusal(dcf + "[1016Value]\n4=1\n"), HasSubstr("[1016value] 4: found no such sub-index"));
}

TEST(EdsFile, SaysWhyNothingCanBeMadeOfIt) {
  EXPECT_THAT(refusal(with(small, "vendornumber=0x000000AB", "VendorNumber=0x1000000AB")), HasSubstr("drive.eds:6:"));
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
