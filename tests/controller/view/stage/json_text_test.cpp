#include "controller/stage/json_text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace proxarm::view {
namespace {

TEST(JsonText, PutsCommasBetweenMembersAndNowhereElse) {
  JsonText json, inner;
  inner.begin_list().value(1).begin_list().end().value(2).end();
  json.begin_object().add("a", 1).name("b").begin_list().begin_object().end().value("x").end();
  json.name("c").splice(inner).add("d", true).name("e").null().end();
  EXPECT_EQ(json.take(), R"({"a":1,"b":[{},"x"],"c":[1,[],2],"d":true,"e":null})");
}

TEST(JsonText, NumbersReadAsTheSameAndNoneThatJsonDoesntHave) {
  JsonText json;
  json.begin_list().value(0.1).value(-1e-300).value(std::numeric_limits<double>::denorm_min());
  json.value(std::numeric_limits<double>::max()).value(std::uint64_t{18446744073709551615U}).value(-0.0);
  json.value(std::numeric_limits<double>::infinity()).value(std::nan("")).end();
  const auto read = nlohmann::json::parse(json.take());
  EXPECT_EQ(read[0], 0.1);
  EXPECT_EQ(read[1], -1e-300);
  EXPECT_EQ(read[2], std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(read[3], std::numeric_limits<double>::max());
  EXPECT_EQ(read[4], 18446744073709551615U);
  EXPECT_EQ(read[5], 0.0);
  EXPECT_TRUE(read[6].is_null() && read[7].is_null());
}

TEST(JsonText, AnyTextIsReadAsItWasButForBytesThatArentText) {
  JsonText json;
  const std::string text = std::string("\" \\ / \n\t\r\x01\x1f\x7f") + '\0' + " µ→😀 ]}{[:,";
  json.begin_object().add(text, text).add("broken", "a\xff\xc3").end();
  const auto read = nlohmann::json::parse(json.take());
  EXPECT_EQ(read[text], text);
  EXPECT_EQ(read["broken"], "a\uFFFD\uFFFD");
}

}  // namespace
}  // namespace proxarm::view
