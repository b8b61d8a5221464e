#include "models/base/quantity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/base/setup_error.hpp"

namespace proxarm::description {
namespace {

using testing::HasSubstr;

template <class Parse>
std::string told(Parse parse, std::string_view text) {
  try {
    (void)parse(text, "--option");
  } catch (const SetupError& error) {
    EXPECT_EQ(error.key(), "--option");
    return error.what();
  }
  return "no error";
}

TEST(Duration, IsTheNearestDoubleOfWhatWasWritten) {
  EXPECT_EQ(parse_duration("1ms"), 1e-3);
  EXPECT_EQ(parse_duration("0.5ms"), 5e-4);
  EXPECT_EQ(parse_duration("0.1ms"), 1e-4);
  EXPECT_EQ(parse_duration("500us"), 5e-4);
  EXPECT_EQ(parse_duration("500µs"), 5e-4);  // U+00B5
  EXPECT_EQ(parse_duration("500μs"), 5e-4);  // U+03BC
  EXPECT_EQ(parse_duration("250000ns"), 2.5e-4);
  EXPECT_EQ(parse_duration("2s"), 2.0);
  EXPECT_EQ(parse_duration(" 2 s "), 2.0);
  EXPECT_EQ(parse_duration("1e-3s"), 1e-3);
  EXPECT_EQ(parse_duration("1.5min"), 90.0);
  EXPECT_EQ(parse_duration("24h"), 86400.0);
  EXPECT_EQ(parse_duration(".5s"), 0.5);
  EXPECT_EQ(parse_duration("2.ms"), 2e-3);
}

TEST(Duration, NeedsItsUnit) {
  EXPECT_EQ(told(parse_duration, "1"),
            "--option: found \"1\", expected a duration above zero, with its unit, such as 1ms; the unit is missing: "
            "1ms? 1s?");
  EXPECT_THAT(told(parse_duration, "1 day"), HasSubstr("\"day\" is no unit of it; known: s, ms, us"));
  EXPECT_THAT(told(parse_duration, "1kg"), HasSubstr("\"kg\" is no unit of it"));
  EXPECT_THAT(told(parse_duration, "1MS"), HasSubstr("\"MS\" is no unit of it"));
}

TEST(Duration, RefusesWhatIsNoneOrNotAboveZero) {
  for (const char* bad : {"",    " ",      "s",     "ms",     "-1ms",    "0s",   "0.0ms",    "nan",
                          "inf", "nans",   "infs",  "1e999s", "1e-999s", "01ms", "0x10ms",   "1,5ms",
                          ".ms", "1.5.ms", "1 2ms", "--1ms",  "1ms1ms",  "1m s", "\x1b[31m", "\xff"}) {
    EXPECT_THAT(told(parse_duration, bad), HasSubstr("expected a duration above zero")) << bad;
  }
  EXPECT_EQ(told(parse_duration, "\x1b[31m").find('\x1b'), std::string::npos);
  EXPECT_LT(told(parse_duration, std::string(100'000, '1')).size(), 400U);
}

TEST(Mass, IsInKilogramsUnlessItSaysGrams) {
  EXPECT_EQ(parse_mass("3"), 3.0);
  EXPECT_EQ(parse_mass("3kg"), 3.0);
  EXPECT_EQ(parse_mass("2.5 kg"), 2.5);
  EXPECT_EQ(parse_mass("250g"), 0.25);
  EXPECT_EQ(parse_mass("0.3"), 0.3);
  for (const char* bad : {"0", "-3", "-0", "kg", "3N", "3KG", "nan", "inf", ""}) {
    EXPECT_THAT(told(parse_mass, bad), HasSubstr("expected a mass above zero, such as 3kg")) << bad;
  }
}

TEST(Angle, IsInRadiansUnlessItSaysMilliradians) {
  EXPECT_EQ(parse_angle("0.005"), 5e-3);
  EXPECT_EQ(parse_angle("5mrad"), 5e-3);
  EXPECT_EQ(parse_angle("0.005rad"), 5e-3);
  EXPECT_EQ(parse_angular_speed("0.5rad/s"), 0.5);
  EXPECT_EQ(parse_angular_speed("500mrad/s"), 0.5);
  EXPECT_EQ(parse_torque("100Nm"), 100.0);
  EXPECT_EQ(parse_torque("0"), 0.0);
  EXPECT_THAT(told(parse_angle, "5mm"), HasSubstr("\"mm\" is no unit of it; known: rad, mrad"));
  EXPECT_THAT(told(parse_angular_speed, "0"), HasSubstr("expected a speed above zero"));
  EXPECT_THAT(told(parse_torque, "-1"), HasSubstr("expected a torque, zero or more"));
}

TEST(Damping, MayBeZeroButNotNegative) {
  EXPECT_EQ(parse_damping("0"), 0.0);
  EXPECT_EQ(parse_damping("20"), 20.0);
  EXPECT_EQ(parse_damping("20Ns/m"), 20.0);
  EXPECT_EQ(parse_damping("20 N·s/m"), 20.0);
  EXPECT_THAT(told(parse_damping, "-1"), HasSubstr("expected a damping, zero or more, such as 20Ns/m"));
  EXPECT_EQ(parse_stiffness("0.5N/mm"), 500.0);
  EXPECT_EQ(parse_stiffness("500"), 500.0);
}

}  // namespace
}  // namespace proxarm::description
