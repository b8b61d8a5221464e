// A simulated CiA 402 drive, brought up and moved by a master typed by hand.
#include "sim/devices/drive_device.hpp"

#include <initializer_list>
#include <random>

#include "tests/sim/devices/device_harness.hpp"

namespace proxarm::sim {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::ms;

struct DriveDeviceTest : ::testing::Test {
  DriveDeviceTest() {
    axis.position = 1000.0;
    drive.power_on(0);
    pass(30);
    port.take();
  }
  static DriveDeviceConfig config() {
    DriveDeviceConfig c;
    c.canopen = {.node = 1, .device_type = 0x00020192, .device_name = "drive"};
    c.following_error_window_counts = 500;
    c.following_error_time_ms = 5;
    c.quick_stop_deceleration = 1'000'000;
    c.brake_release_ns = 5 * ms;
    return c;
  }
  // Time in steps of 0.25 ms, without any frame.
  void pass(std::int64_t duration_ms) {
    for (std::int64_t i = 0; i < 4 * duration_ms; ++i) {
      now_ns += ms / 4;
      axis.move(now_ns);
      drive.on_time(now_ns);
    }
  }
  std::vector<std::string> ask(const std::string& text) {
    drive.on_frame(testing::from_text(text), now_ns);
    return port.take();
  }
  // Downloads that are all taken, then operational.
  void configure(std::initializer_list<const char*> requests) {
    for (const char* request : requests) {
      const auto answers = ask(request);
      ASSERT_EQ(answers.size(), 1u);
      ASSERT_EQ(answers[0].substr(0, 6), "581#60") << request << " answered " << answers[0];
    }
    ask("000#0101");
  }
  void configure() {
    configure({"601#2300140101020080", "601#2F00160000000000", "601#2300160110004060", "601#2300160220007A60",
               "601#2F00160002000000", "601#2F00140201000000", "601#2300140101020000", "601#2300180181010080",
               "601#2F001A0000000000", "601#23001A0110004160", "601#23001A0220006460", "601#2F001A0002000000",
               "601#2F00180201000000", "601#2300180181010000", "601#2F60600008000000", "601#2FC2600101000000",
               "601#2FC26002FD000000"});
  }
  // One cycle of 1 ms: SYNC, then the receive PDO, as a master does. Gives the transmit PDO.
  std::string cycle(std::uint16_t controlword, std::int32_t target) {
    const auto answers = ask("080#");
    char text[32];
    const auto t = static_cast<std::uint32_t>(target);
    std::snprintf(text, sizeof text, "201#%02X%02X%02X%02X%02X%02X", controlword & 0xFFu, controlword >> 8u & 0xFFu,
                  t & 0xFFu, t >> 8 & 0xFFu, t >> 16 & 0xFFu, t >> 24 & 0xFFu);
    others = ask(text);
    pass(1);
    for (const auto& frame : answers) {
      if (frame.substr(0, 4) == "181#") return frame;
    }
    return "";
  }
  void cycles(int count, std::uint16_t controlword, std::int32_t target) {
    for (int i = 0; i < count; ++i) last = cycle(controlword, target);
  }
  void enable() {
    configure();
    cycles(4, 0x06, 1000);
    cycles(2, 0x07, 1000);
    cycles(8, 0x0F, 1000);
    ASSERT_EQ(last, "181#3712E8030000");
  }
  // Moves at a constant speed, in counts per ms.
  void move(int count, int speed) {
    for (int i = 0; i < count; ++i) cycle(0x0F, position += speed);
  }

  testing::IdealAxis axis;
  testing::RecordingPort port;
  DriveDevice drive{config(), axis, port};
  std::int64_t now_ns = 0;
  std::int32_t position = 1000;
  std::string last;
  std::vector<std::string> others;
};

// Mode 10: {6040, 6071} in, {6041, 6064, 6077} out.
struct TorqueDriveTest : DriveDeviceTest {
  void SetUp() override {
    configure({"601#2300140101020080", "601#2F00160000000000", "601#2300160110004060", "601#2300160210007160",
               "601#2F00160002000000", "601#2F00140201000000", "601#2B00140503000000", "601#2300140101020000",
               "601#2300180181010080", "601#2F001A0000000000", "601#23001A0110004160", "601#23001A0220006460",
               "601#23001A0310007760", "601#2F001A0003000000", "601#2F00180201000000", "601#2300180181010000",
               "601#2F6060000A000000", "601#2FC2600101000000", "601#2FC26002FD000000", "601#2B72600058020000",
               "601#2B07600003000000"});
    torque_cycles(4, 0x06, 0);
    torque_cycles(2, 0x07, 0);
    torque_cycles(8, 0x0F, 0);
    ASSERT_EQ(last, "181#3712E80300000000");
  }
  void torque_cycles(int count, std::uint16_t controlword, std::int16_t torque) {
    for (int i = 0; i < count; ++i) {
      last = ask("080#").front();
      char text[32];
      const auto t = static_cast<std::uint16_t>(torque);
      std::snprintf(text, sizeof text, "201#%02X%02X%02X%02X", controlword & 0xFFu, controlword >> 8u, t & 0xFFu,
                    t >> 8u);
      others = ask(text);
      pass(1);
    }
  }
};

TEST_F(TorqueDriveTest, TakesThousandthsOfItsRatedTorqueAtTheNextSync) {
  torque_cycles(1, 0x0F, 250);
  EXPECT_DOUBLE_EQ(axis.torques.back(), 0.0);
  torque_cycles(1, 0x0F, -250);
  EXPECT_DOUBLE_EQ(axis.torques.back(), 0.25);
  torque_cycles(1, 0x0F, -250);
  EXPECT_DOUBLE_EQ(axis.torques.back(), -0.25);
}

TEST_F(TorqueDriveTest, CutsATorqueAtItsLargestAndSaysSo) {
  torque_cycles(3, 0x0F, 900);  // 6072h is 600
  EXPECT_DOUBLE_EQ(axis.torques.back(), 0.6);
  EXPECT_EQ(last.substr(0, 8), "181#371A");  // bit 11
}

// SYNC goes on, the setpoints don't: the last torque acts until the receive PDO's timer of three milliseconds, and not
// when a fourth setpoint would have been due. EMCY 8250h, quick stop by 6007h.
TEST_F(TorqueDriveTest, GivesUpATorqueWithinThreeMissedSetpoints) {
  torque_cycles(3, 0x0F, 250);
  for (int missed = 0; missed < 3; ++missed) {
    EXPECT_EQ(drive.state(), DriveState::operation_enabled);
    ask("080#");
    EXPECT_DOUBLE_EQ(axis.torques.back(), 0.25);
    EXPECT_TRUE(axis.stops.empty());
    others.clear();
    pass(1);
    for (const auto& frame : port.take()) others.push_back(frame);
  }
  EXPECT_THAT(others, Contains("081#5082110000000000"));
  EXPECT_EQ(axis.stops.size(), 1u) << "from the torque on the drive's own ramp";
  EXPECT_NE(drive.state(), DriveState::operation_enabled);
}

// Statuswords: bits of the state as CiA 402 has them, voltage (10h), remote (200h), and bit 12 once the target is
// followed. The axis stands at 1000 = 3E8h.
TEST_F(DriveDeviceTest, ComesToOperationEnabledByTheBook) {
  configure();
  EXPECT_EQ(cycle(0x00, 1000), "181#5002E8030000");  // switch on disabled
  EXPECT_EQ(cycle(0x06, 1000), "181#5002E8030000");
  EXPECT_EQ(cycle(0x07, 1000), "181#3102E8030000");  // 2: ready to switch on
  EXPECT_EQ(cycle(0x0F, 1000), "181#3302E8030000");  // 3: switched on
  EXPECT_FALSE(axis.enabled);
  EXPECT_EQ(cycle(0x0F, 1000), "181#3702E8030000");  // 4: operation enabled, the brake still opens
  EXPECT_TRUE(axis.enabled);
  cycles(6, 0x0F, 1000);
  EXPECT_EQ(last, "181#3712E8030000");  // follows
  EXPECT_EQ(drive.last_transition(), 4);
}

TEST_F(DriveDeviceTest, ReachesATargetAtTheSyncAfterTheOneThatLatchedIt) {
  enable();
  cycle(0x0F, 1100);                                 // SYNC k, then the target
  EXPECT_EQ(cycle(0x0F, 1100), "181#3712E8030000");  // SYNC k + 1 latches it
  EXPECT_EQ(cycle(0x0F, 1100), "181#37124C040000");  // at SYNC k + 2 the axis is there, 1100 = 44Ch
}

TEST_F(DriveDeviceTest, WalksThroughEachTransition) {
  configure();
  cycles(4, 0x06, 1000);
  EXPECT_EQ(drive.state(), DriveState::ready_to_switch_on);
  cycles(2, 0x00, 1000);
  EXPECT_EQ(drive.last_transition(), 7);
  cycles(2, 0x06, 1000);
  cycles(2, 0x07, 1000);
  EXPECT_EQ(drive.state(), DriveState::switched_on);
  cycles(2, 0x06, 1000);
  EXPECT_EQ(drive.last_transition(), 6);
  cycles(2, 0x07, 1000);
  cycles(2, 0x02, 1000);
  EXPECT_EQ(drive.last_transition(), 10);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  cycles(2, 0x06, 1000);
  cycles(8, 0x0F, 1000);  // 3 and 4 in one go
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  cycles(3, 0x07, 1000);
  EXPECT_EQ(drive.last_transition(), 5);
  EXPECT_EQ(drive.state(), DriveState::switched_on);
  cycles(8, 0x0F, 1000);
  cycles(2, 0x06, 1000);
  EXPECT_EQ(drive.last_transition(), 8);
  EXPECT_EQ(drive.state(), DriveState::ready_to_switch_on);
  cycles(8, 0x0F, 1000);
  cycles(2, 0x00, 1000);
  EXPECT_EQ(drive.last_transition(), 9);
  EXPECT_FALSE(axis.enabled);
  cycles(2, 0x06, 1000);
  cycles(8, 0x0F, 1000);
  cycles(3, 0x02, 1000);
  EXPECT_EQ(drive.last_transition(), 12);  // 11, then 12 by itself (605Ah = 2)
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
}

TEST_F(DriveDeviceTest, StaysInQuickStopWhenToldSo) {
  enable();
  ask("601#2B5A600006000000");
  move(10, 100);
  cycles(400, 0x02, position);
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
  EXPECT_EQ(last.substr(0, 8), "181#1702");
  EXPECT_TRUE(axis.enabled);
  cycles(2, 0x0F, axis.position_counts());
  EXPECT_EQ(drive.last_transition(), 16);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
}

TEST_F(DriveDeviceTest, RefusesOperationUntilModePeriodAndSyncAgree) {
  const auto reason = [this] { return ask("601#4001200000000000").at(0).substr(12, 2); };
  ask("000#0101");
  ask("601#2B40600006000000");
  ask("601#2B40600007000000");
  ask("601#2B4060000F000000");
  EXPECT_EQ(drive.state(), DriveState::switched_on);
  EXPECT_EQ(reason(), "01");
  EXPECT_EQ(drive.statusword() & 0x0080, 0x0080);
  ask("601#2F60600008000000");
  pass(1);
  ask("601#2B4060000F000000");
  EXPECT_EQ(reason(), "02");
  ask("601#2FC2600102000000");  // 2 ms
  ask("601#2B4060000F000000");
  EXPECT_EQ(reason(), "03");
  for (int i = 0; i < 10; ++i) {
    ask("080#");
    pass(1);
  }
  ask("601#2B4060000F000000");
  EXPECT_EQ(reason(), "04");
  ask("601#2FC2600101000000");
  ask("601#2B4060000F000000");
  EXPECT_EQ(reason(), "05");  // 607Ah is 0, the axis stands at 1000
  ask("601#237A6000E8030000");
  ask("601#2B4060000F000000");
  EXPECT_EQ(reason(), "00");
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  EXPECT_EQ(drive.statusword() & 0x0080, 0);
}

TEST_F(DriveDeviceTest, RefusesModesThatItDoesNotHave) {
  EXPECT_THAT(ask("601#4002650000000000"), ElementsAre("581#43026500C0020000"));  // bits 6, 7 and 9: modes 7, 8 and 10
  EXPECT_THAT(ask("601#2F60600009000000"), ElementsAre("581#8060600030000906"));  // cyclic synchronous velocity
}

TEST_F(DriveDeviceTest, TripsOnATargetThatIsFarAwayWhenTheBrakeOpens) {
  configure();
  cycles(4, 0x06, 1000);
  cycles(2, 0x07, 1000);
  cycles(2, 0x0F, 1000);
  cycles(6, 0x0F, 5000);
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_THAT(axis.targets, ::testing::Not(Contains(5000)));
}

TEST_F(DriveDeviceTest, FollowingErrorBecomesAFaultAfterItsTime) {
  enable();
  axis.jammed = true;
  move(4, 100);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  move(14, 100);
  EXPECT_EQ(drive.state(), DriveState::fault_reaction_active);
  pass(2000);  // the demand has to come to rest, also where the axis can't follow
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_THAT(ask("601#403F600000000000"), ElementsAre("581#4B3F600011860000"));
  EXPECT_FALSE(axis.enabled);
  // A reset needs a rising edge of bit 7.
  cycles(2, 0x00, 1000);
  axis.jammed = false;
  cycles(2, 0x80, 1000);
  EXPECT_EQ(drive.last_transition(), 15);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  EXPECT_THAT(ask("601#403F600000000000"), ElementsAre("581#4B3F600000000000"));
}

TEST_F(DriveDeviceTest, TellsItsFaultsByEmcy) {
  enable();
  drive.inject_fault(0x4210, now_ns);
  EXPECT_THAT(port.take(), ElementsAre("081#1042210000000000"));
  pass(1);
  EXPECT_EQ(cycle(0x0F, 1000).substr(0, 8), "181#1802");
  EXPECT_EQ(drive.state(), DriveState::fault);
  cycles(2, 0x00, 1000);
  const auto answers = [&] {
    cycle(0x80, 1000);
    return ask("080#");
  }();
  EXPECT_THAT(answers, Contains("081#0000000000000000"));
}

TEST_F(DriveDeviceTest, SlowsDownWhenATargetIsMissingAndGoesOnWithTheNext) {
  enable();
  move(20, 100);  // 100 counts/ms = 1e5 counts/s
  ask("080#");    // latches the last target
  pass(1);
  axis.stops.clear();
  ask("080#");  // nothing new: 6085h
  EXPECT_THAT(axis.stops, ElementsAre(1e6));
  pass(1);
  EXPECT_EQ(drive.state(), DriveState::operation_enabled);
  cycle(0x0F, axis.position_counts());
  cycle(0x0F, axis.position_counts());
  EXPECT_FALSE(axis.stopping);
}

TEST_F(DriveDeviceTest, StopsByItselfWhenSyncStops) {
  enable();
  move(20, 100);
  pass(10);
  EXPECT_EQ(drive.state(), DriveState::fault_reaction_active);
  EXPECT_THAT(port.take(), Contains("081#0087110000000000"));
  // 1e5 counts/s at 1e6 counts/s²: 100 ms and 5000 counts, after three periods at full speed at most.
  pass(110);
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_FALSE(axis.enabled);
  EXPECT_LT(axis.position - position, 5000.0 + 4 * 100.0);
}

TEST_F(DriveDeviceTest, StopsByItselfWhenThePdoStops) {
  ask("601#2B00140503000000");  // 3 ms
  ask("601#2B07600003000000");  // quick stop
  enable();
  move(20, 100);
  for (int i = 0; i < 5; ++i) {
    ask("080#");
    pass(1);
  }
  EXPECT_EQ(drive.state(), DriveState::quick_stop_active);
  for (int i = 0; i < 120; ++i) {
    ask("080#");
    pass(1);
  }
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
  EXPECT_EQ(drive.last_transition(), 12);
  EXPECT_LT(axis.position - position, 5000.0 + 4 * 100.0);
}

TEST_F(DriveDeviceTest, StopsByItselfWhenTheMastersHeartbeatStops) {
  ask("601#231610010A007F00");  // 10 ms
  enable();
  ask("77F#05");
  std::vector<std::string> seen;
  for (int i = 0; i < 20; ++i) {
    move(1, 100);
    seen.insert(seen.end(), others.begin(), others.end());
  }
  EXPECT_EQ(drive.state(), DriveState::fault_reaction_active);  // 6007h is 1
  EXPECT_EQ(drive.canopen().state(), NmtState::pre_operational);
  pass(120);
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_FALSE(axis.enabled);
}

TEST_F(DriveDeviceTest, StopsWhenSomebodyTakesItOutOfOperational) {
  enable();
  move(20, 100);
  ask("000#8000");
  EXPECT_EQ(drive.state(), DriveState::fault_reaction_active);
  pass(120);
  EXPECT_EQ(drive.state(), DriveState::fault);
}

// 6007h: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop; 605Eh and 605Ah say how.
TEST_F(DriveDeviceTest, ReactsToALostConnectionAs6007Says) {
  struct Case {
    const char* option;
    DriveState soon, finally;
  };
  for (const Case& c : {Case{"00", DriveState::operation_enabled, DriveState::operation_enabled},
                        Case{"01", DriveState::fault_reaction_active, DriveState::fault},
                        Case{"02", DriveState::switch_on_disabled, DriveState::switch_on_disabled},
                        Case{"03", DriveState::quick_stop_active, DriveState::switch_on_disabled}}) {
    ask("000#8101");
    pass(30);
    position = axis.position_counts();
    ask("601#2B00140504000000");  // 4 ms
    ask(std::string("601#2B076000") + c.option + "000000");
    configure();
    cycles(4, 0x06, position);
    cycles(2, 0x07, position);
    cycles(8, 0x0F, position);
    ASSERT_EQ(drive.state(), DriveState::operation_enabled) << c.option;
    move(20, 100);
    const auto sync_only = [&](int count) {
      for (int i = 0; i < count; ++i) {
        ask("080#");
        pass(1);
      }
    };
    sync_only(6);
    EXPECT_EQ(drive.state(), c.soon) << c.option;
    sync_only(150);
    EXPECT_EQ(drive.state(), c.finally) << c.option;
    EXPECT_EQ(axis.speed, 0.0) << c.option;
  }
}

TEST_F(DriveDeviceTest, CoastsIntoItsBrakeOnAFaultWhen605eSaysSo) {
  ask("601#2B5E600000000000");
  enable();
  move(20, 100);
  drive.inject_fault(0x4210, now_ns);
  EXPECT_EQ(drive.state(), DriveState::fault);
  EXPECT_FALSE(axis.enabled);
}

TEST_F(DriveDeviceTest, RefusesAResetWhileTheMastersHeartbeatIsStillMissing) {
  ask("601#231610010A007F00");
  ask("601#2F29100101000000");  // stays operational
  enable();
  ask("77F#05");
  for (int i = 0; i < 20; ++i) cycle(0x0F, 1000);
  ASSERT_EQ(drive.state(), DriveState::fault);
  cycles(2, 0x00, 1000);
  cycles(2, 0x80, 1000);
  EXPECT_EQ(drive.state(), DriveState::fault);
  ask("77F#05");
  cycles(2, 0x00, 1000);
  cycles(2, 0x80, 1000);
  EXPECT_EQ(drive.state(), DriveState::switch_on_disabled);
}

TEST_F(DriveDeviceTest, DropsPowerOnReset) {
  for (const char* reset : {"000#8101", "000#8201"}) {
    enable();
    ask(reset);
    EXPECT_FALSE(axis.enabled) << reset;
    pass(30);
    EXPECT_EQ(drive.state(), DriveState::switch_on_disabled) << reset;
    port.take();
  }
}

TEST_F(DriveDeviceTest, CutsTargetsAtItsPositionLimitsAndSaysSo) {
  ask("601#237D600100000000");
  ask("601#237D60024C040000");  // 0..1100
  enable();
  move(2, 50);
  EXPECT_EQ(cycle(0x0F, 1150).substr(0, 8), "181#3712");
  cycle(0x0F, 1150);
  EXPECT_EQ(cycle(0x0F, 1150).substr(0, 8), "181#370A");  // bit 11, and not bit 12
  EXPECT_EQ(axis.targets.back(), 1100);
}

TEST_F(DriveDeviceTest, SurvivesRandomMasters) {
  constexpr unsigned seed = 402;
  std::mt19937 random(seed);
  configure();
  for (int i = 0; i < testing::scaled(50'000); ++i) {
    const auto controlword = static_cast<std::uint16_t>(random() % 4 == 0 ? random() : random() % 16);
    const auto target = static_cast<std::int32_t>(random() % 8 == 0 ? random() : random() % 2000);
    switch (random() % 32) {
      case 0:
        ask("000#8000");
        break;
      case 1:
        ask("000#8100");
        break;
      case 2: {
        fieldbus::CanFrame frame;
        frame.id = 0x601;
        frame.length = 8;
        for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random());
        frame.data[2] = 0x60;
        drive.on_frame(frame, now_ns);
        break;
      }
      case 3:
        drive.inject_fault(static_cast<std::uint16_t>(random()), now_ns);
        break;
      case 4:
        pass(5);
        break;
      case 5:
        if (drive.canopen().state() == NmtState::pre_operational) ask("000#0100");
        break;
      default:
        cycle(controlword, target);
    }
    // Power is on exactly in the states that have it.
    const DriveState state = drive.state();
    const bool may_move = state == DriveState::operation_enabled || state == DriveState::quick_stop_active ||
                          state == DriveState::fault_reaction_active;
    ASSERT_EQ(axis.enabled, may_move) << "seed " << seed << ", step " << i;
    port.take();
  }
}

}  // namespace
}  // namespace proxarm::sim
