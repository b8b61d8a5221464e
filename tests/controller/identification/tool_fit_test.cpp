// The fit against readings that are computed here, of tools, zeros and mistakes that are known.
#include "controller/extras/identification/tool_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace proxarm::identification {
namespace {

using models::Mat3;
using models::Vec3;

const Vec3 gravity_W(0.0, 0.0, -9.80665);
constexpr double half_degree = 0.5 * M_PI / 180.0;

struct Tool {
  double mass_kg = 3.2;
  Vec3 centre_S_m = Vec3(0.02, -0.05, 0.12);
  Vec3 zero_N = Vec3(4.0, -2.5, 11.0), zero_Nm = Vec3(0.2, -0.1, 0.05);
  Vec3 drift_N = Vec3::Zero();      // from the first pose to the last
  Mat3 mounted = Mat3::Identity();  // the sensor, against what its reader takes it for
};

Mat3 turned(const Vec3& by) {
  const double angle = by.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, by / angle).toRotationMatrix() : Mat3::Identity();
}

// Tilts about x and y of up to a radian, there and back.
std::vector<Mat3> poses() {
  std::vector<Mat3> all;
  const std::vector<std::pair<double, double>> tilts{{0, 0},     {0.9, 0},  {0.9, 0.9},  {0, 0.9},    {-0.9, 0.5},
                                                     {-0.5, -1}, {0.3, -1}, {0.6, -0.4}, {1.2, -0.1}, {0, 0}};
  for (const auto& [x, y] : tilts) all.push_back(turned(Vec3(x, 0.0, 0.0)) * turned(Vec3(0.0, y, 0.0)));
  return all;
}

std::vector<PoseReading> read(const Tool& tool, const std::vector<Mat3>& R_SW, double noise_N) {
  std::vector<PoseReading> readings;
  for (std::size_t k = 0; k < R_SW.size(); ++k) {
    const double s = static_cast<double>(k) / static_cast<double>(R_SW.size() - 1) - 1.0;
    const Vec3 weight_S = tool.mass_kg * (tool.mounted * R_SW[k] * gravity_W);
    PoseReading reading;
    reading.R_SW = R_SW[k];
    reading.mean_S = {tool.zero_N + s * tool.drift_N + weight_S, tool.zero_Nm + tool.centre_S_m.cross(weight_S)};
    reading.noise_N = noise_N;
    reading.noise_Nm = 0.05 * noise_N;
    reading.time_s = 7.0 * static_cast<double>(k);
    readings.push_back(reading);
  }
  return readings;
}

ToolFit fit(const std::vector<PoseReading>& readings, double drift_N = 3.0) {
  return fit_tool(readings, gravity_W, {half_degree, drift_N});
}

void expect_found(const ToolFit& found, const Tool& tool, double mass_kg, double centre_m, double zero_N) {
  ASSERT_TRUE(found.mass_found && found.centre_found);
  EXPECT_NEAR(found.mass_kg, tool.mass_kg, mass_kg);
  EXPECT_LT((found.centre_S_m - tool.centre_S_m).norm(), centre_m);
  EXPECT_LT((found.zero_S.force - tool.zero_N).norm(), zero_N);
  EXPECT_LT((found.zero_S.torque - tool.zero_Nm).norm(), zero_N);
}

TEST(ToolFit, ExactReadingsGiveExactResults) {
  const Tool tool;
  const ToolFit found = fit(read(tool, poses(), 1e-6));
  expect_found(found, tool, 1e-9, 1e-9, 1e-8);
  EXPECT_LT(found.mass_half_kg, 1e-5);
  EXPECT_TRUE(found.force.explained_all() && found.torque.explained_all());
}

TEST(ToolFit, ADriftThatIsEvenIsTakenForDrift) {
  Tool tool;
  tool.drift_N = Vec3(0.8, -2.0, 1.5);
  const ToolFit found = fit(read(tool, poses(), 1e-3));
  expect_found(found, tool, 1e-4, 1e-5, 1e-3);
  EXPECT_TRUE(found.force.explained_all());
}

// The angle is fitted, a little less than it is, since none is expected.
TEST(ToolFit, ASensorThatIsMountedHalfADegreeOffHardlyChangesTheResult) {
  Tool tool;
  tool.mounted = turned(half_degree * Vec3(0.6, -0.64, 0.48));
  const ToolFit found = fit(read(tool, poses(), 2e-3));
  expect_found(found, tool, 1e-3, 1e-4, 5e-2);
  EXPECT_NEAR(found.turned_rad, half_degree, 0.2 * half_degree);
  EXPECT_TRUE(found.force.explained_all());
}

TEST(ToolFit, TheStatedIntervalIsTrueInAtLeast93Of100) {
  std::mt19937 engine(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto vector = [&] { return Vec3(normal(engine), normal(engine), normal(engine)); };
  int mass = 0, centre = 0, zero = 0;
  constexpr int runs = 300;
  for (int n = 0; n < runs; ++n) {
    Tool tool;
    tool.mass_kg = std::exp(std::uniform_real_distribution<double>(std::log(0.1), std::log(8.0))(engine));
    tool.centre_S_m = 0.08 * vector();
    tool.drift_N = vector();
    tool.mounted = turned(half_degree * vector());
    std::vector<PoseReading> readings = read(tool, poses(), 0.01);
    for (PoseReading& reading : readings) {
      reading.mean_S.force += reading.noise_N * vector();
      reading.mean_S.torque += reading.noise_Nm * vector();
    }
    const ToolFit found = fit(readings, 1.0);
    mass += std::abs(found.mass_kg - tool.mass_kg) <= found.mass_half_kg ? 1 : 0;
    for (int i = 0; i < 3; ++i) {
      centre += std::abs(found.centre_S_m[i] - tool.centre_S_m[i]) <= found.centre_half_m[i] ? 1 : 0;
      zero += std::abs(found.zero_S.force[i] - tool.zero_N[i]) <= found.zero_half_S.force[i] ? 1 : 0;
    }
  }
  // 95 of 100, less two standard deviations of a count of 300 for the mass.
  EXPECT_GE(mass, 0.925 * runs);
  EXPECT_GE(centre, 0.93 * 3 * runs);
  EXPECT_GE(zero, 0.93 * 3 * runs);
}

TEST(ToolFit, PosesThatNeverTiltTheSensorShowNothing) {
  const std::vector<Mat3> about_vertical{turned(Vec3(0, 0, 0)), turned(Vec3(0, 0, 1)), turned(Vec3(0, 0, 2)),
                                         turned(Vec3(0, 0, -1))};
  const ToolFit found = fit(read(Tool{}, about_vertical, 1e-3));
  EXPECT_FALSE(found.mass_found);
  EXPECT_FALSE(found.centre_found);
  EXPECT_TRUE(std::isfinite(found.mass_kg) && found.centre_S_m.allFinite());
}

TEST(ToolFit, TooFewReadingsShowNothing) {
  EXPECT_FALSE(fit({}).mass_found);
  EXPECT_FALSE(fit(read(Tool{}, {turned(Vec3(0, 0, 0)), turned(Vec3(1, 0, 0))}, 1e-3)).mass_found);
}

TEST(ToolFit, AShortArcShowsTheMassButNotTheCentre) {
  std::vector<Mat3> arc;
  for (int n = -3; n <= 3; ++n) arc.push_back(turned(Vec3(0.05 * n, 0.0, 0.0)));
  const ToolFit found = fit(read(Tool{}, arc, 1e-3));
  EXPECT_TRUE(found.mass_found);
  EXPECT_FALSE(found.centre_found);
  EXPECT_NEAR(found.mass_kg, Tool{}.mass_kg, found.mass_half_kg);
}

TEST(ToolFit, AnArmThatTiltsInOnePlaneShowsAll) {
  std::vector<Mat3> plane;
  for (const double angle : {0.0, 0.5, 1.0, 1.6, 0.8, -0.4, -1.0, 0.0}) plane.push_back(turned(Vec3(0.0, angle, 0.0)));
  expect_found(fit(read(Tool{}, plane, 1e-5)), Tool{}, 1e-4, 1e-5, 1e-3);
}

TEST(ToolFit, NothingThatHangsThereIsAMassOfZero) {
  Tool none;
  none.mass_kg = 0.0;
  const ToolFit found = fit(read(none, poses(), 1e-3));
  EXPECT_NEAR(found.mass_kg, 0.0, 1e-6);
  EXPECT_TRUE(std::isfinite(found.mass_half_kg) && found.centre_half_m.allFinite());
  EXPECT_GT(found.centre_half_m.minCoeff(), 1.0);
}

TEST(ToolFit, AHandInSomePosesIsNotExplained) {
  std::vector<PoseReading> readings = read(Tool{}, poses(), 2e-3);
  for (PoseReading& reading : readings) reading.tilt_rad = 2e-3;
  for (const std::size_t k : {2u, 5u, 6u}) readings[k].mean_S.force += Vec3(0.0, 2.0, 0.0);
  const ToolFit pushed = fit(readings);
  EXPECT_FALSE(pushed.force.explained_all());
  EXPECT_GT(pushed.force.worst, pushed.force.explained);
}

}  // namespace
}  // namespace proxarm::identification
