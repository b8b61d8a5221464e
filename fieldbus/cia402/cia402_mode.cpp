#include "fieldbus/cia402/cia402_mode.hpp"

#include <algorithm>

namespace proxarm::fieldbus {
namespace {

constexpr CyclicMode modes[] = {
    {"csp", 8, 0x607A00, false, 0, "the drive can't do cyclic synchronous position (mode 8)",
     "the drive took mode 8 (cyclic synchronous position) but didn't change to it"},
    {"ip", 7, 0x60C101, false, 0x0010, "the drive can't do interpolated position (mode 7)",
     "the drive took mode 7 (interpolated position) but didn't change to it"},
    {"cst", 10, 0x607100, true, 0, "the drive can't do cyclic synchronous torque (mode 10)",
     "the drive took mode 10 (cyclic synchronous torque) but didn't change to it"}};

}  // namespace

const CyclicMode& mode_of(const description::DriveDescription& drive) noexcept {
  const auto* found =
      std::find_if(std::begin(modes), std::end(modes), [&](const CyclicMode& m) { return drive.mode == m.name; });
  return found == std::end(modes) ? modes[0] : *found;
}

std::vector<MappedObject> rpdo_mapping(const description::DriveDescription& drive) {
  const CyclicMode& mode = mode_of(drive);
  const std::uint32_t target = drive.objects.target != 0 ? drive.objects.target : mode.target;
  return {{object_address(drive.objects.controlword), 16},
          {object_address(target), static_cast<std::uint8_t>(mode.torque ? 16 : 32)}};
}

std::vector<MappedObject> tpdo_mapping(const description::DriveDescription& drive, bool torque_feedback) {
  std::vector<MappedObject> mapping{{object_address(drive.objects.statusword), 16},
                                    {object_address(drive.objects.position), 32}};
  if (mode_of(drive).torque && torque_feedback) mapping.push_back({object_address(drive.objects.torque), 16});
  for (const description::DriveFeedback& more : drive.feedback) {
    mapping.push_back({object_address(more.object), more.bits});
  }
  if (drive.gear_torque) mapping.push_back({object_address(drive.gear_torque->object), drive.gear_torque->bits});
  return mapping;
}

namespace {

constexpr unsigned statusword_and_position = 16 + 32, actual_torque = 16;  // sizes in bits

// Returns the first byte of an object of the cell's `feedback` in TPDO1, or nullopt. `bits` is the size of the objects
// before the feedback.
std::optional<std::uint8_t> feedback_byte(const description::DriveDescription& drive, std::uint32_t object,
                                          std::uint8_t wide, unsigned bits) noexcept {
  for (const description::DriveFeedback& more : drive.feedback) {
    if (more.object == object && more.bits == wide) return static_cast<std::uint8_t>(bits / 8);
    bits += more.bits;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::uint8_t> extra_torque_byte(const description::DriveDescription& drive) noexcept {
  if (mode_of(drive).torque) return std::nullopt;
  return feedback_byte(drive, drive.objects.torque, 16, statusword_and_position);
}

std::optional<std::uint8_t> mode_display_byte(const description::DriveDescription& drive,
                                              bool torque_feedback) noexcept {
  const bool torque = mode_of(drive).torque && torque_feedback;
  return feedback_byte(drive, drive.objects.mode_display, 8, statusword_and_position + (torque ? actual_torque : 0));
}

std::optional<std::uint8_t> gear_torque_byte(const description::DriveDescription& drive) noexcept {
  if (!drive.gear_torque) return std::nullopt;
  unsigned bits = statusword_and_position;
  for (const description::DriveFeedback& more : drive.feedback) bits += more.bits;
  return static_cast<std::uint8_t>(bits / 8);
}

std::uint8_t pdo_bytes(const std::vector<MappedObject>& mapping) noexcept {
  unsigned bits = 0;
  for (const MappedObject& object : mapping) bits += object.bits;
  return static_cast<std::uint8_t>(bits / 8);
}

}  // namespace proxarm::fieldbus
