// Sums of friction cones.
#include <gtest/gtest.h>

#include "models/surfaces/cone_sum.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;

TEST(ConeSum, HoldsWhatItsMembersBear) {
  Random random(404);
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    models::ForceCone cones[3];
    const auto count = static_cast<std::size_t>(1 + random.below(3));
    Vec3 f = Vec3::Zero();
    for (std::size_t c = 0; c < count; ++c) {
      cones[c] = {random.direction<3>(), random.chance(0.3) ? 0.0 : random.uniform(0.0, 1.0)};
      const double f_n = random.chance(0.3) ? 0.0 : random.uniform(0.0, 10.0);
      const Vec3 t = cones[c].axis.cross(random.direction<3>());
      f += f_n * (cones[c].axis + random.uniform(0.0, 1.0) * cones[c].mu * t);
    }
    ASSERT_TRUE(models::in_sum_of_cones(f, {cones, count}, 1e-12));
    // A direction that no member of the dual is against: what the least y finds must be a separating plane.
    const Vec3 g = 10.0 * random.direction<3>();
    if (!models::in_sum_of_cones(g, {cones, count}, 1e-9)) {
      ASSERT_FALSE(models::in_sum_of_cones(2.0 * g, {cones, count}, 1e-9));
      const Vec3 sum = g + f;  // f bears something: g + f may be in, but g alone may not be reached from below
      ASSERT_FALSE(models::in_sum_of_cones(Vec3(sum - f), {cones, count}, 1e-9));
    }
  }
}

}  // namespace
}  // namespace proxarm::tests
