// libFuzzer: any frames at the cycle's decoders: drive (TPDO, EMCY, heartbeat) and force sensor.
//
// Input: records of one byte choosing the identifier and the length, then the data. The invariants of the cycle must
// hold after each: finite numbers out, RPDOs of the right shape, no enabling without three held targets.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "fieldbus/cia402/cia402_drive.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"

namespace {

using namespace proxarm::fieldbus;

proxarm::description::DriveDescription description() {
  proxarm::description::DriveDescription drive;
  drive.joint = "axis_1";
  drive.bus = "fuzz";
  drive.node = 5;
  drive.range_rad = {-3.0, 3.0};
  return drive;
}

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const proxarm::description::DriveDescription drive_description = description();
  ServoDrive drive(drive_description, DriveSettings{});
  AtiNetCanOem sensor({.bus_name = "fuzz", .base_id = 0x68});
  constexpr std::uint32_t ids[] = {0x185, 0x185, 0x085, 0x705, 0x585, 0x680, 0x681, 0x68F};
  std::int64_t now_ns = 0;
  int held = 0;
  bool switched_on_at_sync = false;
  drive.start_cycle(0);
  drive.request(DriveGoal::operation_enabled);
  for (std::size_t at = 0; at < size;) {
    const std::uint8_t head = data[at++];
    now_ns += 1'000'000;
    CanFrame frame;
    drive.on_sync(now_ns);
    held = switched_on_at_sync ? held + 1 : 0;
    if ((head & 8) != 0) (void)sensor.poll(now_ns, frame);
    frame = CanFrame{};
    frame.id = ids[head & 7U];
    frame.length = (head >> 4U) % 9;
    for (std::size_t i = 0; i < frame.length && at < size; ++i) frame.data[i] = data[at++];
    drive.on_frame(frame, now_ns);
    sensor.on_frame(frame, now_ns);
    drive.set_target_rad(1e-3 * static_cast<double>(head) - 0.1);
    CanFrame rpdo;
    if (drive.encode_rpdo(rpdo)) {
      require(rpdo.id == 0x205 && rpdo.length == 6);
      if (drive.state() == DriveState::switched_on && rpdo.data[0] == 0x0F) require(held >= 3);
      if (!drive.following()) require(drive.target_counts() == drive.actual_counts());
    }
    switched_on_at_sync = drive.state() == DriveState::switched_on;
    require(std::isfinite(drive.actual_rad()) && std::isfinite(drive.target_rad()));
    for (const double component : sensor.latest().wrench_S) require(std::isfinite(component));
  }
  require(!drive.describe().empty());
  require(!sensor.describe_status(sensor.latest().status).empty());
  return 0;
}
