#include "models/files/yaml_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <functional>

namespace proxarm::description {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

using Reader = std::function<void(const YamlNode&)>;

// What the user is told; "no error" where nothing was wrong.
std::string told(const std::string& text, const Reader& read = {}) {
  try {
    const YamlNode root = YamlNode::parse(text, "scenes/wall.yaml");
    if (read) read(root);
  } catch (const SetupError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  return "no error";
}

void read_objects(const YamlNode& root) {
  for (const YamlNode& object : root.list("objects", 1, 10)) {
    (void)object.number_or("friction", 0.0, 0.0, 10.0);
    (void)object.number("mass_kg", above(0.0, 100.0));
    (void)object.vec3_or("point_m", {});
  }
  root.finish();
}

std::string objects(const std::string& lines) { return told("# a scene\nobjects:\n" + lines, read_objects); }

TEST(YamlFile, ReadsWhatIsThere) {
  const YamlNode root = YamlNode::parse(R"(
name: wall
count: 7
id: 0x1F
negative: -12
yes_no: true
size_m: 1.5e-3
list: [1, -2.5, 3]
"quoted key": "010"
nested: {a_kg: 1, b: {c_N: +2}}
empty: []
)",
                                        "x.yaml");
  EXPECT_EQ(root.string("name"), "wall");
  EXPECT_EQ(root.integer("count", 0, 10), 7);
  EXPECT_EQ(root.integer("id", 0, 255), 31);
  EXPECT_EQ(root.integer("negative", -20, 0), -12);
  EXPECT_TRUE(root.boolean("yes_no"));
  EXPECT_EQ(root.number("size_m", 0.0, 1.0), 1.5e-3);
  EXPECT_THAT(root.vec3("list"), testing::ElementsAre(1.0, -2.5, 3.0));
  EXPECT_EQ(root.string("quoted key"), "010");
  EXPECT_EQ(root.map("nested").number("a_kg", 0, 2), 1.0);
  const YamlNode b = root.map("nested").map("b");
  EXPECT_EQ(b.number("c_N", any_number()), 2.0);
  EXPECT_EQ(b.path(), "nested.b");
  EXPECT_EQ(b.line(), 10);
  EXPECT_TRUE(root.list("empty").empty());
  EXPECT_FALSE(root.has("absent"));
  EXPECT_EQ(root.number_or("absent", 4.5, 0.0, 10.0), 4.5);
  EXPECT_EQ(root.choice_or("absent", "csp", {"csp", "ip"}), "csp");
  root.finish();
}

TEST(YamlFile, ANodeKeepsItsFileAlive) {
  const YamlNode inner = YamlNode::parse("a: {b: {c: 3}}", "x.yaml").map("a").map("b");
  EXPECT_EQ(inner.number("c", any_number()), 3.0);
}

TEST(YamlFile, AValueOutOfRangeIsToldWithPlaceRangeAndUnit) {
  EXPECT_EQ(objects("  - mass_kg: 3\n    friction: -0.3\n"),
            "scenes/wall.yaml:4: objects[0].friction: found -0.3, expected a number from 0 to 10 (no unit)");
  EXPECT_EQ(objects("  - mass_kg: 0\n"),
            "scenes/wall.yaml:3: objects[0].mass_kg: found 0, expected a number above 0 and at most 100 kg");
}

TEST(YamlFile, FieldsOfTheErrorAreThereForPrograms) {
  try {
    (void)YamlNode::parse("a:\n  mass_kg: -1\n", "x.yaml").map("a").number("mass_kg", 0.0, 5.0);
    FAIL();
  } catch (const SetupError& error) {
    EXPECT_EQ(error.file(), "x.yaml");
    EXPECT_EQ(error.line(), 2);
    EXPECT_EQ(error.column(), 12);
    EXPECT_EQ(error.key(), "a.mass_kg");
    EXPECT_EQ(error.found(), "-1");
    EXPECT_EQ(error.expected(), "a number from 0 to 5 kg");
  }
}

TEST(YamlFile, AMissingKeyIsToldAtItsParentWithTheSlipOfThePen) {
  EXPECT_EQ(objects("  - friction: 0.3\n"),
            "scenes/wall.yaml:3: objects[0].mass_kg: found nothing, expected a number above 0 and at most 100 kg");
  EXPECT_THAT(objects("  - mass: 3\n"), HasSubstr("is \"mass\" below meant to be it?"));
}

TEST(YamlFile, AnUnknownKeyIsToldWithTheNearestKnownOne) {
  EXPECT_EQ(objects("  - mass_kg: 3\n    frction: 0.3\n"),
            "scenes/wall.yaml:4: objects[0].frction: unknown key; did you mean \"friction\"?");
  EXPECT_EQ(objects("  - mass_kg: 3\n    point: [0, 0, 0]\n"),
            "scenes/wall.yaml:4: objects[0].point: unknown key; did you mean \"point_m\"?");
  EXPECT_EQ(objects("  - mass_kg: 3\n    colour: red\n"),
            "scenes/wall.yaml:4: objects[0].colour: unknown key; known here: friction, mass_kg or point_m");
  // A whole section that nobody asked for, and one inside that.
  EXPECT_THAT(told("extra: {a: 1}\n", [](const YamlNode& root) { root.finish(); }), HasSubstr("extra: unknown key"));
}

TEST(YamlFile, OnlyPlainFiniteDecimalNumbersAreNumbers) {
  for (const char* bad :
       {"010",   "-010",   "00", "1,5",  ".",    "-.",    "0x10", "1_000", ".nan", ".inf", "-.inf", "nan",   "inf",
        "1e999", "1e-999", "1e", "--1",  "+-1",  "1 2",   "3kg",  "~",     "null", "true", "one",   "\"3\"", "'3'",
        "[3]",   "{a: 3}", "",   "0o17", "1:30", "1e5.5", "1d3",  "٣",     ".e1",  "1.5.", "00.5"}) {
    EXPECT_THAT(objects("  - mass_kg: " + std::string(bad) + "\n"),
                StartsWith("scenes/wall.yaml:3: objects[0].mass_kg: found "))
        << bad;
  }
  for (const char* good : {"1", "+1", "1.0", "1e1", "1E+1", "0.5", "99.999", "1e-300", "1.00000000000000000000001",
                           ".0796", "+.5", "1.", "1.e1", ".5e1"}) {
    EXPECT_EQ(objects("  - mass_kg: " + std::string(good) + "\n"), "no error") << good;
  }
  EXPECT_THAT(objects("  - mass_kg: 010\n"), HasSubstr("write it without leading zeros"));
  EXPECT_THAT(objects("  - mass_kg: 1,5\n"), HasSubstr("write a decimal point, not a comma"));
  EXPECT_THAT(objects("  - mass_kg: 3 kg\n"), HasSubstr("the key's name states the unit"));
  EXPECT_THAT(objects("  - mass_kg: \"3\"\n"), HasSubstr("numbers stand without quotes"));
  EXPECT_THAT(objects("  - mass_kg:\n"), HasSubstr("found no value"));
}

TEST(YamlFile, ZeroIsZeroHoweverItIsWritten) {
  for (const char* zero : {"0", "-0", "0.0", "0.000", "0e5", "0.0e-400"}) {
    EXPECT_EQ(objects("  - {mass_kg: 1, friction: " + std::string(zero) + "}\n"), "no error") << zero;
  }
}

TEST(YamlFile, IntegersAreWhole) {
  const auto integer = [](const std::string& value) {
    return told("node: " + value + "\n", [](const YamlNode& root) { (void)root.integer("node", 1, 127); });
  };
  EXPECT_EQ(integer("127"), "no error");
  EXPECT_EQ(integer("0x7f"), "no error");
  EXPECT_EQ(integer("128"), "scenes/wall.yaml:1: node: found 128, expected a whole number from 1 to 127");
  for (const char* bad :
       {"1.5", "1.0", "1e1", "0", "-1", "0x", "0xg", "0x80", "-0x1", "007", "99999999999999999999", "x"}) {
    EXPECT_THAT(integer(bad), StartsWith("scenes/wall.yaml:1: node: found ")) << bad;
  }
}

TEST(YamlFile, BooleansAreTrueOrFalse) {
  const auto boolean = [](const std::string& value) {
    return told("on_off: " + value + "\n", [](const YamlNode& root) { (void)root.boolean("on_off"); });
  };
  EXPECT_EQ(boolean("true"), "no error");
  for (const char* bad : {"yes", "on", "1", "True", "\"true\"", "[true]"}) {
    EXPECT_THAT(boolean(bad), HasSubstr("expected true or false")) << bad;
  }
}

TEST(YamlFile, ChoicesAreListedAndTheNearestIsNamed) {
  const auto choice = [](const std::string& value) {
    return told("mode: " + value + "\n", [](const YamlNode& root) { (void)root.choice("mode", {"csp", "cst", "ip"}); });
  };
  EXPECT_EQ(choice("cst"), "no error");
  EXPECT_EQ(choice("velocity"), "scenes/wall.yaml:1: mode: found \"velocity\", expected csp, cst or ip");
  EXPECT_EQ(choice("cps"), "scenes/wall.yaml:1: mode: found \"cps\", expected csp, cst or ip; did you mean csp?");
}

TEST(YamlFile, ListsHaveTheirLength) {
  EXPECT_THAT(objects("  - {mass_kg: 1, point_m: [0, 0]}\n"),
              HasSubstr("objects[0].point_m: found a list of 2, expected a list of 3 numbers in m"));
  EXPECT_THAT(objects("  - {mass_kg: 1, point_m: [0, 0, x]}\n"),
              HasSubstr("objects[0].point_m[2]: found \"x\", expected a number in m"));
  EXPECT_THAT(objects("  []\n"), HasSubstr("found a list of 0, expected a list of 1 to 10 entries"));
  EXPECT_THAT(told("objects: 3\n", read_objects), HasSubstr("objects: found 3, expected a list"));
}

TEST(YamlFile, MapsAreExpectedWhereMapsBelong) {
  EXPECT_THAT(told("- a\n- b\n", read_objects), HasSubstr("found a list of 2, expected a map"));
  EXPECT_THAT(told("just words\n", read_objects), HasSubstr("found \"just words\", expected a map"));
  EXPECT_THAT(objects("  - 3\n"), HasSubstr("objects[0]: found 3, expected a map"));
}

TEST(YamlFile, WhatYamlWouldSwallowIsRefused) {
  const std::string ok = "objects: [{mass_kg: 1}]\n";
  EXPECT_EQ(told(ok, read_objects), "no error");
  EXPECT_THAT(objects("  - mass_kg: 3\n    mass_kg: 4\n"),
              HasSubstr(":4: the key \"mass_kg\" stands here twice; first in line 3"));
  EXPECT_THAT(told("a: &x 3\nb: 4\n"), HasSubstr(":1: anchors (&name) are not allowed"));
  EXPECT_THAT(told("a: &x {b: 1}\nc: *x\n"), HasSubstr("anchors (&name) are not allowed"));
  EXPECT_THAT(told("c: *x\n"), StartsWith("scenes/wall.yaml:1: "));
  EXPECT_THAT(told("<<: {a: 1}\n"), HasSubstr("merge keys"));
  EXPECT_THAT(told("a: !!float 3\n"), HasSubstr("tags (!name) are not allowed"));
  EXPECT_THAT(told("a: !mine {b: 1}\n"), HasSubstr("tags (!name) are not allowed"));
  EXPECT_THAT(told("---\na: 1\n---\nb: 2\n"), HasSubstr("more than one document"));
  EXPECT_THAT(told("a: 1\n...\nb: 2\n"), StartsWith("scenes/wall.yaml"));
  EXPECT_THAT(told("[a, b]: 1\n"), HasSubstr("a key must be a word"));
  EXPECT_THAT(told("? {a: 1}\n: 2\n"), HasSubstr("a key must be a word"));
  EXPECT_THAT(told(": 1\n"), HasSubstr("a key is missing"));
  EXPECT_THAT(told("a: 1\n\tb: 2\n"), HasSubstr(":2: found a tab in the indentation; use spaces"));
  EXPECT_THAT(told("a: [1, 2\n"), HasSubstr("not YAML: "));
  EXPECT_THAT(told("a: b: c\n"), HasSubstr("not YAML: "));
  EXPECT_THAT(told("b: 1\na: 'open\n"), HasSubstr(":2: a quote or a block of text that begins here never ends"));
  EXPECT_THAT(told("b: 1\na: \"open\nc: 2\n"), HasSubstr(":2: a quote or a block of text that begins here never ends"));
  EXPECT_EQ(told(""), "scenes/wall.yaml: the file is empty");
  EXPECT_EQ(told("# only words\n\n"), "scenes/wall.yaml: the file is empty");
  EXPECT_EQ(told("---\n"), "scenes/wall.yaml: the file is empty");
  EXPECT_EQ(told("\xEF\xBB\xBF"
                 "a: 1\n"),
            "no error");  // a byte order mark, as some editors write it
  EXPECT_EQ(told("a: 1\r\nb: 2\r\n"), "no error");
  EXPECT_EQ(told("a: |\n  text\n  more\n", [](const YamlNode& r) { EXPECT_EQ(r.string("a"), "text\nmore\n"); }),
            "no error");
  EXPECT_EQ(told("a: >-\n  text\n  more", [](const YamlNode& r) { EXPECT_EQ(r.string("a"), "text more"); }),
            "no error");
  EXPECT_EQ(told("a: two\n  lines", [](const YamlNode& r) { EXPECT_EQ(r.string("a"), "two lines"); }), "no error");
}

TEST(YamlFile, OnlyUtf8TextIsRead) {
  EXPECT_EQ(told("name: \"Größe µ 漢 🦾\"\n"), "no error");
  for (const char* bad : {"\xff", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf0\x80\x80\xaf", "\xf4\x90\x80\x80",
                          "\xc3", "\xe6\xbc", "\x80", "\xf8\x88\x80\x80\x80"}) {
    EXPECT_THAT(told("a: 1\nname: " + std::string(bad)),
                StartsWith("scenes/wall.yaml:2: found a byte that is not UTF-8"));
  }
  EXPECT_THAT(told(std::string("a: 1\nb: \0 2\n", 12)), HasSubstr(":2: found a control character"));
  EXPECT_THAT(told("a: \x1b[31m\n"), HasSubstr("found a control character"));
}

TEST(YamlFile, DepthAndSizeAreBounded) {
  const auto nested = [](int n) { return "a: " + std::string(n, '[') + std::string(n, ']') + "\n"; };
  EXPECT_EQ(told(nested(31)), "no error");  // with the root map: 32
  EXPECT_THAT(told(nested(32)), HasSubstr("nested deeper than 32 levels"));
  EXPECT_THAT(told(std::string(1'000'000, '[')), HasSubstr("nested deeper than 32 levels"));
  EXPECT_THAT(told(std::string(1'000'000, '{')), HasSubstr("nested deeper than 32 levels"));
  std::string block;
  for (int i = 0; i < 40; ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_THAT(told(block + std::string(40, ' ') + "b: 1\n"), HasSubstr("nested deeper than 32 levels"));
  std::string dashes;
  for (int i = 0; i < 100'000; ++i) dashes += "- ";
  EXPECT_THAT(told(dashes + "1\n"), StartsWith("scenes/wall.yaml"));
  EXPECT_THAT(told(std::string((16U << 20U) + 1, ' ')), HasSubstr("is larger than 16 MiB"));
  std::string values = "a: [1";
  for (int i = 0; i < 600'000; ++i) values += ",1";
  EXPECT_THAT(told(values + "]\n"), HasSubstr("more than 500000 values in the file"));
  std::string keys;
  for (int i = 0; i < 1001; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  EXPECT_THAT(told(keys), HasSubstr(":1001: more than 1000 keys in one map"));
}

TEST(YamlFile, ABombOfAliasesIsRefusedAtOnce) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb +=
        "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before + ", " + before + ", " + before + "]\n";
  }
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT(told(bomb), HasSubstr("anchors (&name) are not allowed"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30)) << "it would take years";
}

TEST(YamlFile, FilesThatCantBeReadAreNamed) {
  const auto load = [](const std::filesystem::path& file) -> std::string {
    try {
      (void)YamlNode::load(file);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "no error";
  };
  const std::filesystem::path folder = testing::TempDir();
  EXPECT_EQ(load("/nonexistent/wall.yaml"), "/nonexistent/wall.yaml: no such file");
  EXPECT_EQ(load("/dev/null/wall.yaml"), "/dev/null/wall.yaml: no such file");
  EXPECT_THAT(load(folder), HasSubstr("is a folder; name a file in it"));
  const auto file = folder / ("proxarm_yaml_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(file) << "";
  EXPECT_EQ(load(file), file.string() + ": the file is empty");
  std::ofstream(file) << "a: 1\n";
  EXPECT_EQ(load(file), "no error");
  if (geteuid() != 0) {  // root reads everything
    ::chmod(file.c_str(), 0);
    EXPECT_EQ(load(file), file.string() + ": can't be read; look at its permissions");
    ::chmod(file.c_str(), 0600);
  }
  EXPECT_THAT(load("/dev/zero"), StartsWith("/dev/zero: "));  // must end
  std::filesystem::remove(file);
}

TEST(YamlFile, PathsAreRelativeToTheFile) {
  const YamlNode root = YamlNode::parse(
      "a: ../meshes/x.stl\nb: /etc/passwd\nc: gone.stl\nd: \".\"\ne: /tmp\nf: /dev/zero\n", "/data/scenes/wall.yaml");
  EXPECT_EQ(root.path_of("a"), "/data/meshes/x.stl");
  EXPECT_EQ(root.path_of("b"), "/etc/passwd");
  const auto existing = [&](const char* key) -> std::string {
    try {
      return root.existing_file(key).string();
    } catch (const SetupError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(existing("b"), "/etc/passwd");
  EXPECT_EQ(existing("c"),
            "/data/scenes/wall.yaml:3: c: found \"gone.stl\", expected a readable file; "
            "\"/data/scenes/gone.stl\" doesn't exist");
  EXPECT_THAT(existing("d"), HasSubstr("doesn't exist"));
  EXPECT_THAT(existing("e"), HasSubstr("is a folder"));
  EXPECT_THAT(existing("f"), HasSubstr("is no file to read"));
}

TEST(YamlFile, WhatStrangersWriteDoesntReachTheTerminalAsItIs) {
  // Escape sequences, newlines and half characters in messages are shown, not sent.
  const std::string text =
      told("mode: \"a\\x1b[31m\\n\\x85\"\n", [](const YamlNode& r) { (void)r.choice("mode", {"csp"}); });
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\n'), std::string::npos);
  EXPECT_THAT(text, HasSubstr("\\x1b[31m\\x0a"));
  const std::string key = told("\"a\\x1bb\": 1\n", [](const YamlNode& root) { root.finish(); });
  EXPECT_EQ(key.find('\x1b'), std::string::npos);
  EXPECT_LT(
      told("mode: " + std::string(100'000, 'x') + "\n", [](const YamlNode& r) { (void)r.choice("mode", {"csp"}); })
          .size(),
      300U);
}

TEST(YamlFile, UnitsAreReadOffTheKeys) {
  EXPECT_EQ(unit_of_key("mass_kg"), "kg");
  EXPECT_EQ(unit_of_key("damping_Ns_per_m"), "Ns/m");
  EXPECT_EQ(unit_of_key("max_acceleration_rad_per_s2"), "rad/s²");
  EXPECT_EQ(unit_of_key("centre_of_mass_S_m"), "m");
  EXPECT_EQ(unit_of_key("gear_stiffness_Nm_per_rad"), "Nm/rad");
  EXPECT_EQ(unit_of_key("viscous_friction_Nms_per_rad"), "Nms/rad");
  EXPECT_EQ(unit_of_key("gravity_W_m_per_s2"), "m/s²");
  EXPECT_EQ(unit_of_key("friction"), "");
  EXPECT_EQ(unit_of_key("items"), "");
}

TEST(SetupError, BusNodeAndObjectMakeOneLine) {
  const SetupError drive({.bus = "axes_1_3",
                          .node = 2,
                          .object = "1000h:00",
                          .found = "0x00030191",
                          .expected = "0x00020192",
                          .advice = "is another drive set to this node?"});
  EXPECT_STREQ(drive.what(),
               "bus axes_1_3, node 2, object 1000h:00: found 0x00030191, expected 0x00020192; is another drive "
               "set to this node?");
  const SetupError bus({.bus = "can7", .message = "no such interface", .advice = "ip link shows those that exist"});
  EXPECT_STREQ(bus.what(), "bus can7: no such interface; ip link shows those that exist");
  const SetupError option({.key = "--mass", .found = "-1", .expected = "a mass"});
  EXPECT_STREQ(option.what(), "--mass: found -1, expected a mass");
}

TEST(SetupError, NumbersReadBackTheSame) {
  for (const double x : {0.0, 0.1, 1.0 / 3.0, -2.5, 1e-5, 9.9e-6, 1e300, 5e-324, 123456789.123, 1e9, 1e15}) {
    EXPECT_EQ(std::strtod(number_text(x).c_str(), nullptr), x) << number_text(x);
  }
  EXPECT_EQ(number_text(0.0005), "0.0005");
  EXPECT_EQ(number_text(100000.0), "100000");
}

}  // namespace
}  // namespace proxarm::description
