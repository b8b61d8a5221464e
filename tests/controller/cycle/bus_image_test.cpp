#include "controller/cycle/bus_image.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/controller/motion/fake_devices.hpp"

namespace proxarm::controller {
namespace {

using testing::FakeDrives;
using testing::FakeNetwork;
using testing::FakeSensor;
using testing::Watched;

constexpr std::uint32_t sync = 0x080, poll = 0x310, sample = 0x300, heartbeat = 0x77F;

struct Listener final : FrameListener {
  bool on_frame(std::size_t /*bus*/, const fieldbus::CanFrame& frame) noexcept override {
    heard.push_back(frame.id);
    return frame.id == takes_id;
  }
  std::vector<std::uint32_t> heard;
  std::uint32_t takes_id = 0;
};

// Drives of the default cell on bus 0, the sensor on bus 1.
struct BusImageTest : ::testing::Test {
  BusImageTest() {
    auto fake = std::make_unique<FakeSensor>();
    fake->is_fresh = false;
    sensor = fake.get();
    FakeDrives made(cell, *arm);
    drives = made.fakes;
    for (std::size_t i = 0; i < drives.size(); ++i) {
      drives[i]->takes_id = static_cast<std::uint32_t>(0x181 + i);
      drives[i]->sends_id = static_cast<std::uint32_t>(0x201 + i);
    }
    parts.drives = std::move(made.on_bus);
    parts.sensor = std::move(fake);
    parts.drive_buses.push_back({0, fieldbus::SyncProducer(), fieldbus::HeartbeatProducer(0x7F, 100'000'000)});
    image.emplace(parts, recorder, watched.alarm);
    recorder.begin(0, [](fieldbus::StateArchive&) noexcept {});
  }
  [[nodiscard]] static Setpoints still(double angle_rad) {
    return {Setpoints::Kind::angles_rad, models::JointVector::Constant(6, angle_rad)};
  }

  description::Cell cell = testing::default_cell();
  std::unique_ptr<models::Arm> arm = std::make_unique<models::Arm>(cell);
  FakeNetwork network{2};
  FakeSensor* sensor = nullptr;
  std::vector<testing::FakeDrive*> drives;
  Watched watched;
  CycleRecorder recorder{4};
  CycleParts parts{.network = network,
                   .drives = {},
                   .can_drives = {},
                   .drive_buses = {},
                   .sensor = nullptr,
                   .sensor_bus = 1,
                   .modbus_lines = {},
                   .arm = nullptr,
                   .rendering = std::unique_ptr<TorqueRendering>(),
                   .compensation = WrenchCompensation(cell),
                   .tool = cell.tool,
                   .enabling = std::nullopt,
                   .supervision = cell.supervision};
  std::optional<BusImage> image;
  Listener listener;
};

TEST_F(BusImageTest, BeginsWithSyncAndPoll) {
  image->begin(0);
  EXPECT_EQ(network.buses[0].sent, std::vector<std::uint32_t>{sync});
  EXPECT_EQ(network.buses[1].sent, std::vector<std::uint32_t>{poll});
  for (const testing::FakeDrive* drive : drives) EXPECT_EQ(drive->syncs, 1);
}

TEST_F(BusImageTest, ReceivesUntilEveryDeviceHasAnswered) {
  network.buses[0].waiting = {0x181, 0x186};
  network.buses[1].waiting = {sample, 0x123};
  image->receive_until(1'000, listener);
  EXPECT_EQ(network.waits, 1);
  EXPECT_EQ(listener.heard, std::vector<std::uint32_t>{0x123}) << "what is nobody's";
  EXPECT_EQ(watched.times(Fault::second_master), 0u);
}

TEST_F(BusImageTest, WaitsNoLongerThanItMay) {
  image->receive_until(1'000, listener);
  EXPECT_EQ(network.waits, 1) << "and the network says that the time is over";
}

TEST_F(BusImageTest, FindsASecondMasterWhereItHasDrives) {
  network.buses[1].waiting = {sync};  // no drive is there
  network.buses[0].waiting = {0x181};
  image->receive_until(1'000, listener);
  EXPECT_EQ(watched.times(Fault::second_master), 0u);
  network.buses[0].waiting = {sync};
  image->receive_until(1'000, listener);
  EXPECT_EQ(watched.times(Fault::second_master), 1u);
  EXPECT_EQ(watched.supervisor.report().where, 0);
}

TEST_F(BusImageTest, LetsTheListenerTakeAFrameFirst) {
  listener.takes_id = sync;
  network.buses[0].waiting = {sync};
  image->receive_until(1'000, listener);
  EXPECT_EQ(watched.times(Fault::second_master), 0u);
}

TEST_F(BusImageTest, SendsSetpointsAndHeartbeatInOneCall) {
  image->send_setpoints(still(0.25), 0, 1);
  EXPECT_TRUE(network.buses[0].sent.empty()) << "until they are handed over";
  image->send(0, {.id = 0x601});
  image->hand_over();
  EXPECT_EQ(network.buses[0].batches, 1);
  const std::vector<std::uint32_t> expected{0x201, 0x202, 0x203, 0x204, 0x205, 0x206, heartbeat, 0x601};
  EXPECT_EQ(network.buses[0].sent, expected);
  for (const testing::FakeDrive* drive : drives) EXPECT_EQ(drive->told_rad, 0.25);
}

TEST_F(BusImageTest, SendsMoreThanAnOutboxHolds) {
  for (std::uint32_t id = 1; id <= 40; ++id) image->send(1, {.id = id});
  image->hand_over();
  ASSERT_EQ(network.buses[1].sent.size(), 40u);
  for (std::uint32_t id = 1; id <= 40; ++id) EXPECT_EQ(network.buses[1].sent[id - 1], id) << "in their order";
}

TEST_F(BusImageTest, SaysWhyAFrameCouldNotBeSent) {
  const std::pair<fieldbus::SendResult, Fault> table[]{{fieldbus::SendResult::queue_full, Fault::send_failed},
                                                       {fieldbus::SendResult::bus_off, Fault::bus_off},
                                                       {fieldbus::SendResult::down, Fault::interface_down}};
  for (const auto& [result, fault] : table) {
    network.buses[1].result = result;
    image->send(1, {.id = 1});
    image->hand_over();
    EXPECT_EQ(watched.times(fault), 1u) << fault_name(fault);
  }
}

TEST_F(BusImageTest, KeepsTheStatusThatItHasReadForTheRecorder) {
  network.buses[1].its_status.receive_overflows = 7;
  EXPECT_EQ(image->read_status()[1].receive_overflows, 7u);
  EXPECT_EQ(recorder.entry().buses[1].receive_overflows, 7u);
  network.buses[1].its_status.receive_overflows = 8;
  EXPECT_EQ(image->status()[1].receive_overflows, 7u);
}

TEST_F(BusImageTest, BelievesADriveOffByItsWord) {
  for (testing::FakeDrive* drive : drives) drive->its_state = fieldbus::DriveState::switched_on;
  EXPECT_TRUE(image->drives_off());
  drives[3]->its_state = fieldbus::DriveState::quick_stop_active;
  EXPECT_FALSE(image->drives_off());
  EXPECT_EQ(image->first_drive_on(), 3);
}

TEST_F(BusImageTest, RecordsWhatDrivesWereToldAndSaid) {
  drives[5]->is_fresh = false;
  CycleRecord record;
  image->write_record(record);
  EXPECT_EQ(record.axes, 6);
  EXPECT_EQ(record.target_counts[0], 22);
  EXPECT_EQ(record.actual_counts[0], 11);
  EXPECT_TRUE(record.has(RecordFlag::feedback_missing));
}

}  // namespace
}  // namespace proxarm::controller
