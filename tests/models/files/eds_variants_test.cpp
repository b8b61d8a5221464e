// EDS and DCF files as they are found: each deviation, or way to write a thing, that public trackers and files show, in
// a file of our own words. It loads, or says which line and key it is refused for.
#include <gmock/gmock.h>

#include <string>

#include "models/base/setup_error.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::description {
namespace {

using ::testing::HasSubstr;

struct Variant {
  const char* seen;  // what it is, and where
  const char* text;  // behind [DeviceInfo] of our own, or a whole file
  enum class Ends { loads, told, refused } ends = Ends::loads;
  const char* says = "";  // told: a remark; refused: the error
  std::uint32_t object = 0x200000;
  std::optional<std::uint32_t> value = std::nullopt;  // its default, or of a DCF what is set
};

using Ends = Variant::Ends;

#define OBJECT "[2000]\nParameterName=x\nObjectType=7\nAccessType=rw\n"

const Variant variants[] = {
    {"expression, number first (ros_canopen pull request 471: taken for the number alone)",
     OBJECT "DataType=7\nDefaultValue=0x600+$NODEID\n", Ends::loads, "", 0x200000, 0x605},
    {"expression, decimal (canopen-python issue 1, Copley)", OBJECT "DataType=7\nDefaultValue=$NODEID+1536\n",
     Ends::loads, "", 0x200000, 1541},
    {"expression in the limits, too (the same)",
     OBJECT "DataType=7\nDefaultValue=$NODEID+1\nLowLimit=$NODEID+1\nHighLimit=$NODEID+1\n", Ends::loads, "", 0x200000,
     6},
    {"expression with blanks and in brackets", OBJECT "DataType=7\nDefaultValue=( $NodeID + 0x80 )\n", Ends::loads, "",
     0x200000, 0x85},
    {"expression without the sum's sign", OBJECT "DataType=7\nDefaultValue=$NODEID0x80\n", Ends::told,
     "own.eds:7: [2000] DefaultValue"},
    {"expression with another operation", OBJECT "DataType=7\nDefaultValue=$NODEID*2\n", Ends::told, "own.eds:7:"},
    {"real default of an integer (libedssharp issue 219)", OBJECT "DataType=0x0007\nDefaultValue=0.0\n", Ends::told,
     "own.eds:7: [2000] DefaultValue: found \"0.0\""},
    {"vendor number with zeros in front (canopen-python issue 313: \"001\")",
     "VendorNumber=001\n" OBJECT "DataType=7\n"},
    {"vendor number that is no octal one", "VendorNumber=0089\n" OBJECT "DataType=7\n", Ends::refused,
     "own.eds:2: [deviceinfo] VendorNumber"},
    {"boolean object (ros_canopen issue 256, Engel: crashed)", OBJECT "DataType=0x0001\nDefaultValue=1\n", Ends::loads,
     "", 0x200000, 1},
    {"line without '=' (CANopen-monitor issue 86)", OBJECT "DataType=7\njust words\n", Ends::told,
     "own.eds:7: [2000]: found \"just words\""},
    {"the same under [Comments]", "[Comments]\njust words\n" OBJECT "DataType=7\nDefaultValue=1\n", Ends::loads, "",
     0x200000, 1},
    {"DCF, spelled as CiA 306 has it (CANopen-monitor issue 87)",
     OBJECT "DataType=7\nParameterValue=7\n[DeviceComissioning]\nNodeID=5\n", Ends::loads, "", 0x200000, 7},
    {"DCF, spelled as the dictionary has it",
     OBJECT "DataType=7\nParameterValue=7\n[DeviceCommissioning]\nNodeId=0x5\n", Ends::loads, "", 0x200000, 7},
    {"DCF, node in capitals", OBJECT "DataType=7\nParameterValue=$nodeid+1\n[DEVICECOMISSIONING]\nNODEID=5\n",
     Ends::loads, "", 0x200000, 6},
    {"DCF whose node is none", OBJECT "DataType=7\n[DeviceComissioning]\nNodeID=200\n", Ends::refused,
     "[devicecomissioning] NodeID"},
    {"DCF whose value doesn't fit", OBJECT "DataType=5\nParameterValue=256\n", Ends::refused,
     "own.eds:7: [2000] ParameterValue: found \"256\""},
    {"DCF, value left empty", OBJECT "DataType=5\nDefaultValue=3\nParameterValue=\n", Ends::loads, "", 0x200000, 3},
    {"DCF, values of compact sub-objects",
     "[2000]\nParameterName=x\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=3\n[2000Value]\nNrOfEntries=1\n"
     "2=0x11\n",
     Ends::loads, "", 0x200002, 0x11},
    {"DCF, value of a compact sub-object that isn't there",
     "[2000]\nParameterName=x\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=1\n[2000Value]\n2=0x11\n",
     Ends::refused, "[2000value] 2: found no such sub-index"},
    {"compact sub-objects with names (CiA 306, 4.6.5)",
     "[2000]\nParameterName=x\nObjectType=0x8\nDataType=0x0006\nAccessType=rw\nCompactSubObj=2\nDefaultValue=9\n"
     "[2000Name]\nNrOfEntries=1\n2=second\n",
     Ends::loads, "", 0x200001, 9},
    {"compact sub-objects, more than there can be",
     "[2000]\nParameterName=x\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=999\n", Ends::told,
     "own.eds:7: [2000] CompactSubObj"},
    {"sub-index with two digits",
     "[2000sub0A]\nParameterName=x\nObjectType=7\nDataType=5\nAccessType=ro\nDefaultValue=4\n", Ends::loads, "",
     0x20000A, 4},
    {"sub-index in capitals, index in small letters",
     "[20aaSUB1]\nParameterName=x\nObjectType=7\nDataType=5\nAccessType=ro\nDefaultValue=4\n", Ends::loads, "",
     0x20AA01, 4},
    {"sub-object of an array without a section of its own",
     "[2000]\nParameterName=x\nObjectType=8\nSubNumber=3\n[2000sub2]\nParameterName=y\nDataType=5\nAccessType=rw\n"
     "DefaultValue=1\n",
     Ends::loads, "", 0x200002, 1},
    {"INTEGER24", OBJECT "DataType=0x0010\nDefaultValue=-2\n", Ends::loads, "", 0x200000, 0xFFFFFE},
    {"UNSIGNED24", OBJECT "DataType=0x0016\nDefaultValue=0xABCDEF\n", Ends::loads, "", 0x200000, 0xABCDEF},
    {"UNSIGNED24 that doesn't fit", OBJECT "DataType=0x0016\nDefaultValue=0x1000000\n", Ends::told, "own.eds:7:"},
    {"REAL64, INTEGER40 and others of no more use than to be there", OBJECT
     "DataType=0x0011\nDefaultValue=1.25\n[2001]\nParameterName=y\nDataType=0x12\nAccessType=ro\n"
     "DefaultValue=-1\n[2002]\nParameterName=z\nDataType=0x1B\nAccessType=ro\nDefaultValue=0xFFFFFFFFFFFFFFFF\n"},
    {"REAL32 with a comma", OBJECT "DataType=8\nDefaultValue=1,5\n", Ends::told, "own.eds:7: [2000] DefaultValue"},
    {"time of day, octet string, unicode string",
     OBJECT "DataType=0x0C\n[2001]\nParameterName=y\nDataType=0x0A\nAccessType=rw\nDefaultValue=01 02\n[2002]\n"
            "ParameterName=z\nDataType=0x0B\nAccessType=ro\n"},
    {"a data type that is the device's own (DEFSTRUCT, 0040h on)", OBJECT "DataType=0x0040\n"},
    {"signed limit as its bits", OBJECT "DataType=2\nLowLimit=0x80\nHighLimit=0x7F\nDefaultValue=0xFF\n", Ends::loads,
     "", 0x200000, 0xFF},
    {"limits of which nothing is meant", OBJECT "DataType=7\nLowLimit=0\nHighLimit=0\nDefaultValue=5\n", Ends::loads,
     "", 0x200000, 5},
    {"limit that is no number", OBJECT "DataType=7\nLowLimit=none\n", Ends::told, "own.eds:7: [2000] LowLimit"},
    {"access left out", "[2000]\nParameterName=x\nObjectType=7\nDataType=7\n", Ends::told,
     "[2000] AccessType: found \"\""},
    {"access rwr and rww, in capitals",
     "[2000]\nParameterName=x\nDataType=7\nAccessType=RWW\nPDOMapping=1\nDefaultValue=2\n", Ends::loads, "", 0x200000,
     2},
    {"access of no kind", "[2000]\nParameterName=x\nDataType=7\nAccessType=read\n", Ends::told,
     "own.eds:5: [2000] AccessType"},
    {"key twice, the same", OBJECT "DataType=7\nDefaultValue=1\nDefaultValue=1\n", Ends::loads, "", 0x200000, 1},
    {"key twice, and not the same", OBJECT "DataType=7\nDefaultValue=1\nDefaultValue=2\n", Ends::told,
     "own.eds:8: [2000]: defaultvalue comes twice"},
    {"section twice, of two objects", OBJECT "DataType=7\n[2000]\nParameterName=y\n", Ends::told, "comes twice"},
    {"Latin-1 in a name", "[2000]\nParameterName=Verst\xE4rker\nDataType=7\nAccessType=rw\nDefaultValue=1\n",
     Ends::loads, "", 0x200000, 1},
    {"hexadecimal with an h behind", OBJECT "DataType=7\nDefaultValue=20h\n", Ends::told, "own.eds:7:"},
    {"a comment behind a number", OBJECT "DataType=0x7 ; U32\nDefaultValue=2 ; two\n", Ends::loads, "", 0x200000, 2},
    {"a name of 500 characters",
     "[2000]\nParameterName=aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
     "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\nDataType=7\nAccessType=rw\n"
     "DefaultValue=1\n",
     Ends::loads, "", 0x200000, 1},
    {"a number in quotes", OBJECT "DataType=7\nDefaultValue=\"1\"\n", Ends::told, "own.eds:7:"},
    {"no object at all", "VendorName=x\n", Ends::refused, "objects, in sections such as [1000]"},
};

std::optional<std::uint32_t> value_in(const EdsFile& eds, std::uint32_t object) {
  const EdsObject* there = eds.find(object);
  if (there == nullptr) return std::nullopt;
  if (there->value) return there->value;
  if (there->default_offset) return *there->default_offset + 5;  // of node 5
  return there->default_value;
}

TEST(EdsVariants, LoadOrSayLineKeyAndReason) {
  EXPECT_GE(std::size(variants), 40U);
  for (const Variant& variant : variants) {
    SCOPED_TRACE(variant.seen);
    try {
      const EdsFile eds = parse_eds(std::string("[DeviceInfo]\n") + variant.text, "own.eds");
      ASSERT_NE(variant.ends, Ends::refused) << "it loaded";
      EXPECT_NE(eds.find(variant.object), nullptr);
      if (variant.ends == Ends::told) {
        ASSERT_FALSE(eds.remarks.empty());
        EXPECT_THAT(eds.remarks[0], HasSubstr(variant.says));
      } else {
        EXPECT_THAT(eds.remarks, ::testing::IsEmpty());
      }
      if (variant.value) {
        EXPECT_EQ(value_in(eds, variant.object), variant.value);
      }
    } catch (const SetupError& error) {
      EXPECT_EQ(variant.ends, Ends::refused) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(variant.says));
    }
  }
}

TEST(EdsVariants, WholeFilesOfOtherKindsAreRefused) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      (void)parse_eds(text, "own.eds");
    } catch (const SetupError& error) {
      return error.what();
    }
    return "loaded";
  };
  EXPECT_THAT(refusal(std::string("\xFF\xFE[\0D\0", 6)), HasSubstr("own.eds:1: found a text in UTF-16"));
  EXPECT_THAT(refusal("<?xml version=\"1.0\"?><ISO15745ProfileContainer/>"), HasSubstr("own.eds:1: "))
      << "the XML format of CiA 311";
  // A terminal would obey what stands in a key; the fuzzer found it.
  const std::string obeyed = refusal(
      "[DeviceInfo]\n[2000]\nParameterName=x\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=1\n[2000Value]\n"
      "\x1b[31m=1\n");
  EXPECT_THAT(obeyed, HasSubstr("\\x1b[31m: found no such sub-index"));
  EXPECT_EQ(obeyed.find('\x1b'), std::string::npos);
  EXPECT_THAT(refusal("[DeviceInfo"), HasSubstr("own.eds:1: "));
  EXPECT_THAT(refusal(std::string(4'000'001, '[')), HasSubstr("4 MB"));
}

}  // namespace
}  // namespace proxarm::description
