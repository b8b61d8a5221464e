#include "models/files/key_line.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace proxarm::description {
namespace {

class KeyLine : public testing::Test {
 protected:
  KeyLine() {
    std::ofstream(file_) << "name: a cell\nsensor:\n  bus: can\n  settings: {first_id: 1,\n    second_id: 2}\n";
  }
  ~KeyLine() override { std::filesystem::remove(file_); }

  std::filesystem::path file_ = std::filesystem::path(testing::TempDir()) / "key_line_test.yaml";
};

TEST_F(KeyLine, IsWhereTheKeyStands) {
  EXPECT_EQ(line_of_key(file_, "name"), 1);
  EXPECT_EQ(line_of_key(file_, "sensor.bus"), 3);
  EXPECT_EQ(line_of_key(file_, "sensor.settings.second_id"), 5);
}

TEST_F(KeyLine, OfAKeyThatIsNotThereIsThatOfTheNearestAboveIt) {
  EXPECT_EQ(line_of_key(file_, "sensor.base_id"), line_of_key(file_, "sensor"));
  EXPECT_EQ(line_of_key(file_, "default_period_s"), 0);
}

}  // namespace
}  // namespace proxarm::description
