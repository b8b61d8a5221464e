// What `proxarm explain` says.
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "scenes/compiler/explain.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

TEST(Explain, SaysWhatAStepCosts) {
  const std::string text = scenes::explain(scenes::load_scene(source_file("scenes") / "room.yaml"));
  EXPECT_NE(text.find("in contact: "), std::string::npos) << text;
  EXPECT_NE(text.find("free: "), std::string::npos) << text;
  std::cout << text;
}

}  // namespace
}  // namespace proxarm::tests
