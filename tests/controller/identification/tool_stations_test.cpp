#include "controller/extras/identification/tool_stations.hpp"

#include <gtest/gtest.h>

#include "controller/extras/identification/identification.hpp"
#include "models/base/setup_error.hpp"
#include "tests/source_file.hpp"

namespace proxarm::identification {
namespace {

using description::Cell;
using models::JointVector;
using models::Vec3;
using proof::Station;

Cell cell_of(const std::string& name) { return description::load_cell(source_file("models/cells/" + name + ".yaml")); }

std::vector<Station> stations_of(const Cell& cell, const models::Arm& arm) {
  return tool_stations(cell, arm, arm.motor_from_link(arm.start_rad()));
}

TEST(ToolStations, TurnTheWeightFarEnoughInAllCellsThatCan) {
  for (const char* name : {"default", "cobot", "seven", "bench"}) {
    const Cell cell = cell_of(name);
    const models::Arm arm(cell);
    const std::vector<Station> stations = stations_of(cell, arm);
    EXPECT_GE(stations.size(), 7u) << name;
    EXPECT_EQ(stations.front().motor_rad, stations.back().motor_rad) << name;
    EXPECT_EQ(not_shown(cell, arm, stations, allowances_of(3.0)), "") << name;
  }
}

TEST(ToolStations, OfArmsThatCantTiltTheSensorSayThatNothingIsIdentifiable) {
  for (const char* name : {"scara", "gantry", "linear"}) {
    const Cell cell = cell_of(name);
    const models::Arm arm(cell);
    const std::vector<Station> stations = stations_of(cell, arm);
    EXPECT_EQ(stations.size(), 1u) << name;
    EXPECT_NE(not_shown(cell, arm, stations, allowances_of(3.0)).find("no joint of the wrist tilts"), std::string::npos)
        << name;
  }
}

TEST(ToolStations, StayNearTheStartAndWithinRangesAndBorders) {
  Cell cell = cell_of("default");
  const models::Arm free_arm(cell);
  const Vec3 start_W = free_arm.tool_pose(free_arm.start_rad()).translation();
  // A border 50 mm to each side of the start, and 0.1 rad of the last joint's range.
  for (std::size_t i = 0; i < 3; ++i) {
    cell.limits.workspace_min_m[i] = start_W[static_cast<Eigen::Index>(i)] - 0.05;
    cell.limits.workspace_max_m[i] = start_W[static_cast<Eigen::Index>(i)] + 0.05;
  }
  cell.drives[5].range_rad[1] = cell.start_rad[5] + 0.1;
  const models::Arm arm(cell);
  const JointVector start = arm.motor_from_link(arm.start_rad());
  const std::vector<Station> stations = tool_stations(cell, arm, start);
  EXPECT_GE(stations.size(), 7u);
  for (std::size_t k = 0; k < stations.size(); ++k) {
    const JointVector& q = stations[k].motor_rad;
    EXPECT_LE((q - start).cwiseAbs().maxCoeff(), most_turn_rad + 1e-12);
    EXPECT_LE(q[5], cell.drives[5].range_rad[1]);
    EXPECT_EQ((q - start).head<3>().norm(), 0.0) << "the wrist alone moves";
    const JointVector& from = stations[k > 0 ? k - 1 : 0].motor_rad;
    for (const double share : {0.0, 0.21, 0.5, 0.83, 1.0}) {
      const Vec3 place_W = arm.tool_pose(arm.link_from_motor(from + share * (q - from))).translation();
      EXPECT_LE((place_W - start_W).cwiseAbs().maxCoeff(), 0.05 + 1e-4);
    }
  }
}

TEST(ToolStations, AStartWithoutRoomIsRefused) {
  Cell cell = cell_of("default");
  const models::Arm arm(cell);
  const Vec3 start_W = arm.tool_pose(arm.start_rad()).translation();
  for (std::size_t i = 0; i < 3; ++i) {
    cell.limits.workspace_min_m[i] = start_W[static_cast<Eigen::Index>(i)] - 1e-3;
    cell.limits.workspace_max_m[i] = start_W[static_cast<Eigen::Index>(i)] + 1e-3;
  }
  // The last joint alone turns the tool in its place, by four other poses of the grid.
  EXPECT_THROW(stations_of(cell, arm), description::SetupError);
}

// The gears twist with the tool that is there, not with the cell's.
TEST(Identification, ATenfoldToolOnSoftGearsIsFoundExactly) {
  Cell cell = cell_of("default"), real = cell;
  real.tool.mass_kg = 8.0;
  real.tool.centre_of_mass_S_m = {0.1, -0.05, 0.15};
  const models::Arm arm(cell), real_arm(real);
  const Vec3 gravity_W(cell.gravity_W_m_per_s2.data()), centre_S(real.tool.centre_of_mass_S_m.data());
  std::vector<proof::Reading> readings;
  for (const Station& station : stations_of(cell, arm)) {
    const JointVector q = real_arm.link_from_motor(station.motor_rad);
    const Vec3 weight_S = 8.0 * (real_arm.sensor_pose(q).linear().transpose() * gravity_W);
    proof::Reading reading{station, station.motor_rad, weight_S};
    reading.torque_S = centre_S.cross(weight_S);
    reading.samples = 500;
    reading.lasted_s = 0.5;
    reading.time_s = 5.0 * static_cast<double>(readings.size());
    readings.push_back(reading);
  }
  const ToolFit fit = identify_tool(cell, readings, allowances_of(3.0));
  EXPECT_NEAR(fit.mass_kg, 8.0, 1e-5);
  EXPECT_LT((fit.centre_S_m - centre_S).norm(), 1e-6);
  EXPECT_EQ(doubts(fit, allowances_of(3.0)), "");
}

}  // namespace
}  // namespace proxarm::identification
