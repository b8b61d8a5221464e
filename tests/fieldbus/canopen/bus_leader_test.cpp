// Whether somebody leads a bus, told by what is heard there. Identifiers from CiA 301's predefined connection set.
#include "fieldbus/canopen/bus_leader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models/base/setup_error.hpp"
#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t ms = 1'000'000;
const std::vector<BusToLead> nodes_1_and_2{{.bus = 0, .nodes = {1, 2}, .master_node = 127}};

// What the refusal says; empty: nobody leads.
std::string refusal(const std::vector<std::string>& heard, const std::vector<BusToLead>& buses = nodes_1_and_2) {
  ScriptedNetwork network;
  for (const std::string& frame : heard) network.bus(0).arrive(frame, 250 * ms);
  std::string text;
  try {
    require_nobody_leads(network, buses);
  } catch (const description::SetupError& error) {
    text = error.what();
  }
  EXPECT_TRUE(network.bus(0).sent.empty());
  return text;
}

TEST(BusLeader, ShowsByWhatOnlyALeaderSends) {
  EXPECT_THAT(refusal({"080#"}), HasSubstr("found SYNC (0x080), 1 time"));
  EXPECT_THAT(refusal({"000#0101", "000#0102"}), HasSubstr("found NMT commands (0x000), 2 times"));
  EXPECT_THAT(refusal({"202#0F0000000000"}), HasSubstr("found setpoints (0x202)"));
  EXPECT_THAT(refusal({"501#00"}), HasSubstr("found setpoints (0x501)"));
  EXPECT_THAT(refusal({"601#4000100000000000"}), HasSubstr("found SDO requests (0x601)"));
  EXPECT_THAT(refusal({"77F#05"}), HasSubstr("found a controller's heartbeat (0x77F)"));
  EXPECT_THAT(refusal({"080#"}), HasSubstr("bus vcan0"));
}

TEST(BusLeader, IsNotTakenForADriveASensorOrSomebodyElsesNodes) {
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(refusal({"181#400200000000", "081#3081110000000000", "581#4300100092010200", "701#7F", "702#00"}), "");
  EXPECT_EQ(refusal({"203#00", "120#0000", "680#", "604#4000100000000000"}), "");
}

TEST(BusLeader, ShowsBySyncAndNmtAloneWhereNoNodesAreKnown) {
  const std::vector<BusToLead> unknown{{.bus = 0}};
  EXPECT_THAT(refusal({"080#"}, unknown), HasSubstr("SYNC"));
  EXPECT_EQ(refusal({"201#00", "77F#05", "601#4000100000000000"}, unknown), "");
}

TEST(BusLeader, IsHeardOnTheBusThatItLeadsAloneAndForTheWholeTime) {
  ScriptedNetwork network({"vcan0", "vcan1"});
  network.bus(1).arrive("080#", 299 * ms);
  const std::int64_t begun_ns = network.now_ns();
  EXPECT_NO_THROW(require_nobody_leads(network, nodes_1_and_2));
  EXPECT_EQ(network.now_ns() - begun_ns, listen_before_speaking_ns);
  const std::vector<BusToLead> both{{.bus = 0, .nodes = {1}}, {.bus = 1, .nodes = {2}}};
  network.bus(1).arrive("080#", 299 * ms);
  EXPECT_THROW(require_nobody_leads(network, both), description::SetupError);
}

}  // namespace
}  // namespace proxarm::fieldbus
