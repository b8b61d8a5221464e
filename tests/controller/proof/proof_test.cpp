// The judgement of a proof against readings that are computed here from another cell's kinematics: what the arm is, and
// what the controller takes it for, differ by one mistake each.
#include "controller/extras/proof/proof.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "models/base/setup_error.hpp"
#include "tests/source_file.hpp"

namespace proxarm::proof {
namespace {

using description::Cell;
using models::JointVector;
using models::Vec3;

Cell default_cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

// An arm as it is, under a controller that takes it for something else.
struct Mistaken {
  Cell believed = default_cell(), real = default_cell();
  models::Mat3 sensor = models::Mat3::Identity();  // what the real one makes of a force
  double hand_off_rad = 0.0;                       // by which a push misses its direction

  // Where the motors are, from where the controller believes them to be: the counts are the same.
  [[nodiscard]] JointVector real_motors(const JointVector& believed_rad) const {
    JointVector q = believed_rad;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const auto &b = believed.drives[static_cast<std::size_t>(i)], &r = real.drives[static_cast<std::size_t>(i)];
      q[i] = (b.offset_counts + believed_rad[i] * b.counts_per_rad() - r.offset_counts) / r.counts_per_rad();
    }
    return q;
  }
  [[nodiscard]] JointVector believed_start() const {
    const models::Arm arm(real);
    JointVector q = arm.motor_from_link(arm.start_rad());
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const auto &b = believed.drives[static_cast<std::size_t>(i)], &r = real.drives[static_cast<std::size_t>(i)];
      q[i] = (r.offset_counts + q[i] * r.counts_per_rad() - b.offset_counts) / b.counts_per_rad();
    }
    return q;
  }
  [[nodiscard]] Verdict verdict() const {
    const models::Arm arm(believed), real_arm(real);
    std::mt19937 engine(7);
    std::normal_distribution<double> noise(0.0, 0.02);
    const Vec3 bias(3.0, -2.0, 5.0);
    std::vector<Reading> readings;
    for (const Station& station : plan(believed, arm, believed_start())) {
      Vec3 force_W = real.tool.mass_kg * Vec3(real.gravity_W_m_per_s2.data());
      force_W += 15.0 * (Eigen::AngleAxisd(hand_off_rad, Vec3::UnitZ()) * station.push_W);
      const JointVector q = real_arm.link_from_motor(real_motors(station.motor_rad));
      const Vec3 force_S = real_arm.sensor_pose(q).linear().transpose() * force_W;
      readings.push_back(
          {station, station.motor_rad, bias + sensor * force_S + Vec3(noise(engine), noise(engine), noise(engine))});
    }
    return judge(believed, arm, readings);
  }
};

void expect_found(const Mistaken& setup, const std::string& words) {
  const Verdict verdict = setup.verdict();
  EXPECT_FALSE(verdict.proven) << words;
  ASSERT_FALSE(verdict.mistakes.empty()) << words << ": " << text(verdict);
  EXPECT_NE(verdict.mistakes.front().mistake.find(words), std::string::npos) << words << ": " << text(verdict);
}

TEST(Proof, AnArmThatIsAsItsCellSaysIsProven) {
  const Verdict verdict = Mistaken{}.verdict();
  EXPECT_TRUE(verdict.proven) << text(verdict);
  // Noise of 0.02 N an axis against some 0.3 of 2.45 N: 0.05.
  EXPECT_LT(verdict.as_it_is.residual, 0.1);
}

TEST(Proof, AHandThatMissesItsDirectionByFiveDegreesProvesItStill) {
  Mistaken setup;
  for (const double degrees : {-5.0, 5.0}) {
    setup.hand_off_rad = degrees * M_PI / 180.0;
    EXPECT_TRUE(setup.verdict().proven) << degrees << text(setup.verdict());
  }
}

TEST(Proof, FindsEveryJointThatTurnsTheOtherWay) {
  for (std::size_t i = 0; i < 6; ++i) {
    Mistaken setup;
    setup.believed.drives[i].direction *= -1;
    expect_found(setup, setup.believed.drives[i].joint + " turns the other way");
  }
}

TEST(Proof, FindsEveryGearRatioThatIsOffByTwo) {
  for (std::size_t i = 0; i < 6; ++i) {
    Mistaken twice, half;
    twice.believed.drives[i].gear_ratio *= 2.0;
    expect_found(twice, twice.believed.drives[i].joint + " turns twice as far");
    half.believed.drives[i].counts_per_motor_revolution *= 0.5;
    expect_found(half, half.believed.drives[i].joint + " turns half as far");
  }
}

TEST(Proof, FindsASensorThatIsTurnedOrReadsOtherwise) {
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
    Mistaken setup;
    setup.sensor = Eigen::AngleAxisd(M_PI, axis).toRotationMatrix();
    expect_found(setup, "the sensor is turned by 180 degrees");
  }
  Mistaken opposite, twice, half;
  opposite.sensor = -models::Mat3::Identity();
  expect_found(opposite, "opposite sign");
  twice.sensor = 2.0 * models::Mat3::Identity();
  expect_found(twice, "twice the force");
  half.sensor = 0.5 * models::Mat3::Identity();
  expect_found(half, "half the force");
}

TEST(Proof, ALeftHandedSensorIsNotProvenThoughNoSingleMistakeIsIt) {
  Mistaken setup;
  setup.sensor.diagonal() = Vec3(1.0, -1.0, 1.0);
  EXPECT_FALSE(setup.verdict().proven);
}

TEST(Proof, StationsStayNearTheStartAndWithinRanges) {
  const Mistaken setup;
  const models::Arm arm(setup.believed);
  const JointVector start = setup.believed_start();
  const auto stations = plan(setup.believed, arm, start);
  EXPECT_GE(stations.size(), 9u);
  for (const Station& station : stations) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      EXPECT_LE(std::abs(station.motor_rad[i] - start[i]), pose_rad + 2.0 * turn_rad + 1e-12);
      const auto& range = setup.believed.drives[static_cast<std::size_t>(i)].range_rad;
      EXPECT_GE(station.motor_rad[i], range[0]);
      EXPECT_LE(station.motor_rad[i], range[1]);
    }
  }
}

TEST(Proof, ALinearJointAndAToolWithoutWeightAreRefused) {
  const Cell rail = description::load_cell(source_file("models/cells/rail.yaml"));
  const models::Arm arm(rail);
  EXPECT_THROW(plan(rail, arm, arm.start_rad()), description::SetupError);
  Cell light = default_cell();
  light.tool.mass_kg = 0.0;
  const models::Arm other(light);
  EXPECT_THROW(plan(light, other, other.start_rad()), description::SetupError);
}

}  // namespace
}  // namespace proxarm::proof
