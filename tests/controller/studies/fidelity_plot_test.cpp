#include "controller/extras/studies/fidelity_plot.hpp"

#include <gtest/gtest.h>

#include "controller/extras/studies/fidelity.hpp"
#include "controller/extras/studies/fidelity_bands.hpp"

namespace proxarm::studies {
namespace {

using Errors = std::map<double, double>;

TEST(FidelityBand, IsWhereTheErrorPassesTheLimit) {
  const Errors errors{{0.1, 0.5}, {0.5, 0.02}, {1.0, 0.05}, {2.0, 0.2}, {5.0, 0.01}};  // 0.1 Hz isn't asked about
  EXPECT_NEAR(band_Hz(errors, 0.1), 1.414, 1e-3);
  EXPECT_EQ(band_text(errors, 0.1), "up to 1.4 Hz");
  EXPECT_EQ(band_text(errors, 0.3), "up to 5 Hz, the highest measured");
  EXPECT_EQ(band_text(errors, 0.01), "at no frequency from 0.3 Hz on");
}

class FidelityAnswer : public testing::Test {
 protected:
  // A session along x whose error is `at_1_Hz` at 1 Hz and grows with frequency.
  void add(double mass, double inertia, double at_1_Hz, bool looks_ahead, bool torque, double scale = 1.0) {
    for (const double f : {0.5, 1.0, 2.0}) {
      const double error = scale * at_1_Hz * f;
      table.add(job, {std::string("default"),
                      std::string("x"),
                      0.0,
                      mass,
                      inertia,
                      1e-3,
                      1.0,
                      looks_ahead ? 1.0 : 0.0,
                      torque ? 1.0 : 0.0,
                      f,
                      1.0,
                      1.0,
                      mass,
                      0.0,
                      error,
                      1.0,
                      1.0,
                      1.0,
                      inertia,
                      0.0,
                      error});
    }
  }
  void add_in_two_directions(double mass, double at_1_Hz, bool looks_ahead, bool torque) {
    add(mass, 0.0, at_1_Hz, looks_ahead, torque, 0.5);
    add(mass, 0.0, at_1_Hz, looks_ahead, torque);
    ++job;
  }

  std::size_t job = 0;
  Table table{Fidelity(ArmRun{}).columns()};
};

TEST_F(FidelityAnswer, ComparesOneMassWithItselfInTheWorstDirection) {
  add_in_two_directions(4.0, 0.05, false, false);
  add_in_two_directions(10.0, 0.1, false, false);
  add_in_two_directions(10.0, 0.06, true, false);
  add_in_two_directions(10.0, 0.001, true, true);
  EXPECT_EQ(
      fidelity_answer(table),
      "At T = 1 ms 10 kg feels right within 10 % up to 1 Hz, with lookahead up to 1.7 Hz, with lookahead and torque up "
      "to 2 Hz, the highest measured (worst direction)");
}

TEST_F(FidelityAnswer, SaysWhereNothingIsWithinTheLimit) {
  add_in_two_directions(10.0, 1.0, false, false);
  EXPECT_EQ(fidelity_answer(table),
            "At T = 1 ms 10 kg feels right within 10 % at no frequency from 0.3 Hz on (worst direction)");
}

TEST_F(FidelityAnswer, IsOfAllInertiasTheLeast) {
  add(4.0, 0.05, 0.05, false, false);
  add(4.0, 0.3, 0.09, false, false);
  EXPECT_EQ(fidelity_turning_answer(table),
            "At T = 1 ms 0.05 to 0.3 kg m² all feel right within 10 % up to 1.1 Hz (worst axis)");
}

TEST_F(FidelityAnswer, ClaimsNothingWithoutData) {
  EXPECT_EQ(fidelity_answer(table).find("Hz"), std::string::npos);
  EXPECT_EQ(fidelity_turning_answer(table).find("Hz"), std::string::npos);
}

}  // namespace
}  // namespace proxarm::studies
