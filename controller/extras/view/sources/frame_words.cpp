#include "controller/extras/view/sources/frame_words.hpp"

#include <array>
#include <cstdio>

#include "fieldbus/cia402/cia402_mode.hpp"

namespace proxarm::view {
namespace {

using controller::BoxFrame;
using description::DriveDescription;
using fieldbus::MappedObject;

std::string hex(std::uint32_t number, int digits) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "%0*X", digits, number);
  return text.data();
}

// Returns the object's name in CiA 402 or CiA 301, and its address.
std::string name_of(const fieldbus::ObjectAddress& object) {
  struct Known {
    std::uint16_t index;
    const char* name;
  };
  constexpr std::array known{Known{0x6040, "controlword"},
                             Known{0x6041, "statusword"},
                             Known{0x607A, "target position"},
                             Known{0x6064, "position"},
                             Known{0x60C1, "interpolated position"},
                             Known{0x6071, "target torque"},
                             Known{0x6077, "torque"},
                             Known{0x60FD, "digital inputs"},
                             Known{0x606C, "velocity"},
                             Known{0x60F4, "following error"}};
  std::string text;
  for (const Known& one : known) {
    if (one.index == object.index) text = std::string(one.name) + " ";
  }
  text += hex(object.index, 4) + "h";
  if (object.sub != 0) text += ":" + hex(object.sub, 2);
  return text;
}

// Returns a little-endian number; with `is_signed`, it is a two's complement.
std::int64_t number_at(const fieldbus::CanFrame& frame, std::size_t byte, std::size_t bytes, bool is_signed) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes; i-- > 0;) value = value << 8U | frame.data[byte + i];
  const std::uint64_t sign = std::uint64_t{1} << (8 * bytes - 1);
  return is_signed && (value & sign) != 0 ? static_cast<std::int64_t>(value) - static_cast<std::int64_t>(2 * sign)
                                          : static_cast<std::int64_t>(value);
}

// Returns the value as text. Bit fields are in hexadecimal, positions also as angles.
std::string value_of(const MappedObject& mapped, std::int64_t value, const DriveDescription& drive) {
  const std::uint16_t index = mapped.object.index;
  if (index == 0x6040 || index == 0x6041 || index == 0x60FD) {
    return hex(static_cast<std::uint32_t>(value), mapped.bits / 4) + "h";
  }
  std::string text = std::to_string(value);
  if (mapped.bits == 32) {
    std::array<char, 32> angle{};
    std::snprintf(angle.data(), angle.size(), " = %.5f rad", drive.angle_rad(static_cast<std::int32_t>(value)));
    text += angle.data();
  } else if (index == 0x6071 || index == 0x6077) {
    text += " ‰";
  }
  return text;
}

std::string pdo_words(const fieldbus::CanFrame& frame, const std::vector<MappedObject>& mapping,
                      const DriveDescription& drive) {
  std::string text;
  std::size_t byte = 0;
  for (const MappedObject& mapped : mapping) {
    const std::size_t bytes = mapped.bits / 8U;
    if (bytes == 0 || byte + bytes > frame.length) break;
    const bool word = mapped.object.index == 0x6040 || mapped.object.index == 0x6041;
    if (!text.empty()) text += ", ";
    text += name_of(mapped.object) + ": " + value_of(mapped, number_at(frame, byte, bytes, !word), drive);
    byte += bytes;
  }
  return text;
}

std::string heartbeat_words(std::uint8_t state) {
  switch (state & 0x7FU) {
    case 0:
      return "boot-up";
    case 4:
      return "heartbeat: stopped";
    case 5:
      return "heartbeat: operational";
    case 127:
      return "heartbeat: pre-operational";
    default:
      return "heartbeat";
  }
}

// Describes a frame of a drive's predefined connection set; empty if the frame isn't of this set.
std::string drive_words(const fieldbus::CanFrame& frame, const DriveDescription& drive) {
  switch (frame.id - drive.node) {
    case 0x080:
      return "EMCY " + hex(static_cast<std::uint32_t>(number_at(frame, 0, 2, false)), 4) + "h";
    case 0x180:
      return pdo_words(frame, fieldbus::tpdo_mapping(drive), drive);
    case 0x200:
      return pdo_words(frame, fieldbus::rpdo_mapping(drive), drive);
    case 0x280:
      return "TPDO2: digital inputs";
    case 0x580:
      return "SDO, answer";
    case 0x600:
      return "SDO, request";
    case 0x700:
      return heartbeat_words(frame.data[0]);
    default:
      return "";
  }
}

}  // namespace

FrameWords describe_frame(const BoxFrame& frame, const controller::ReplayHead& head, const description::Cell& cell) {
  const fieldbus::CanFrame& f = frame.frame;
  FrameWords out{frame.bus < head.buses ? head.bus_names[frame.bus].data() : "?", hex(f.id, f.extended ? 8 : 3), "",
                 frame.sent ? "controller" : "", ""};
  for (std::size_t i = 0; i < f.length && i < f.data.size(); ++i) out.bytes += (i > 0 ? " " : "") + hex(f.data[i], 2);
  if (f.id == 0x080 && !f.extended) {
    out.words = "SYNC";
    return out;
  }
  if (f.id == 0x000 && !f.extended) {
    out.words = "NMT";
    return out;
  }
  const auto is_here = [&](const std::string& bus) {
    for (std::size_t i = 0; i < cell.buses.size() && i < controller::max_buses; ++i) {
      if (cell.buses[i].name == bus) return head.bus_of_cell_bus[i] == frame.bus;
    }
    return false;
  };
  for (const DriveDescription& drive : cell.drives) {
    if (!drive.on_can() || f.extended || !is_here(drive.bus)) continue;
    std::string words = drive_words(f, drive);
    if (words.empty()) continue;
    out.from = frame.sent ? "to " + drive.joint : drive.joint;
    out.words = std::move(words);
    return out;
  }
  if (is_here(cell.sensor.bus)) {
    out.from = frame.sent ? "to sensor" : "sensor";
    out.words = frame.sent ? "asks for a sample" : "sample";
  }
  if (!f.extended && f.id > 0x700 && f.id < 0x780) out.words = heartbeat_words(f.data[0]);
  return out;
}

}  // namespace proxarm::view
