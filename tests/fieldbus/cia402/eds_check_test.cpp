// A drive's configuration by its EDS: what is left out, asked for or set, and what is refused before anything is sent.
#include "fieldbus/cia402/eds_check.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fieldbus/cia402/cia402_drive.hpp"
#include "models/base/setup_error.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path shipped = source_file("models/drives/simulated_drive.eds");

std::string shipped_text() {
  std::ifstream in(shipped);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

description::DriveDescription a_drive() {
  description::DriveDescription drive;
  drive.joint = "axis_2";
  drive.bus = "axes";
  drive.node = 2;
  drive.range_rad = {-1.0, 1.0};
  drive.max_acceleration_rad_per_s2 = 20.0;
  return drive;
}

// The profile's steps, by the shipped EDS with one thing changed.
std::vector<SdoStep> steps_with(const std::string& from, const std::string& to,
                                const description::DriveDescription& drive = a_drive()) {
  std::string text = shipped_text();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  // Their names point into it.
  static std::vector<std::unique_ptr<description::EdsFile>> kept;
  kept.push_back(std::make_unique<description::EdsFile>(description::parse_eds(text, "own.eds")));
  return steps_by_eds(ServoDrive(drive, DriveSettings{}).configuration_steps(), *kept.back(), drive);
}

std::string refusal(const std::string& from, const std::string& to) {
  try {
    (void)steps_with(from, to);
  } catch (const description::SetupError& error) {
    return error.what();
  }
  return "taken";
}

const SdoStep* find(const std::vector<SdoStep>& steps, ObjectAddress object) {
  const auto found =
      std::find_if(steps.begin(), steps.end(), [&](const SdoStep& step) { return step.object == object; });
  return found == steps.end() ? nullptr : &*found;
}

std::string without(const std::string& section) {  // nobody looks for such an index
  return "[9" + section.substr(2);
}

TEST(EdsCheck, AsksForTheIdentityThatTheFileStates) {
  const auto steps = steps_with("VendorNumber=0x00000000", "VendorNumber=0x000000AB");
  ASSERT_NE(find(steps, {0x1018, 1}), nullptr);
  EXPECT_EQ(find(steps, {0x1018, 1})->kind, SdoStep::Kind::expect);
  EXPECT_EQ(find(steps, {0x1018, 1})->value, 0xABu);
  EXPECT_EQ(find(steps, {0x1018, 3})->kind, SdoStep::Kind::expect);
  EXPECT_EQ(find(steps, {0x1018, 3})->value, 0x00010000u);
  EXPECT_EQ(find(steps, {0x1018, 3})->mask, 0xFFFF0000u) << "firmware changes";
  const auto stateless = steps_with("RevisionNumber=0x00010000", "RevisionNumber=0x00000005");
  EXPECT_EQ(find(stateless, {0x1018, 3})->kind, SdoStep::Kind::read);
}

TEST(EdsCheck, LeavesOutOptionalObjectsThatTheDriveHasNot) {
  ASSERT_NE(find(steps_with("RevisionNumber", "RevisionNumber"), {0x1006, 0}), nullptr);
  EXPECT_EQ(find(steps_with("[1006]", without("[1006]")), {0x1006, 0}), nullptr);
}

TEST(EdsCheck, SetsWhatADcfSetsOfTheDevice) {
  const auto steps = steps_with("DefaultValue=3\nPDOMapping=0", "ParameterValue=5\nPDOMapping=0");
  ASSERT_NE(find(steps, {0x2010, 1}), nullptr);
  EXPECT_EQ(find(steps, {0x2010, 1})->value, 5u);
  EXPECT_EQ(steps.back().name, std::string("SYNCs that may be missing"));
}

TEST(EdsCheck, RefusesADriveThatCantBeLed) {
  EXPECT_THAT(refusal("[6060]", without("[6060]")),
              HasSubstr("own.eds: [6060]: found no such object, expected modes of"));
  EXPECT_THAT(refusal("DefaultValue=0x000002C0", "DefaultValue=0x40"),
              HasSubstr("[6502] DefaultValue: found 0x00000040, expected 0x00000080 (supported drive modes); the drive "
                        "can't do cyclic synchronous position"));
  EXPECT_THAT(refusal("DefaultValue=0x00020192", "DefaultValue=0x00030191"), HasSubstr("own.eds:20: [1000]"));
  EXPECT_THAT(refusal("ParameterName=Target position\nObjectType=0x7\nDataType=0x0004\nAccessType=rw\nDefaultValue=0\n"
                      "PDOMapping=1",
                      "ParameterName=Target position\nDataType=0x0004\nAccessType=rw\nPDOMapping=0"),
              HasSubstr("[607A] PDOMapping: found 0, expected 1"));
  EXPECT_THAT(refusal("ParameterName=Target position\nObjectType=0x7\nDataType=0x0004",
                      "ParameterName=Target position\nObjectType=0x7\nDataType=0x0003"),
              HasSubstr("[607A] DataType: found 16 bits, expected 32 bits"));
  EXPECT_THAT(refusal("ParameterName=Modes of operation\nObjectType=0x7\nDataType=0x0002\nAccessType=rw",
                      "ParameterName=Modes of operation\nObjectType=0x7\nDataType=0x0002\nAccessType=ro"),
              HasSubstr("[6060] DefaultValue: found 0x00, which can't be written, expected 0x08"));
  EXPECT_THAT(refusal("ParameterName=Modes of operation\nObjectType=0x7\nDataType=0x0002\nAccessType=rw",
                      "ParameterName=Modes of operation\nObjectType=0x7\nDataType=0x0002\nAccessType=some"),
              AllOf(HasSubstr("[6060] AccessType: found \"some\""), HasSubstr("wanted: modes of operation")));
  EXPECT_EQ(refusal("[DeviceInfo]", "[2FFF]\nParameterName=x\nDataType=7\nAccessType=some\n[DeviceInfo]"), "taken")
      << "nobody asks for it";
  EXPECT_THAT(refusal("[DeviceInfo]", "[DeviceComissioning]\nNodeID=5\n[DeviceInfo]"),
              HasSubstr("NodeID: found 5, expected 2, the node of axis_2"));
}

TEST(EdsCheck, IsMadeWhenADriveIsMade) {
  description::DriveDescription drive = a_drive();
  drive.eds = shipped;
  EXPECT_NO_THROW(ServoDrive(drive, DriveSettings{}));
  drive.objects.target = 0x230104;
  EXPECT_THROW(ServoDrive(drive, DriveSettings{}), description::SetupError) << "the drive has no such object";
  drive.objects.target = 0x60C101;
  EXPECT_NO_THROW(ServoDrive(drive, DriveSettings{}));
}

}  // namespace
}  // namespace proxarm::fieldbus
