// DBC files as they are found: each deviation, or extension of the format, that public trackers and files show, in a
// file of our own words. It loads, or says the line and the reason; one bad message doesn't lose the file.
#include <gmock/gmock.h>

#include <string>

#include "models/base/setup_error.hpp"
#include "models/description/dbc_file.hpp"

namespace proxarm::description {
namespace {

using ::testing::HasSubstr;

struct Variant {
  const char* seen;
  const char* text;
  const char* remark = "";       // that is told; "": none
  const char* message = "GRIP";  // that can be used all the same
  const char* signal = "Fx";
};

#define GRIP "BO_ 256 GRIP: 8 S\n SG_ Fx : 0|16@1- (0.5,0) [0|0] \"N\" R\n"

const Variant variants[] = {
    {"comment without ';' (DbcParser issue 82, opendbc: it swallowed the messages behind it)",
     "CM_ \"made from another file\"\n" GRIP, "own.dbc:2: not DBC: found \"BO_\", expected ';', which ends CM_"},
    {"value table without ';' (the same issue)", GRIP "VAL_ 256 Fx 2 \"two\" 1 \"one\"\nBO_ 257 NEXT: 8 S\n",
     "which ends VAL_", "NEXT", nullptr},
    {"comment of a signal without the signal's name (the same issue)", GRIP "CM_ SG_ 256 \"whose?\";\n"},
    {"semicolons in a comment (the same issue)", GRIP "CM_ SG_ 256 Fx \"one; two;\nthree;\";\n"},
    {"senders apart (the same issue)", GRIP "BO_TX_BU_ 256 : A,B;\n"},
    {"one name in two branches of a multiplexer (DbcParser issue 114, cantools issue 348)",
     GRIP "BO_ 257 MUX: 8 S\n SG_ Which M : 0|8@1+ (1,0) [0|0] \"\" R\n SG_ Same m0 : 8|8@1+ (1,0) [0|0] \"\" R\n"
          " SG_ Same m1 : 16|8@1+ (1,0) [0|0] \"\" R\n"},
    {"one name twice without a multiplexer", GRIP " SG_ Fx : 16|16@1- (1,0) [0|0] \"N\" R\nBO_ 257 NEXT: 8 S\n",
     "a signal that isn't there yet: Fx", "NEXT", nullptr},
    {"a multiplexer that is multiplexed (can-dbc pull request 8, canmatrix issue 108: \"0M\")",
     GRIP "BO_ 257 MUX: 8 S\n SG_ A M : 0|2@1+ (1,0) [0|0] \"\" R\n SG_ B m0M : 2|4@1+ (1,0) [0|0] \"\" R\n"
          " SG_ C m4 : 10|4@1+ (1,0) [0|0] \"\" R\n"},
    {"extended multiplexing (cantools issue 19)", GRIP "SG_MUL_VAL_ 256 Fx Fx 8-8, 16-16, 24-24;\n"},
    {"dummy message of signals without one (4 of 119 public files)",
     "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n SG_ Spare : 0|16@1+ (1,0) [0|0] \"\" "
     "Vector__XXX\n" GRIP},
    {"long name of a signal",
     GRIP "BA_ \"SystemSignalLongSymbol\" SG_ 256 Fx \"Fx_of_the_sensor_between_flange_and_handle\";\n", "", "GRIP",
     "Fx_of_the_sensor_between_flange_and_handle"},
    {"long name of a message",
     GRIP "BA_ \"SystemMessageLongSymbol\" BO_ 256 \"GRIP_of_the_sensor_between_flange_and_handle\";\n", "",
     "GRIP_of_the_sensor_between_flange_and_handle"},
    {"long name of nothing", GRIP "BA_ \"SystemSignalLongSymbol\" SG_ 99 Fx \"nobody\";\n"},
    {"attributes and their definitions",
     GRIP "BA_DEF_ SG_ \"Kind\" ENUM \"a\",\"b;\",\"c\";\nBA_DEF_DEF_ \"Kind\" \"a\";\nBA_ \"Kind\" SG_ 256 Fx 1;\n"},
    {"no receiver", "BO_ 256 GRIP: 8 S\n SG_ Fx : 0|16@1- (0.5,0) [0|0] \"N\"\n SG_ Fy : 16|16@1- (1,0) [0|0] \"N\"\n"},
    {"receivers with blanks between", "BO_ 256 GRIP: 8 S\n SG_ Fx : 0|16@1- (0.5,0) [0|0] \"N\" A B , C\n"},
    {"byte order mark", "\xEF\xBB\xBFVERSION \"\"\n" GRIP},
    {"DOS line ends and tabs",
     "VERSION \"\"\r\n\r\nBU_: S R\r\nBO_ 256 GRIP: 8 S\r\n\tSG_ Fx : 0|16@1- (0.5,0) [0|0] \"N\" R\r\n"},
    {"no new symbols, no nodes", GRIP},
    {"nodes over two lines", "BU_: S R\n T U\n" GRIP},
    {"a number in another form", "BO_ 256 GRIP: 8 S\n SG_ Fx : 0|16@1- (5E-1,-0.0) [-1.5e+3|1500.0] \"N\" R\n"},
    {"a factor that is none", "BO_ 257 BAD: 8 S\n SG_ Fx : 0|16@1- (x,0) [0|0] \"N\" R\n" GRIP,
     "own.dbc:2: not DBC: found \"x\", expected the factor"},
    {"a signal beyond its message (cantools issue 205)",
     "BO_ 257 BAD: 2 S\n SG_ Fx : 8|16@1- (1,0) [0|0] \"N\" R\n" GRIP, "ends within the 2 bytes of BAD"},
    {"a message of CAN FD", GRIP "BO_ 257 LONG: 64 S\n SG_ Last : 496|16@1+ (1,0) [0|0] \"\" R\n"},
    {"latin-1 in a unit", "BO_ 256 GRIP: 8 S\n SG_ Fx : 0|16@1- (0.5,0) [0|0] \"\xB0\" R\n"},
    {"environment variables and signal groups",
     GRIP "EV_ Switch: 0 [0|1] \"\" 0 1 DUMMY_NODE_VECTOR0 S;\nSIG_GROUP_ 256 All 1 : Fx;\n"},
};

TEST(DbcVariants, LoadAndSayLineAndReason) {
  for (const Variant& variant : variants) {
    SCOPED_TRACE(variant.seen);
    try {
      const DbcFile dbc = parse_dbc(variant.text, "own.dbc");
      if (*variant.remark == '\0') {
        EXPECT_THAT(dbc.remarks, ::testing::IsEmpty());
      } else {
        ASSERT_FALSE(dbc.remarks.empty());
        EXPECT_THAT(dbc.remarks[0], HasSubstr(variant.remark));
      }
      const DbcMessage* message = dbc.find(variant.message);
      ASSERT_NE(message, nullptr);
      EXPECT_EQ(message->mistake, "");
      if (variant.signal == nullptr) continue;
      ASSERT_NE(message->find(variant.signal), nullptr);
      EXPECT_EQ(message->find(variant.signal)->factor, 0.5);
    } catch (const SetupError& error) {
      ADD_FAILURE() << error.what();
    }
  }
  EXPECT_EQ(parse_dbc(variants[0].text, "own.dbc").find(""), nullptr) << "no long name is no name";
}

}  // namespace
}  // namespace proxarm::description
