#include "fieldbus/canopen/canopen_emcy.hpp"

#include <algorithm>
#include <cstdio>

namespace proxarm::fieldbus {
namespace {

struct Wording {
  std::uint16_t code;
  std::uint16_t mask;  // FFFF: the row holds for one code; FF00 or F000: for a class of codes
  std::string_view text;
};

// Rows of exact codes stand before rows of classes, because the first row that matches is taken.
constexpr Wording wordings[] = {
    {0x0000, 0xFFFF, "error reset or no error"},
    // CiA 402, drives
    {0x2220, 0xFFFF, "continuous over current (device internal)"},
    {0x2250, 0xFFFF, "short circuit (device internal)"},
    {0x2310, 0xFFFF, "continuous over current (output side)"},
    {0x2320, 0xFFFF, "short circuit or earth leakage (output side)"},
    {0x2340, 0xFFFF, "short circuit (motor side)"},
    {0x3110, 0xFFFF, "mains over voltage"},
    {0x3120, 0xFFFF, "mains under voltage"},
    {0x3130, 0xFFFF, "mains phase failure"},
    {0x3210, 0xFFFF, "DC link over voltage"},
    {0x3220, 0xFFFF, "DC link under voltage"},
    {0x4210, 0xFFFF, "excess temperature of the device"},
    {0x4310, 0xFFFF, "excess temperature of the drive"},
    {0x5112, 0xFFFF, "low supply voltage of the control"},
    {0x5441, 0xFFFF, "safe torque off (enable contact) active"},
    {0x6010, 0xFFFF, "software reset (watchdog)"},
    {0x6320, 0xFFFF, "parameter error"},
    {0x7121, 0xFFFF, "motor blocked"},
    {0x7122, 0xFFFF, "motor error or commutation malfunction"},
    {0x7305, 0xFFFF, "incremental sensor 1 fault"},
    {0x7500, 0xFFFF, "communication error of additional modules"},
    // CiA 301
    {0x8110, 0xFFFF, "CAN overrun (objects lost)"},
    {0x8120, 0xFFFF, "CAN in error passive mode"},
    {0x8130, 0xFFFF, "life guard error or heartbeat error"},
    {0x8140, 0xFFFF, "recovered from bus off"},
    {0x8150, 0xFFFF, "CAN-ID collision"},
    {0x8210, 0xFFFF, "PDO not processed due to length error"},
    {0x8220, 0xFFFF, "PDO length exceeded"},
    {0x8230, 0xFFFF, "DAM MPDO not processed, destination object not available"},
    {0x8240, 0xFFFF, "unexpected SYNC data length"},
    {0x8250, 0xFFFF, "RPDO timeout"},
    // CiA 402 again
    {0x8400, 0xFFFF, "velocity speed controller"},
    {0x8480, 0xFFFF, "velocity following error"},
    {0x8500, 0xFFFF, "position controller"},
    {0x8600, 0xFFFF, "positioning controller"},
    {0x8611, 0xFFFF, "following error"},
    {0x8612, 0xFFFF, "reference limit"},
    // classes
    {0x1000, 0xFF00, "generic error"},
    {0x2100, 0xFF00, "current, device input side"},
    {0x2200, 0xFF00, "current inside the device"},
    {0x2300, 0xFF00, "current, device output side"},
    {0x2000, 0xF000, "current"},
    {0x3100, 0xFF00, "mains voltage"},
    {0x3200, 0xFF00, "voltage inside the device"},
    {0x3300, 0xFF00, "output voltage"},
    {0x3000, 0xF000, "voltage"},
    {0x4100, 0xFF00, "ambient temperature"},
    {0x4200, 0xFF00, "device temperature"},
    {0x4000, 0xF000, "temperature"},
    {0x5000, 0xF000, "device hardware"},
    {0x6100, 0xFF00, "internal software"},
    {0x6200, 0xFF00, "user software"},
    {0x6300, 0xFF00, "data set"},
    {0x6000, 0xF000, "device software"},
    {0x7000, 0xF000, "additional modules"},
    {0x8100, 0xFF00, "communication"},
    {0x8200, 0xFF00, "protocol error"},
    {0x8000, 0xF000, "monitoring"},
    {0x9000, 0xF000, "external error"},
    {0xF000, 0xFF00, "additional functions"},
    {0xFF00, 0xFF00, "device specific"},
};

constexpr std::string_view register_bits[8] = {"generic",       "current", "voltage",  "temperature",
                                               "communication", "profile", "reserved", "maker's own"};

}  // namespace

bool decode_emcy(const CanFrame& frame, std::int64_t time_ns, std::uint8_t node, Emergency& out) noexcept {
  if (frame.id != emcy_id(node) || frame.extended || frame.remote || frame.error || frame.length < 2) return false;
  std::array<std::uint8_t, 8> bytes{};
  std::copy_n(frame.data.begin(), std::min<std::size_t>(frame.length, bytes.size()), bytes.begin());
  out.code = static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
  out.error_register = bytes[2];
  std::copy_n(bytes.begin() + 3, out.vendor.size(), out.vendor.begin());
  out.time_ns = time_ns;
  return true;
}

bool is_warning(const Emergency& emergency) noexcept {
  constexpr std::uint16_t error_passive = 0x8120, pdo_length_exceeded = 0x8220;
  if (emergency.code == error_passive || emergency.code == pdo_length_exceeded) return true;
  const unsigned group = emergency.code >> 8;
  return emergency.error_register == 0 && (group == 0x81 || group == 0xFF);
}

std::string_view emcy_text(std::uint16_t code) noexcept {
  for (const Wording& wording : wordings) {
    if ((code & wording.mask) == wording.code) return wording.text;
  }
  return "unknown error code";
}

std::string describe(const Emergency& emergency) {
  char head[16];
  std::snprintf(head, sizeof head, "EMCY %04X: ", unsigned{emergency.code});
  std::string text = head;
  text += emcy_text(emergency.code);
  std::snprintf(head, sizeof head, "%02X", unsigned{emergency.error_register});
  text += std::string(" (error register ") + head;
  const char* separator = ": ";
  for (int bit = 0; bit < 8; ++bit) {
    if ((emergency.error_register >> bit & 1) == 0) continue;
    text += separator;
    text += register_bits[bit];
    separator = ", ";
  }
  text += ")";
  if (std::all_of(emergency.vendor.begin(), emergency.vendor.end(), [](std::uint8_t byte) { return byte == 0; })) {
    return text;
  }
  text += ", maker's bytes";
  for (const std::uint8_t byte : emergency.vendor) {
    std::snprintf(head, sizeof head, " %02X", unsigned{byte});
    text += head;
  }
  return text;
}

}  // namespace proxarm::fieldbus
