#include "controller/extras/studies/stability_plot.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "controller/extras/studies/stability_map.hpp"

namespace proxarm::studies {
namespace {

class StabilityAnswer : public testing::Test {
 protected:
  // A point with a hand of 1 kg and 20 Ns/m, 16 ms of delay. Below 0: no mass is stable.
  void add(double period_s, double stiffness, double predicted_kg, double measured_kg, double sensitivity = 1.0) {
    const double none = std::nan("");
    table.add(job++, {period_s, stiffness, 20.0, 1.0, 16e-3, 1.6e-3, 1.0, predicted_kg, measured_kg, sensitivity, none,
                      none, none, none, none});
  }

  std::size_t job = 0;
  Table table{StabilityMap().columns()};
};

TEST_F(StabilityAnswer, SaysUpToWhichStiffnessAndFromWhichOnNoMassIsStable) {
  add(1.2e-3, 100.0, 0.971, 0.971);
  add(1.2e-3, 878.8, 0.951, 0.951);
  add(1.2e-3, 1357.2, -1.0, -1.0);
  add(8e-3, 100.0, 5.0, 5.0);  // not asked about
  EXPECT_EQ(stability_answer(table),
            "The longer the delay, the softer must the hand be in which a mass is stable: up to 879 N/m (dots; "
            "timestep 1.2 ms)");
}

TEST_F(StabilityAnswer, SaysWhereAllStiffnessesHaveAStableMass) {
  add(1e-3, 100.0, 0.5, 0.5);
  EXPECT_EQ(stability_answer(table),
            "The longer the delay, the softer must the hand be in which a mass is stable: up to 100 N/m and more "
            "(dots; timestep 1 ms)");
}

TEST_F(StabilityAnswer, ClaimsNothingWhereNoMassIsStableOrNothingWasMeasured) {
  EXPECT_EQ(stability_answer(table), "Which mass is stable");
  EXPECT_EQ(agreement_answer(table), "No point's measured and predicted smallest mass could be compared");
  add(1e-3, 100.0, -1.0, -1.0);
  EXPECT_EQ(stability_answer(table), "Which mass is stable");
}

TEST_F(StabilityAnswer, OfTheAgreementLeavesOutWhatIsTooSensitive) {
  add(1e-3, 100.0, 1.0, 1.002);
  add(1e-3, 200.0, 1.0, 0.997);
  add(1e-3, 300.0, 1.0, 1.5, 4.0);
  add(1e-3, 400.0, 1.0, std::nan(""));
  EXPECT_EQ(agreement_answer(table), "Measured and predicted smallest mass differ by at most 0.3 % at 2 points");
}

}  // namespace
}  // namespace proxarm::studies
