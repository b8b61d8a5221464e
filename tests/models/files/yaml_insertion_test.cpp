#include "models/files/yaml_insertion.hpp"

#include <gtest/gtest.h>

namespace proxarm::description {
namespace {

constexpr const char* cell = R"(# a cell
drives:
  - joint: one  # the first
    bus: a
    # of the gear
    gear: 3.5   # by its maker
    range: [-1,
      1]
    simulation:  # of it
      friction: 2

  - {joint: two, gear: 4}
  - joint: three
    simulation: {}
tool:
  mass: 1
# the end
)";

std::string with(const std::vector<YamlStep>& path, const std::string& key, std::string text = cell) {
  return insert_key(text, path, key, "7") ? text : "nothing";
}

// The text with this line behind the first of that beginning.
std::string behind(const std::string& line, const std::string& added) {
  std::string text = cell;
  const std::size_t at = text.find(line);
  EXPECT_NE(at, std::string::npos);
  return text.insert(text.find('\n', at) + 1, added + "\n");
}

TEST(YamlInsertion, ComesBehindTheLastPlainValueOfItsMapWithAllElseAsItWas) {
  EXPECT_EQ(with({{"drives"}, {"joint", "one"}}, "damping"), behind("    gear: 3.5", "    damping: 7"));
  EXPECT_EQ(with({{"drives"}, {"joint", "one"}, {"simulation"}}, "damping"),
            behind("      friction: 2", "      damping: 7"));
  EXPECT_EQ(with({{"drives"}, {"joint", "three"}}, "damping"), behind("  - joint: three", "    damping: 7"));
  EXPECT_EQ(with({{"tool"}}, "gear"), behind("  mass: 1", "  gear: 7"));
}

// What a list's member is known by stays its first key.
TEST(YamlInsertion, ComesBehindTheFirstInBraces) {
  const std::string two = with({{"drives"}, {"joint", "two"}}, "damping");
  EXPECT_NE(two.find("  - {joint: two, damping: 7, gear: 4}\n"), std::string::npos) << two;
  EXPECT_EQ(with({{"drives"}, {"joint", "a"}}, "gear", "drives: [{joint: a}, {joint: b}]\n"),
            "drives: [{joint: a, gear: 7}, {joint: b}]\n");
  EXPECT_EQ(with({{"drives"}, {"joint", "it's"}}, "gear", "drives:\n  - {joint: 'it''s',\n     node: 1}\n"),
            "drives:\n  - {joint: 'it''s',\n     gear: 7, node: 1}\n");
  const std::string three = with({{"drives"}, {"joint", "three"}, {"simulation"}}, "friction");
  EXPECT_NE(three.find("    simulation: {friction: 7}\n"), std::string::npos) << three;
}

TEST(YamlInsertion, KeepsTheEndsOfLinesAndAFileThatEndsWithoutOne) {
  EXPECT_EQ(with({{"tool"}}, "gear", "tool:\r\n  mass: 1\r\n"), "tool:\r\n  mass: 1\r\n  gear: 7\r\n");
  EXPECT_EQ(with({{"tool"}}, "gear", "tool:\n  mass: 1"), "tool:\n  mass: 1\n  gear: 7");
}

TEST(YamlInsertion, ChangesNothingWhereThereIsNoSuchMapOrItHasTheKey) {
  EXPECT_EQ(with({{"drives"}, {"joint", "four"}}, "damping"), "nothing");
  EXPECT_EQ(with({{"drives"}, {"joint", "one"}, {"nowhere"}}, "damping"), "nothing");
  EXPECT_EQ(with({{"drives"}}, "damping"), "nothing");
  EXPECT_EQ(with({{"drives"}, {"joint", "one"}}, "gear"), "nothing");
  EXPECT_EQ(with({{"drives"}, {"joint", "one"}}, "range"), "nothing");
  EXPECT_EQ(with({{"tool"}}, "gear", "tool:\n  parts:\n    - 1\n"), "nothing") << "no line to come behind";
}

TEST(YamlInsertion, SaysWhatIsThere) {
  EXPECT_TRUE(has_key(cell, {{"drives"}, {"joint", "one"}}, "gear"));
  EXPECT_TRUE(has_key(cell, {{"drives"}, {"joint", "one"}, {"simulation"}}, "friction"));
  EXPECT_FALSE(has_key(cell, {{"drives"}, {"joint", "two"}}, "simulation"));
  EXPECT_FALSE(has_key(cell, {{"nowhere"}}, "gear"));
}

}  // namespace
}  // namespace proxarm::description
