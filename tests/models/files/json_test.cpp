// What programs read of proxarm, held against texts that were written by hand.
#include "models/files/json.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace proxarm::description {
namespace {

TEST(Json, KeepsTheOrderOfKeysAndWritesEachKindOfValue) {
  Json json{{"text", "a \"quoted\" one"}, {"number", 0.1}, {"whole", -3}, {"truth", true}, {"nothing", nullptr}};
  json["list"] = Json::array();
  json["list"].push_back(1);
  json["list"].push_back({{"x", 2.0}});
  json["object"]["deep"] = std::vector<double>{1.5, 2.5};
  EXPECT_EQ(json.dump(),
            R"({"text":"a \"quoted\" one","number":0.1,"whole":-3,"truth":true,"nothing":null,"list":[1,{"x":2.0}],)"
            R"("object":{"deep":[1.5,2.5]}})");
}

TEST(Json, TakesPairsThatBeginWithATextForAnObjectAndAllElseForAList) {
  EXPECT_EQ(Json({{"a", 1}, {"b", 2}}).dump(), R"({"a":1,"b":2})");
  EXPECT_EQ(Json({1, 2, "three"}).dump(), R"([1,2,"three"])");
  EXPECT_EQ(Json({{"a", 1}, 2}).dump(), R"([["a",1],2])");
  EXPECT_EQ(Json::object().dump(), "{}");
  EXPECT_EQ(Json::array().dump(), "[]");
}

TEST(Json, WritesNumbersThatAreNotFiniteAsNull) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Json({infinity, -infinity, std::numeric_limits<double>::quiet_NaN()}).dump(), "[null,null,null]");
  EXPECT_EQ(Json(std::optional<double>()).dump(), "null");
}

TEST(Json, ReplacesWhatIsNotUtf8) { EXPECT_EQ(Json("a\xff").dump(), "\"a\xef\xbf\xbd\""); }

TEST(Json, UpdateReplacesValuesWhereTheirKeysStandAndAddsOthersBehind) {
  Json json{{"a", 1}, {"b", 2}};
  json.update({{"c", 3}, {"a", 4}});
  EXPECT_EQ(json.dump(), R"({"a":4,"b":2,"c":3})");
}

TEST(Json, IndentsByLevels) {
  EXPECT_EQ(Json({{"a", Json::array()}, {"b", 1}}).dump(2), "{\n  \"a\": [],\n  \"b\": 1\n}");
}

TEST(Json, ReadsWhatItWroteAndTellsWhatIsNoJson) {
  const std::optional<Json> read = Json::parse(R"({"url":"http://x","port":80,"list":[{"text":"last"}],"half":0.5})");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->text_of("url"), "http://x");
  EXPECT_EQ(read->integer_of("port"), 80);
  EXPECT_EQ(read->find("list")->items().back().text_of("text"), "last");
  EXPECT_FALSE(read->text_of("port"));
  EXPECT_FALSE(read->integer_of("half"));
  EXPECT_EQ(read->find("absent"), nullptr);
  for (const char* broken : {"", "{", "{\"a\":}", "nul"}) EXPECT_FALSE(Json::parse(broken)) << broken;
}

}  // namespace
}  // namespace proxarm::description
