#include "models/files/csv_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace proxarm::description {
namespace {

using testing::HasSubstr;

const CsvColumns named{"time_s", "x_m", "y_m", "z_m"}, numbered{"1", "2", "3", "4"};

std::vector<TimedVector> parsed(std::string_view text, const CsvColumns& columns = named) {
  return parse_csv(text, "motion.csv", columns, between(-10.0, 10.0));
}

std::string told(std::string_view text, const CsvColumns& columns = named) {
  try {
    (void)parsed(text, columns);
    return "no error";
  } catch (const SetupError& error) {
    return error.what();
  }
}

void expect_two_rows(std::string_view text, const CsvColumns& columns = named) {
  const std::vector<TimedVector> rows = parsed(text, columns);
  ASSERT_EQ(rows.size(), 2U) << text;
  EXPECT_EQ(rows[0].time_s, 0.0) << text;
  EXPECT_EQ(rows[1].time_s, 0.5) << text;
  EXPECT_EQ(rows[1].value, (std::array<double, 3>{1.0, -2.0, 0.03})) << text;
}

TEST(CsvFile, IsReadAsToolsWriteIt) {
  expect_two_rows("time_s,x_m,y_m,z_m\n0,0,0,0\n0.5,1,-2,3e-2\n");
  expect_two_rows("time_s,x_m,y_m,z_m\r\n0,0,0,0\r\n0.5,1,-2,3e-2");            // Windows; no last line end
  expect_two_rows("\xEF\xBB\xBFtime_s;x_m;y_m;z_m\n0;0;0;0\n0.5;1;-2;0.03\n");  // a spreadsheet
  expect_two_rows("\"time_s\"\t\"x_m\"\t\"y_m\"\t\"z_m\"\n0\t0\t0\t0\n0.5\t1\t-2\t0.03\n");
  expect_two_rows("# by hand\n\ntime_s, x_m, y_m, z_m\n 0, 0, 0, 0\n# half way\n 0.5, 1, -2, 0.03\n\n");
  expect_two_rows("z_m,note,time_s,y_m,x_m\n0,begin,0,0,0\n0.03,end,0.5,-2,1\n");  // in any order, among others
}

TEST(CsvFile, ColumnsAreMappedByNameOrNumber) {
  expect_two_rows("t,px,py,pz\n0,0,0,0\n0.5,1,-2,0.03\n", {"t", "px", "py", "pz"});
  expect_two_rows("0,0,0,0\n0.5,1,-2,0.03\n", numbered);  // no header
  expect_two_rows("a,b,c,d\n0,0,0,0\n0.5,1,-2,0.03\n", numbered);
  expect_two_rows("t,px,py,pz\n0,0,0,0\n0.5,1,-2,0.03\n", {"t", "2", "3", "4"});
}

TEST(CsvFile, MistakesAreToldWithTheirLine) {
  const std::string head = "time_s,x_m,y_m,z_m\n0,0,0,0\n";
  EXPECT_THAT(told(""), HasSubstr("motion.csv: found no line"));
  EXPECT_THAT(told("time_s,x_m,y_m,z_m\n"), HasSubstr("found 0 rows of numbers, expected at least two"));
  EXPECT_THAT(told(head), HasSubstr("found 1 row of numbers"));
  EXPECT_THAT(told("t,x_m,y_m,z_m\n0,0,0,0\n"),
              HasSubstr("motion.csv:1: time_s: found no such column among \"t, x_m, y_m, z_m\""));
  EXPECT_THAT(told("0,0,0,0\n1,0,0,0\n"), HasSubstr("motion.csv:1: time_s: found no such column"));
  EXPECT_THAT(told(head + "1,0,0\n"), HasSubstr("motion.csv:3: z_m: found 3 fields, expected at least 4"));
  EXPECT_THAT(told(head + "1,0,zero,0\n"), HasSubstr("motion.csv:3: y_m: found \"zero\", expected a number"));
  EXPECT_THAT(told(head + "1,0,,0\n"), HasSubstr("motion.csv:3: y_m: found \"\""));
  EXPECT_THAT(told(head + "1,nan,0,0\n"), HasSubstr("motion.csv:3: x_m: found \"nan\""));
  EXPECT_THAT(told("time_s;x_m;y_m;z_m\n0;0;0;0\n0,5;1;2;3\n"), HasSubstr("found \"0,5\", expected a number, with a"));
  EXPECT_THAT(told(head + "1,0,11,0\n"), HasSubstr("motion.csv:3: y_m: found 11, expected -10 to 10"));
  EXPECT_THAT(told(head + "\n0,0,0,0\n"), HasSubstr("motion.csv:4: time_s: found 0, expected a time after"));
  EXPECT_THAT(told(head + "1,1e999,0,0\n"), HasSubstr("x_m"));
}

// Whatever stands in a file, the answer is rows or a SetupError.
TEST(CsvFile, DamageDoesNoMoreThanFail) {
  constexpr unsigned seed = 4;
  std::mt19937 engine(seed);
  const std::string salad = "0123456789.eE+-,;\t\n\r\"# xyz_mt\xff";
  const auto below = [&](std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine); };
  int read = 0;
  for (int n = 0; n < 2000; ++n) {
    std::string text = "time_s,x_m,y_m,z_m\n0,0,0,0\n0.5,1,-2,0.03\n1,2,3,4\n";
    for (std::size_t changes = below(4); changes > 0; --changes) text[below(text.size())] = salad[below(salad.size())];
    const std::string said = told(text);
    read += said == "no error" ? 1 : 0;
    EXPECT_TRUE(said == "no error" || said.find("motion.csv") != std::string::npos) << said;
  }
  EXPECT_GT(read, 500) << "a quarter wasn't changed at all";
  EXPECT_LT(read, 1900);
}

}  // namespace
}  // namespace proxarm::description
