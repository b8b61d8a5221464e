#include "models/description/dbc_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "models/base/setup_error.hpp"
#include "models/description/sensor.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {
namespace {

using ::testing::HasSubstr;

// As the usual editors write it.
const std::string usual = R"(VERSION "1.0"

NS_ :
	NS_DESC_
	CM_
	BA_DEF_
	SIG_VALTYPE_

BS_:

BU_: MASTER SENSOR

BO_ 256 FORCE: 8 SENSOR
 SG_ Fx : 7|16@0- (0.01,0) [-327.68|327.67] "N" MASTER
 SG_ Fy : 16|16@1+ (0.01,-300) [-300|355.35] "N" MASTER,Vector__XXX
 SG_ Nibbles : 35|12@0- (1,0) [0|0] "N" MASTER

BO_ 2147483905 TORQUE: 8 SENSOR
 SG_ Tx : 0|32@1- (1E-003,0) [0|0] "Nm" MASTER
 SG_ Page m1 : 32|4@1+ (1,0) [0|0] "" MASTER

CM_ SG_ 256 Fx "a comment; with a semicolon
and a second line";
BA_DEF_ "BusType" STRING ;
VAL_ 256 Fx 0 "zero" 1 "one" ;
SIG_VALTYPE_ 2147483905 Tx : 1;
)";

std::string told(const std::string& text) {
  try {
    const DbcFile dbc = parse_dbc(text, "own.dbc");
    if (!dbc.remarks.empty()) return dbc.remarks.front();
  } catch (const SetupError& error) {
    return error.what();
  }
  return "read";
}

TEST(DbcFile, ReadsOverCommentsAndNodesOnLinesOfTheirOwn) {
  const DbcFile dbc = parse_dbc(
      "// exported by a script: BO_ 1 NONE: 8 X\nVERSION \"\"\n\nBU_:\n  HOST // the controller\n  SENSOR\n\n"
      "BO_ 256 FORCE: 8 SENSOR // the wrench\n"
      " SG_ Fx : 7|16@0- (0.1,0) [0|0] \"N//m\" HOST\n//",
      "own.dbc");
  EXPECT_TRUE(dbc.remarks.empty()) << dbc.remarks.front();
  ASSERT_EQ(dbc.messages.size(), 1U);
  EXPECT_EQ(dbc.messages[0].id, 256U);
  EXPECT_EQ(dbc.messages[0].line, 8);
  ASSERT_EQ(dbc.messages[0].signals.size(), 1U);
  EXPECT_EQ(dbc.messages[0].signals[0].unit, "N//m") << "a string is no comment";
}

TEST(DbcFile, ReadsMessagesAndPlaces) {
  const DbcFile dbc = parse_dbc(usual, "own.dbc");
  ASSERT_EQ(dbc.messages.size(), 2U);
  const DbcMessage& force = dbc.messages[0];
  EXPECT_EQ(force.id, 0x100U);
  EXPECT_FALSE(force.extended);
  EXPECT_EQ(force.bytes, 8);
  const DbcSignal* fx = force.find("Fx");
  ASSERT_NE(fx, nullptr);
  EXPECT_EQ(fx->number.byte, 0U);
  EXPECT_EQ(fx->number.bits, 16);
  EXPECT_EQ(fx->number.shift, 0);
  EXPECT_TRUE(fx->number.big_endian);
  EXPECT_EQ(fx->number.kind, NumberKind::signed_integer);
  EXPECT_EQ(fx->factor, 0.01);
  const DbcSignal* fy = force.find("Fy");
  EXPECT_EQ(fy->number.byte, 2U);
  EXPECT_FALSE(fy->number.big_endian);
  EXPECT_EQ(fy->offset, -300.0);
  // Motorola from bit 35, the fourth lowest of byte 4: its low nibble, then all of byte 5.
  const DbcSignal* nibbles = force.find("Nibbles");
  EXPECT_EQ(nibbles->number.byte, 4U);
  EXPECT_EQ(nibbles->number.bytes(), 2U);
  EXPECT_EQ(nibbles->number.shift, 0);
  const DbcMessage& torque = dbc.messages[1];
  EXPECT_TRUE(torque.extended);
  EXPECT_EQ(torque.id, 0x101U);
  EXPECT_EQ(torque.find("Tx")->number.kind, NumberKind::real);
  EXPECT_TRUE(torque.find("Page")->multiplexed);
}

TEST(DbcFile, ReadsNumbersWithNothingBesideThePoint) {
  std::string text = usual;
  const std::string written = "(0.01,-300)";
  text.replace(text.find(written), written.size(), "(.0796,-.5)");
  const DbcFile dbc = parse_dbc(text, "own.dbc");
  EXPECT_TRUE(dbc.remarks.empty());
  EXPECT_EQ(dbc.messages[0].find("Fy")->factor, 0.0796);
  EXPECT_EQ(dbc.messages[0].find("Fy")->offset, -0.5);
}

// A vehicle's file has hundreds of messages, of which a sensor needs two.
TEST(DbcFile, LosesOneMessageByAMistakeAndNoOther) {
  const auto lost = [](const std::string& what, const std::string& instead) {
    std::string text = usual;
    text.replace(text.find(what), what.size(), instead);
    const DbcFile dbc = parse_dbc(text, "own.dbc");
    EXPECT_EQ(dbc.remarks.size(), 1U) << instead;
    EXPECT_NE(dbc.find("TORQUE"), nullptr) << instead;
    std::string names;
    for (const DbcMessage& message : dbc.messages) names += message.mistake.empty() ? "" : message.name + " ";
    return names;
  };
  EXPECT_EQ(lost("7|16@0-", "7|72@0-"), "FORCE ");
  EXPECT_EQ(lost("35|12@0-", "35|40@0-"), "FORCE ") << "its last signal: the next message begins in time";
  EXPECT_EQ(lost("0|32@1-", "40|32@1-"), "TORQUE ");
  EXPECT_EQ(lost("BO_ 256 FORCE", "BO_ 2048 FORCE"), "FORCE ");
  EXPECT_EQ(lost("CM_ SG_", "BO_ 9 FORCE: 8 SENSOR\nCM_ SG_"), "FORCE FORCE ") << "which of them is meant?";
  EXPECT_EQ(lost("[-300|355.35]", "[-300|]"), "FORCE ");
}

TEST(DbcFile, PassesOverTheMessageOfSignalsWithoutOne) {
  const DbcFile dbc = parse_dbc(
      "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n"
      " SG_ Spare : 0|16@1+ (1,0) [0|0] \"\" Vector__XXX\n" +
          usual,
      "own.dbc");
  EXPECT_TRUE(dbc.remarks.empty());
  ASSERT_EQ(dbc.messages.size(), 2U);
  EXPECT_EQ(dbc.messages[0].signals.size(), 3U);
}

TEST(DbcFile, ReadsMultiplexersOfMultiplexersAndSectionsItDoesNotKnow) {
  const std::string text =
      "BO_ 1 A: 8 S\n SG_ M1 M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ M2 m0M : 8|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ V m3 : 16|8@1+ (1,0) [0|0] \"\" X\nSG_MUL_VAL_ 1 M2 M1 0-0,5-6;\nBO_TX_BU_ 1 : S,T;\n"
      "BA_ \"SystemSignalLongSymbol\" SG_ 1 V \"A_name_of_more_than_32_characters_is_cut\";\n";
  const DbcFile dbc = parse_dbc(text, "own.dbc");
  EXPECT_TRUE(dbc.remarks.empty());
  EXPECT_FALSE(dbc.find("A")->find("M1")->multiplexed);
  EXPECT_TRUE(dbc.find("A")->find("M2")->multiplexed);
  EXPECT_TRUE(dbc.find("A")->find("V")->multiplexed);
}

TEST(DbcFile, SaysTheLine) {
  const auto with = [](const std::string& what, const std::string& instead) {
    std::string text = usual;
    text.replace(text.find(what), what.size(), instead);
    return told(text);
  };
  EXPECT_EQ(told(usual), "read");
  EXPECT_THAT(with("7|16@0-", "7|72@0-"), HasSubstr("own.dbc:14: not DBC: found \"72\", expected the length in bits"));
  EXPECT_THAT(with("16|16@1+", "56|16@1+"), HasSubstr("ends within the 8 bytes of FORCE"));
  EXPECT_THAT(with("Fy :", "Fx :"), HasSubstr("a signal that isn't there yet: Fx"));
  EXPECT_THAT(with("TORQUE", "FORCE"), HasSubstr("a message that isn't there yet: FORCE"));
  EXPECT_THAT(with("BO_ 256", "BO_ 2048"), HasSubstr("11 bits"));
  EXPECT_THAT(with("\"N\" MASTER", "\"N MASTER"), HasSubstr("expected"));
  EXPECT_THAT(with("(0.01,0)", "(0.01)"), HasSubstr("','"));
  EXPECT_THAT(told("SG_ Fx : 7|16@0- (1,0) [0|0] \"\" A"), HasSubstr("a message (BO_) before"));
  EXPECT_THAT(told("CM_ \"never ends"), HasSubstr("a string that ends"));
  EXPECT_THAT(told("VAL_ 1 2 3"), HasSubstr("the end of the file, expected ';', which ends VAL_"));
  EXPECT_THAT(told(std::string((4U << 20) + 1, ' ')), HasSubstr("4 MiB"));
}

TEST(DbcFile, GivesASensorItsSignals) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "proxarm_dbc_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "own.dbc") << R"(
BO_ 256 FORCE: 6 S
 SG_ Fx : 7|16@0+ (0.01,-300) [0|0] "N" A
 SG_ Fy : 23|16@0+ (0.01,-300) [0|0] "N" A
 SG_ Fz : 39|16@0+ (0.01,-300) [0|0] "N" A
BO_ 257 TORQUE: 6 S
 SG_ Tx : 7|16@0+ (0.002,-50) [0|0] "Nm" A
 SG_ Ty : 23|16@0+ (0.002,-50) [0|0] "Nm" A
 SG_ Tz : 39|16@0+ (2,-50000) [0|0] "mNm" A
)";
  const std::string text = R"(
name: own
protocol: described
force_range_N: [300, 300, 300]
torque_range_Nm: [15, 15, 15]
dbc: own.dbc
frames: [{message: FORCE}, {message: TORQUE}]
signals:
  fx: {signal: Fx}
  fy: {signal: Fy}
  fz: {signal: Fz}
  tx: {signal: Tx}
  ty: {signal: Ty}
  tz: {signal: Tz, scale: 0.002, offset: -50}
rate_Hz: 1000
)";
  const auto read = [&](const std::string& yaml) { return read_sensor(YamlNode::parse(yaml, folder / "own.yaml")); };
  const SensorProtocol protocol = read(text).described.value();
  EXPECT_EQ(protocol.frames[1].id, 0x101U);
  EXPECT_EQ(protocol.frames[1].bytes, 6);
  EXPECT_EQ(protocol.signals[4].number.byte, 8U);  // in the sample: behind the first frame's six
  EXPECT_EQ(protocol.signals[4].scale, 0.002);
  EXPECT_EQ(protocol.signals[0].offset, -300.0);
  const auto mistake = [&](const std::string& what, const std::string& instead) -> std::string {
    std::string changed = text;
    changed.replace(changed.find(what), what.size(), instead);
    try {
      (void)read(changed);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "read";
  };
  EXPECT_THAT(mistake("signal: Fx", "signal: Mx"), HasSubstr("signals.fx.signal: found \"Mx\""));
  EXPECT_THAT(mistake("message: TORQUE", "message: MOMENT"), HasSubstr("a message of own.dbc"));
  EXPECT_THAT(mistake(", scale: 0.002, offset: -50", ""), HasSubstr("found one in \"mNm\""));
  EXPECT_THAT(mistake("dbc: own.dbc", ""), HasSubstr("frames[0].message"));
}

}  // namespace
}  // namespace proxarm::description
