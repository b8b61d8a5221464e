// The links as they are modelled under a measured force, against the simulated steel and against what is known of them.
#include "controller/stability/link_motion.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <vector>

#include "controller/stability/elastic_loop.hpp"
#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;
using testing::ClosedLoopRig;
using testing::RigOptions;

struct DefaultArm {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  models::Arm arm{cell};
  [[nodiscard]] LinkMotionConfig config() const {
    const ElasticArm elastic = elastic_arm(arm, arm.start_rad(), cell);
    return {.stiffness = elastic.stiffness,
            .damping = elastic.damping,
            .behind_sensor = models::tool_inertia(cell.tool),
            .force_age_s = 0.0};
  }
};

// Of what is left without the mean over a period of 16 Hz: root of the mean square over the last two seconds.
double swing_m(const std::vector<Vec3>& places) {
  constexpr std::size_t half = 31;
  double sum = 0.0;
  const std::size_t first = places.size() - 2000, end = places.size() - half;
  for (std::size_t k = first; k < end; ++k) {
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = k - half; i <= k + half; ++i) mean += places[i] / (2.0 * half + 1.0);
    sum += (places[k] - mean).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(end - first));
}

// The story: a tool that swung by 3 mm at 16 Hz, of which the motors have a third, and that with another phase.
TEST(LinkMotion, FollowsTheSteelWhereTheMotorsDont) {
  RigOptions options;
  options.hand = ::testing::TempDir() + "still-" + std::to_string(getpid()) + ".yaml";
  std::ofstream(options.hand) << "name: still\nmass_kg: 1\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\n"
                                 "inertia_kg_m2: 0.003\nturning_stiffness_Nm_per_rad: 20\n"
                                 "turning_damping_Nms_per_rad: 0.5\nwaypoints:\n"
                                 "  - {time_s: 0.5, offset_m: [0, 0, 0], turn_rad: [0, 0, 0]}\n"
                                 "  - {time_s: 2.5, offset_m: [0.08, 0, 0], turn_rad: [0, 0, 0]}\n";
  options.scene = "scenes/free.yaml";
  options.duration_s = 8.0;
  options.settings.mass_kg = 2.0;
  options.settings.orientation = OrientationMode::free;
  options.settings.rotational_inertia_kg_m2 = 0.005;
  options.settings.rotational_damping_Nms_per_rad = 0.0;
  options.settings.passivity = Passivity::observe;
  ClosedLoopRig rig(options);
  rig.run();
  std::vector<Vec3> steel, links_off, motors_off;
  for (std::size_t k = 0; k < rig.records.size(); ++k) {
    const CycleRecord& r = rig.records[k];
    if (r.phase != Phase::rendering) continue;
    steel.emplace_back(rig.truths.at(k).X_WT.translation());
    links_off.emplace_back(vec3(r.links_W_m) - steel.back());
    motors_off.emplace_back(vec3(r.tool_W_m) - steel.back());
  }
  ASSERT_GT(steel.size(), 3000U);
  const double swing = swing_m(steel), links = swing_m(links_off), motors = swing_m(motors_off);
  std::printf("steel %.2f mm rms; links off by %.2f, motors by %.2f mm\n", 1e3 * swing, 1e3 * links, 1e3 * motors);
  EXPECT_GT(swing, 0.5e-3);
  EXPECT_GT(motors, 0.5 * swing);
  EXPECT_LT(links, 0.2 * swing);
}

// The trapezoidal rule keeps the energy of a linear system, whatever its frequencies times T.
TEST(LinkMotion, WithoutDampingARingNeitherFallsNorGrows) {
  const DefaultArm its;
  for (const double period_s : {1e-3, 4e-3}) {
    LinkMotionConfig config = its.config();
    config.damping.setZero();
    LinkMotion links(its.arm, config, period_s);
    links.start(its.arm.start_rad());
    const auto mean_square = [&](double time_s) {
      double sum = 0.0;
      const int cycles = static_cast<int>(std::lround(time_s / period_s));
      for (int k = 0; k < cycles; ++k) {
        sum += links.step(its.arm.start_rad(), {}).links_W.squaredNorm() / (period_s * period_s * cycles);
      }
      return sum;
    };
    for (int k = 0; k < 20; ++k) links.step(its.arm.start_rad(), {Vec3(20.0, -30.0, 10.0), Vec3(0.5, 0.2, -0.3)});
    const double first = mean_square(5.0);
    mean_square(20.0);
    EXPECT_GT(first, 0.0);
    EXPECT_NEAR(mean_square(5.0), first, 0.05 * first) << period_s;  // the window's own beats
  }
}

// Without a force, and far below the gears' modes, links and motors go the same way, an age later.
TEST(LinkMotion, FollowsTheMotorsAnAgeLater) {
  const DefaultArm its;
  LinkMotionConfig config = its.config();
  config.force_age_s = 0.05;
  LinkMotion links(its.arm, config, 1e-3);
  links.start(its.arm.start_rad());
  double way_m = 0.0, half_at_s = 0.0, end_m = 0.0;
  for (const bool measured : {false, true}) {
    links.start(its.arm.start_rad());
    way_m = 0.0;
    for (int k = 1; k < 2000; ++k) {
      JointVector at = its.arm.start_rad();
      at[0] += 0.01 / (1.0 + std::exp(-(1e-3 * k - 1.0) / 0.05));
      const double before_m = way_m;
      way_m += links.step(at, {}).links_W.y();
      if (measured && before_m < 0.5 * end_m && way_m >= 0.5 * end_m) half_at_s = 1e-3 * k;
    }
    end_m = way_m;
  }
  EXPECT_NEAR(half_at_s, 1.05, 2e-3);
  models::JointVector there = its.arm.start_rad();
  there[0] += 0.01;
  const double motors_m =
      its.arm.tool_pose(there).translation().y() - its.arm.tool_pose(its.arm.start_rad()).translation().y();
  EXPECT_NEAR(end_m, motors_m, 1e-4 * motors_m);
}

TEST(LinkMotion, OutlivesWhatIsNotFinite) {
  const DefaultArm its;
  LinkMotion links(its.arm, its.config(), 1e-3);
  JointVector bad = its.arm.start_rad();
  bad[2] = std::nan("");
  EXPECT_EQ(links.step(bad, {}).links_W, models::Twist::Zero());
  EXPECT_EQ(links.step(its.arm.start_rad(), {Vec3(INFINITY, 0.0, 0.0), Vec3::Zero()}).links_W, models::Twist::Zero());
  EXPECT_TRUE(links.step(its.arm.start_rad(), {Vec3(1.0, 0.0, 0.0), Vec3::Zero()}).links_W.allFinite());
}

}  // namespace
}  // namespace proxarm::controller
