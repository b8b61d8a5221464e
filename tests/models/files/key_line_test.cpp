#include "models/files/key_line.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace proxarm::description {
namespace {

struct KeyLine : testing::Test {
  void SetUp() override {
    std::ofstream(file) << "name: a cell\nsensor:\n  bus: can\n  settings: {first_id: 1,\n    second_id: 2}\n";
  }
  void TearDown() override { std::filesystem::remove(file); }

  // A file of each test's own: they run beside each other.
  std::filesystem::path file = std::filesystem::path(testing::TempDir()) /
                               (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml");
};

TEST_F(KeyLine, IsWhereTheKeyStands) {
  EXPECT_EQ(line_of_key(file, "name"), 1);
  EXPECT_EQ(line_of_key(file, "sensor.bus"), 3);
  EXPECT_EQ(line_of_key(file, "sensor.settings.second_id"), 5);
}

TEST_F(KeyLine, OfAKeyThatIsNotThereIsThatOfTheNearestAboveIt) {
  EXPECT_EQ(line_of_key(file, "sensor.base_id"), line_of_key(file, "sensor"));
  EXPECT_EQ(line_of_key(file, "default_period_s"), 0);
}

}  // namespace
}  // namespace proxarm::description
