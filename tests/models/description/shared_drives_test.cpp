// drive_defaults and simulation_defaults: what a cell says once for all drives is as if each drive said it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/drive.hpp"
#include "models/files/yaml_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::description {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A cell of two axes in which all that two drives can share is shared; `drives` in the place of its drives.
std::string text_of(const std::string& defaults, const std::string& drives) {
  return "urdf: " + source_file("models/arms/bench.urdf").string() +
         "\ntool: {mass_kg: 0, centre_of_mass_S_m: [0, 0, 0], handle_S: {}}\nbuses: [{name: can}]\n" + defaults +
         "drives:\n" + drives +
         "start_rad: [0, 0]\nsensor: {description: " + source_file("models/sensors/ati_net_can_oem.yaml").string() +
         ", bus: can, base_id: 18, link: flange, sample_rate_Hz: 7000}\n";
}

constexpr const char* drive_keys =
    "drive_defaults:\n"                   // line 4
    "  bus: can\n"                        // 5
    "  range_rad: [-1, 1]\n"              // 6
    "  max_speed_rad_per_s: 2\n"          // 7
    "  max_acceleration_rad_per_s2: 9\n"  // 8
    "  rotor_inertia_kg_m2: 3\n";         // 9
constexpr const char* simulation_keys =
    "simulation_defaults:\n"          // 10
    "  max_torque_Nm: 50\n"           // 11
    "  position_gain_per_s: 300\n"    // 12
    "  velocity_bandwidth_Hz: 90\n";  // 13
constexpr const char* two_drives =
    "  - {joint: shoulder, node: 1}\n"  // 15
    "  - {joint: elbow, node: 2}\n";    // 16

Cell read(const std::string& text) { return read_cell(YamlNode::parse(text, "cell.yaml")); }

std::string told(const std::string& text) {
  try {
    read(text);
  } catch (const SetupError& error) {
    return error.what();
  }
  return "no error";
}

std::string both() { return std::string(drive_keys) + simulation_keys; }

// `from` once in the text of both maps of defaults, in the place of which stands `to`.
std::string with(const std::string& from, const std::string& to, const std::string& drives = two_drives) {
  std::string text = text_of(both(), drives);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(SharedDrives, TheShippedCobotIsWhatItsLongFormIsFieldByField) {
  Cell in_full = load_cell(source_file("tests/models/description/data/cobot_in_full.yaml"));
  const Cell cobot = load_cell(source_file("models/cells/cobot.yaml"));
  ASSERT_EQ(in_full.drives.size(), 6U);
  in_full.file = in_full.sensor.choices.file = cobot.file;
  ASSERT_EQ(cobot.drives.size(), in_full.drives.size());
  for (std::size_t i = 0; i < cobot.drives.size(); ++i) {
    EXPECT_TRUE(cobot.drives[i].simulation == in_full.drives[i].simulation) << i;
    EXPECT_TRUE(cobot.drives[i] == in_full.drives[i]) << i;
  }
  EXPECT_TRUE(cobot.tool == in_full.tool);
  EXPECT_TRUE(cobot.buses == in_full.buses);
  EXPECT_TRUE(cobot.sensor == in_full.sensor);
  EXPECT_TRUE(cobot.limits == in_full.limits);
  EXPECT_TRUE(cobot == in_full);
  in_full.drives[5].simulation.servo_rate_Hz += 1.0;
  EXPECT_FALSE(cobot == in_full) << "the comparison sees a single number";
}

TEST(SharedDrives, ADriveHasWhatItDoesNotSayItself) {
  const Cell cell = read(text_of(both(),
                                 "  - {joint: shoulder, node: 1, rotor_inertia_kg_m2: 5}\n"
                                 "  - {joint: elbow, node: 2, simulation: {max_torque_Nm: 7}}\n"));
  EXPECT_EQ(cell.drives[0].rotor_inertia_kg_m2, 5.0);
  EXPECT_EQ(cell.drives[1].rotor_inertia_kg_m2, 3.0);
  EXPECT_EQ(cell.drives[0].simulation.max_torque_Nm, 50.0);
  EXPECT_EQ(cell.drives[1].simulation.max_torque_Nm, 7.0);
  EXPECT_EQ(cell.drives[1].simulation.position_gain_per_s, 300.0);
  EXPECT_EQ(cell.drives[1].range_rad, (std::array<double, 2>{-1.0, 1.0}));
}

TEST(SharedDrives, MapsAreMergedKeyByKeyAndListsStandAsAWhole) {
  const Cell cell = read(text_of(
      both(), "  - {joint: shoulder, node: 1, bring_up: {answer_timeout_s: 1}}\n  - {joint: elbow, node: 2}\n"));
  EXPECT_EQ(cell.drives[0].bring_up.answer_timeout_s, 1.0);
  const Cell merged =
      read(with("  bus: can\n", "  bus: can\n  bring_up: {start_timeout_s: 4, skip: [{object: \"0x1029\"}]}\n",
                "  - {joint: shoulder, node: 1, bring_up: {answer_timeout_s: 1}}\n"
                "  - {joint: elbow, node: 2, bring_up: {skip: [{object: \"0x2000\"}]}}\n"));
  EXPECT_EQ(merged.drives[0].bring_up.answer_timeout_s, 1.0);
  EXPECT_EQ(merged.drives[0].bring_up.start_timeout_s, 4.0);
  EXPECT_EQ(merged.drives[0].bring_up.skip, (std::vector<std::uint32_t>{0x102900}));
  EXPECT_EQ(merged.drives[1].bring_up.start_timeout_s, 4.0);
  EXPECT_EQ(merged.drives[1].bring_up.skip, (std::vector<std::uint32_t>{0x200000}));
}

TEST(SharedDrives, AnUnknownKeyIsToldWhereItStands) {
  EXPECT_EQ(told(with("  bus: can\n", "  bus: can\n  gear_ration: 5\n")),
            "cell.yaml:6: drive_defaults.gear_ration: unknown key; did you mean \"gear_ratio\"?");
  EXPECT_EQ(told(with("  position_gain_per_s: 300\n", "  position_gain_per_s: 300\n  servo_rat_Hz: 5\n")),
            "cell.yaml:13: simulation_defaults.servo_rat_Hz: unknown key; did you mean \"servo_rate_Hz\"?");
  EXPECT_THAT(told(with("node: 1}", "node: 1, gear_ration: 5}")),
              HasSubstr("cell.yaml:15: drives[0].gear_ration: unknown key; did you mean \"gear_ratio\"?"));
  EXPECT_THAT(told(with("drive_defaults:", "drives_default:")), HasSubstr("drives[0].bus: found nothing"));
  EXPECT_EQ(told(with("  bus: can\n", "  bus: can\n  bring_up: {enable_timeout: 5}\n")),
            "cell.yaml:6: drive_defaults.bring_up.enable_timeout: unknown key; did you mean \"enable_timeout_s\"?");
}

TEST(SharedDrives, AKeyOfTheOtherMapIsToldWhereItBelongs) {
  EXPECT_EQ(told(with("  bus: can\n", "  bus: can\n  servo_rate_Hz: 4000\n")),
            "cell.yaml:6: drive_defaults.servo_rate_Hz: unknown key; did you mean it in simulation_defaults?");
  EXPECT_EQ(told(with("  max_torque_Nm: 50\n", "  max_torque_Nm: 50\n  gear_ratio: 100\n")),
            "cell.yaml:12: simulation_defaults.gear_ratio: unknown key; did you mean it in drive_defaults?");
  EXPECT_EQ(told(with("node: 1}", "node: 1, servo_rate_Hz: 4000}")),
            "cell.yaml:15: drives[0].servo_rate_Hz: unknown key; did you mean it in drives[0].simulation?");
}

TEST(SharedDrives, AMistakeIsToldWhereTheValueWasWrittenAndForWhichDrive) {
  EXPECT_EQ(told(with("rotor_inertia_kg_m2: 3", "rotor_inertia_kg_m2: -3")),
            "cell.yaml:9: drive_defaults.rotor_inertia_kg_m2: found -3, expected a number from 0 to 100000 kg m²; "
            "drives[0] has it from there");
  EXPECT_THAT(told(with("node: 2}", "node: 2, rotor_inertia_kg_m2: -3}")),
              AllOf(HasSubstr("cell.yaml:16: drives[1].rotor_inertia_kg_m2: found -3"), Not(HasSubstr("from there"))));
  EXPECT_THAT(told(with("position_gain_per_s: 300", "position_gain_per_s: fast")),
              HasSubstr("cell.yaml:12: simulation_defaults.position_gain_per_s: found \"fast\""));
  // What is right for the first drive and wrong for the second.
  EXPECT_THAT(
      told(with("node: 2}", "node: 2, gear_ratio: 100000}")),
      AllOf(HasSubstr("cell.yaml:6: drive_defaults.range_rad: found"), HasSubstr("drives[1] has it from there")));
  EXPECT_THAT(
      told(with("  bus: can\n", "  bus: cam\n")),
      HasSubstr("cell.yaml:5: drive_defaults.bus: found \"cam\", expected a bus of this cell: can; did you mean "
                "\"can\"?; drives[0] has it from there"));
}

TEST(SharedDrives, WhatIsNowhereIsMissingInTheDrive) {
  EXPECT_THAT(told(with("  rotor_inertia_kg_m2: 3\n", "")),
              HasSubstr("cell.yaml:14: drives[0].rotor_inertia_kg_m2: found nothing, nor in drive_defaults, expected"));
  EXPECT_THAT(
      told(with("  rotor_inertia_kg_m2: 3", "  rotor_inertia_kgm2: 3")),
      HasSubstr("drives[0].rotor_inertia_kg_m2: found nothing, nor in drive_defaults, expected a number from 0 to "
                "100000 kg m²; is \"rotor_inertia_kgm2\" in line 9 meant to be it?"));
  EXPECT_THAT(told(with("  max_torque_Nm: 50\n", "")),
              HasSubstr("cell.yaml:14: drives[0].simulation.max_torque_Nm: found nothing, nor in simulation_defaults"));
  EXPECT_THAT(told(text_of(drive_keys, two_drives)), HasSubstr("cell.yaml:11: drives[0].simulation: found nothing"));
}

TEST(SharedDrives, WhatEachDriveMustHaveItselfIsRefusedThere) {
  EXPECT_THAT(
      told(with("  bus: can\n", "  joint: elbow\n")),
      HasSubstr("cell.yaml:5: drive_defaults.joint: found \"elbow\", expected no `joint`: each drive has its own"));
  EXPECT_THAT(told(with("  bus: can\n", "  simulation: {max_torque_Nm: 5}\n")),
              AllOf(HasSubstr("cell.yaml:5: drive_defaults.simulation: found a map, expected no `simulation`"),
                    HasSubstr("simulation_defaults")));
  EXPECT_THAT(told(with("drive_defaults:\n", "drive_defaults: 5\nx:\n")),
              HasSubstr("cell.yaml:4: drive_defaults: found 5, expected a map (key: value)"));
}

// A cell of a rail on Modbus and an arm on CAN: `fd` says nothing to the rail's drive.
TEST(SharedDrives, AKeyThatOnlySomeOfTheDrivesCanHaveHoldsForThose) {
  std::ifstream in(source_file("models/cells/rail.yaml"));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.insert(text.find("drives:\n"),
              "drive_defaults: {device_type: 0x00020193, feedback: [{object: \"0x6061\", bits: 8}]}\n");
  const Cell cell = read_cell(YamlNode::parse(text, source_file("models/cells/rail.yaml")));
  EXPECT_TRUE(cell.drives[0].feedback.empty());
  EXPECT_EQ(cell.drives[1].feedback.size(), 1U);
  EXPECT_EQ(cell.drives[1].device_type, 0x00020192U) << "its own";
}

}  // namespace
}  // namespace proxarm::description
