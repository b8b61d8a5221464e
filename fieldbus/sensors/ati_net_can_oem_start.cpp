// Requests to an ATI Net CAN OEM before the cycle, and its status word as text.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::uint8_t op_matrix = 0x2, op_serial = 0x5, op_counts = 0x7, op_units = 0x8, op_firmware = 0xF;

struct Unit {
  std::uint8_t code;
  const char* name;
  double si;
};

constexpr double pound_force_N = 4.4482216152605;  // exact, by the definitions of the pound and of standard gravity
constexpr double inch_m = 0.0254;
constexpr double standard_gravity = 9.80665;

constexpr Unit force_units[] = {
    {1, "lbf", pound_force_N},           {2, "N", 1.0},
    {3, "klbf", 1000.0 * pound_force_N}, {4, "kN", 1000.0},
    {5, "kgf", standard_gravity},        {6, "gf", standard_gravity / 1000.0},
};
constexpr Unit torque_units[] = {
    {1, "lbf-in", pound_force_N* inch_m},
    {2, "lbf-ft", pound_force_N* inch_m * 12.0},
    {3, "Nm", 1.0},
    {4, "Nmm", 0.001},
    {5, "kgf-cm", standard_gravity / 100.0},
    {6, "kNm", 1000.0},
};

template <std::size_t N>
const Unit* find_unit(const Unit (&units)[N], std::uint8_t code) noexcept {
  const auto* unit = std::find_if(std::begin(units), std::end(units), [code](const Unit& u) { return u.code == code; });
  return unit == std::end(units) ? nullptr : unit;
}

struct StatusBit {
  int bit;
  const char* text;
};

// Bits of the status word. Bit 15 is set whenever another bit is set.
constexpr StatusBit status_bits[] = {
    {0, "watchdog reset"},
    {1, "excitation voltage (DAC/ADC check) too high"},
    {2, "excitation voltage (DAC/ADC check) too low"},
    {3, "artificial analog ground out of range"},
    {4, "supply voltage too high"},
    {5, "supply voltage too low"},
    {6, "bad active calibration"},
    {7, "EEPROM failure"},
    {8, "configuration invalid"},
    {9, "reserved bit 9"},
    {10, "reserved bit 10"},
    {11, "sensor temperature too high"},
    {12, "sensor temperature too low"},
    {13, "reserved bit 13"},
    {14, "CAN bus error"},
    {15, "error"},
};

// True if op `answered` is a single-frame answer to another request than `asked`, so it belongs to an earlier request
// that was given up. If such a frame were accepted, it would be stored as part of the calibration.
bool is_of_another_request(std::uint32_t answered, std::uint8_t asked) noexcept {
  const bool is_single =
      answered == op_serial || answered == op_counts || answered == op_units || answered == op_firmware;
  return is_single && answered != asked;
}

std::string timeout_text(const AtiNetCanOemSettings& settings) {
  return std::to_string(settings.answer_timeout_ns / 1'000'000) + " ms";
}

// True if the matrix can't be distinguished from a singular one. Method: Gaussian elimination with complete pivoting,
// after scaling each row to a largest entry of 1, because force and torque rows differ in unit. The threshold follows
// in three steps:
// 1. The entries are floats with a relative error of up to 2⁻²⁴.
// 2. Eliminating six columns adds at most six such errors of the largest entry (1) to the remainder.
// 3. So a pivot below 6·2⁻²⁴ can't be distinguished from zero.
bool is_singular(std::array<std::array<double, 6>, 6> m) noexcept {
  for (auto& row : m) {
    double largest = 0.0;
    for (const double entry : row) largest = std::max(largest, std::abs(entry));
    if (!(largest > 0.0)) return true;
    for (double& entry : row) entry /= largest;
  }
  constexpr double smallest_pivot = 6.0 / 16777216.0;
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t pivot_row = k, pivot_column = k;
    for (std::size_t i = k; i < 6; ++i) {
      for (std::size_t j = k; j < 6; ++j) {
        if (std::abs(m[i][j]) > std::abs(m[pivot_row][pivot_column])) pivot_row = i, pivot_column = j;
      }
    }
    if (!(std::abs(m[pivot_row][pivot_column]) > smallest_pivot)) return true;
    std::swap(m[k], m[pivot_row]);
    for (auto& row : m) std::swap(row[k], row[pivot_column]);
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double factor = m[i][k] / m[k][k];
      for (std::size_t j = k; j < 6; ++j) m[i][j] -= factor * m[k][j];
    }
  }
  return false;
}

}  // namespace

AtiNetCanOem::AtiNetCanOem(AtiNetCanOemSettings settings) : settings_(std::move(settings)) {
  if (settings_.base_id > 0x7F) {
    throw SetupError({.bus = settings_.bus_name,
                      .key = "sensor.base_id",
                      .found = hex_text(settings_.base_id, 2),
                      .expected = "0x00 to 0x7F (the identifiers on the wire are 16 times that, plus 0 to 15)"});
  }
  // If the base id were below 0x08, a poll would have a higher priority than SYNC. Base id 0x08 would put a poll on
  // SYNC's identifier, and base id 0 would send NMT commands.
  if (settings_.base_id < 0x08 + 1) {
    throw SetupError(
        {.bus = settings_.bus_name,
         .key = "sensor.base_id",
         .found = hex_text(settings_.base_id, 2),
         .expected = "0x09 or more",
         .advice = "below it the sensor's frames are NMT commands, outrank SYNC, or are EMCYs of nodes; set another "
                   "base id with the maker's tool"});
  }
}

std::vector<std::uint32_t> AtiNetCanOem::wanted_ids() const {
  std::vector<std::uint32_t> ids;
  for (const std::uint8_t op : std::initializer_list<std::uint8_t>{0, 1, 2, 3, 4, 5, 7, 8, 15}) ids.push_back(id(op));
  return ids;
}

void AtiNetCanOem::refuse(const std::string& what, const std::string& found, const std::string& expected,
                          const std::string& advice) const {
  throw SetupError(
      {.bus = settings_.bus_name,
       .message = "force sensor (ATI Net CAN OEM, base id " + hex_text(settings_.base_id, 2) + "), " + what,
       .found = found,
       .expected = expected,
       .advice = advice});
}

std::vector<CanFrame> AtiNetCanOem::ask(CanNetwork& network, std::size_t bus, const FrameHandler& other,
                                        std::uint8_t op, std::vector<std::uint8_t> data, std::uint8_t frames,
                                        std::uint8_t bytes, const char* what) {
  CanFrame request;
  request.id = id(op);
  request.length = static_cast<std::uint8_t>(data.size());
  std::copy(data.begin(), data.end(), request.data.begin());
  std::string trouble = "no answer";
  bool late = false;
  for (int attempt = 0; attempt < settings_.attempts; ++attempt) {
    std::vector<CanFrame> answer;
    const std::int64_t sent_ns = network.now_ns();
    const std::int64_t deadline_ns = sent_ns + settings_.answer_timeout_ns;
    const SendResult result = network.bus(bus).send(request);
    if (result != SendResult::sent && result != SendResult::queue_full) {
      trouble = result == SendResult::bus_off ? "bus-off" : "an interface that is down or refuses the frame";
      break;
    }
    const FrameHandler handler = [&](std::size_t from, const TimedFrame& received) {
      const CanFrame& frame = received.frame;
      const bool ours = from == bus && frame.id >> 4 == settings_.base_id && !frame.extended && !frame.error;
      if (!ours) {
        if (other) other(from, received);
        return;
      }
      if (is_of_another_request(frame.id & 0xFU, op)) late = true;
      // The frames must come in order and all belong to this request. A late answer to an earlier request starts with a
      // lower op or has another length.
      if (received.time_ns < sent_ns || answer.size() >= frames || frame.id != id(op) + answer.size()) return;
      if (frame.length != bytes) {
        trouble = "an answer of " + std::to_string(frame.length) + " bytes instead of " + std::to_string(bytes);
        return;
      }
      answer.push_back(frame);
    };
    // After a failed attempt, wait until the whole timeout has passed: otherwise a late answer to this attempt could be
    // taken for the answer to the next attempt.
    if (pump_frames(network, deadline_ns, handler,
                    [&](std::int64_t) { return late || answer.size() == frames ? pump_done : deadline_ns; }) &&
        !late) {
      return answer;
    }
    if (late) {
      refuse(what, "answers to earlier requests, which come too late", "each within " + timeout_text(settings_),
             "what holds them back: a gateway, a bus that is full, or a sensor that is still starting up?");
    }
    if (!answer.empty()) trouble = std::to_string(answer.size()) + " of " + std::to_string(frames) + " answer frames";
  }
  refuse(what, trouble, "an answer to op " + hex_text(op, 1),
         "is it powered, is the base id right, and do bitrate, wiring and both terminations (120 ohm) fit?");
}

void AtiNetCanOem::read_matrix(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  for (std::uint8_t row = 0; row < 6; ++row) {
    const auto frames = ask(network, bus, other, op_matrix, {row}, 3, 8, "calibration matrix");
    for (std::size_t column = 0; column < 6; ++column) {
      const double entry = static_cast<double>(read_float_be(&frames[column / 2].data[column % 2 * 4]));
      if (!std::isfinite(entry)) {
        refuse("calibration matrix, row " + std::to_string(row) + ", column " + std::to_string(column),
               description::number_text(entry), "a finite number",
               "no calibration is active: choose one with the maker's tool");
      }
      matrix_[row][column] = entry;
    }
  }
  if (is_singular(matrix_)) {
    refuse("calibration matrix", "a singular matrix", "six independent rows",
           "the active calibration slot is empty or damaged: choose another with the maker's tool");
  }
}

void AtiNetCanOem::read_scale(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  const auto counts = ask(network, bus, other, op_counts, {}, 1, 8, "counts per unit");
  counts_per_unit_ = {read_u32_be(&counts[0].data[0]), read_u32_be(&counts[0].data[4])};
  for (std::size_t i = 0; i < 2; ++i) {
    if (counts_per_unit_[i] == 0) {
      refuse(i == 0 ? "counts per force unit" : "counts per torque unit", "0", "1 or more",
             "the active calibration slot is empty or damaged: choose another with the maker's tool");
    }
  }
  const auto units = ask(network, bus, other, op_units, {}, 1, 2, "unit codes");
  unit_codes_ = {units[0].data[0], units[0].data[1]};
  const Unit* force = find_unit(force_units, unit_codes_[0]);
  const Unit* torque = find_unit(torque_units, unit_codes_[1]);
  if (force == nullptr) {
    refuse("force unit", "code " + std::to_string(unit_codes_[0]), "1 lbf, 2 N, 3 klbf, 4 kN, 5 kgf or 6 gf", "");
  }
  if (torque == nullptr) {
    refuse("torque unit", "code " + std::to_string(unit_codes_[1]),
           "1 lbf-in, 2 lbf-ft, 3 Nm, 4 Nmm, 5 kgf-cm or 6 kNm", "");
  }
  for (std::size_t row = 0; row < 6; ++row) {
    const double scale = row < 3 ? force->si / counts_per_unit_[0] : torque->si / counts_per_unit_[1];
    for (std::size_t column = 0; column < 6; ++column) scaled_[row][column] = matrix_[row][column] * scale;
  }
}

void AtiNetCanOem::check_first_sample(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  const FrameHandler handler = [&](std::size_t from, const TimedFrame& received) {
    const bool ours = from == bus && on_frame(received.frame, received.time_ns);
    if (!ours && other) other(from, received);
  };
  for (int attempt = 0; attempt < settings_.attempts && !fresh_; ++attempt) {
    CanFrame request;
    const std::int64_t now_ns = network.now_ns(), deadline_ns = now_ns + settings_.answer_timeout_ns;
    poll(now_ns, request);
    (void)network.bus(bus).send(request);
    pump_frames(network, deadline_ns, handler, [&](std::int64_t) { return fresh_ ? pump_done : deadline_ns; });
  }
  if (!fresh_) {
    refuse("strain gauges", wrong_lengths_ > 0 ? "answers of a wrong length" : "no whole sample",
           "op 0 with 8 bytes, then op 1 with 6",
           "it answered other requests: is another device using its identifiers?");
  }
  if (!latest_.healthy) {
    refuse("status word", describe_status(latest_.status), "no error",
           "switch the sensor's supply off and on; if the error stays, it needs the maker's service");
  }
}

void AtiNetCanOem::start(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  const auto firmware = ask(network, bus, other, op_firmware, {}, 1, 4, "firmware version");
  firmware_ = std::to_string(firmware[0].data[0]) + "." + std::to_string(firmware[0].data[1]) + "." +
              std::to_string(read_u16_be(&firmware[0].data[2]));
  const auto serial = ask(network, bus, other, op_serial, {}, 1, 8, "serial number");
  serial_.clear();
  for (std::size_t i = 0; i < 8 && serial[0].data[i] != 0; ++i) {
    const std::uint8_t letter = serial[0].data[i];
    serial_ += letter >= 0x20 && letter < 0x7F ? static_cast<char>(letter) : '?';
  }
  read_matrix(network, bus, other);
  read_scale(network, bus, other);
  check_first_sample(network, bus, other);
}

std::string AtiNetCanOem::identity() const {
  const Unit* force = find_unit(force_units, unit_codes_[0]);
  const Unit* torque = find_unit(torque_units, unit_codes_[1]);
  return "ATI Net CAN OEM, serial number " + serial_ + ", firmware " + firmware_ + ", " +
         std::to_string(counts_per_unit_[0]) + " counts/" + (force != nullptr ? force->name : "?") + " and " +
         std::to_string(counts_per_unit_[1]) + " counts/" + (torque != nullptr ? torque->name : "?");
}

std::string AtiNetCanOem::describe_losses() const {
  return losses_text({{wrong_lengths_, "frames of a wrong length"},
                      {late_, "samples late, taken a cycle later where no newer one came"},
                      {incomplete_, "samples incomplete"},
                      {dropped_, "frames too late, repeated or out of order"}});
}

std::string AtiNetCanOem::describe_status(std::uint32_t status) const {
  if (status == 0) return "no error";
  std::string text = "status " + hex_text(status, 4);
  const char* separator = ": ";
  for (const StatusBit& known : status_bits) {
    if ((status >> known.bit & 1) == 0 || (known.bit == 15 && status != 0x8000)) continue;
    text += std::string(separator) + known.text;
    separator = ", ";
  }
  return text;
}

}  // namespace proxarm::fieldbus
