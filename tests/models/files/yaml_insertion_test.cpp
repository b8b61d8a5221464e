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

TEST(YamlInsertion, ComesFirstInBraces) {
  const std::string two = with({{"drives"}, {"joint", "two"}}, "damping");
  EXPECT_NE(two.find("  - {damping: 7, joint: two, gear: 4}\n"), std::string::npos) << two;
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

}  // namespace
}  // namespace proxarm::description
