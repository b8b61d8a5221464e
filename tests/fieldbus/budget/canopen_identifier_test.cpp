// Who may use which identifier on a bus.
#include <gtest/gtest.h>

#include "fieldbus/budget/identifier_check.hpp"
#include "fieldbus/cia402/cia402_drive.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

const std::vector<std::string> names = {"vcan0", "vcan1"};

std::vector<UsedIdentifier> drive_and_sensor(std::size_t drive_bus, std::size_t sensor_bus, std::uint32_t base_id) {
  description::DriveDescription description;
  description.joint = "axis_1";
  description.node = 5;
  std::vector<UsedIdentifier> used;
  for (const std::uint32_t id : ServoDrive(description, DriveSettings{}).used_ids()) {
    used.push_back({drive_bus, id, "drive of axis_1"});
  }
  for (const std::uint32_t id : AtiNetCanOem({.bus_name = "sensor", .base_id = base_id}).wanted_ids()) {
    used.push_back({sensor_bus, id, "force sensor"});
  }
  return used;
}

TEST(Identifiers, OfADriveAreThoseOfThePredefinedConnectionSet) {
  description::DriveDescription description;
  description.node = 5;
  EXPECT_EQ(ServoDrive(description, DriveSettings{}).used_ids(),
            (std::array<std::uint32_t, 6>{0x185, 0x085, 0x585, 0x705, 0x205, 0x605}));
}

TEST(Identifiers, MayBeSharedAcrossBusesButNotOnOne) {
  EXPECT_NO_THROW(refuse_shared_identifiers(drive_and_sensor(0, 0, 0x68), names));
  EXPECT_NO_THROW(refuse_shared_identifiers(drive_and_sensor(0, 1, 0x18), names));
  try {
    refuse_shared_identifiers(drive_and_sensor(1, 1, 0x18), names);  // 0x180..0x18F: the TPDO of node 5
    FAIL() << "was taken";
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("bus vcan1: identifier 0x185 would be used twice: found drive of axis_1 and "
                        "force sensor"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
