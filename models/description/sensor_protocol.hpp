// Describes a force sensor's CAN messages as data: with this part of its file, a new sensor needs no code.
//
// A sample is a string of bytes: the data of the sample's frames, concatenated in the order of sending. A number may
// begin in one frame and end in the next frame.
//
//   protocol: described
//   base_id: {min: 0x010, max: 0x7F0, step: 1}   # the cell's sensor.base_id · step is added to every identifier;
//                                                # without this key: identifiers are used as written
//   settings:                                    # differ from unit to unit; the cell states them in sensor.settings
//     command_id: {default: 0x64, min: 1, max: 0x7FF, means: commands}
//                                                # `id`, entries of `data` and `divisor` may be such a name
//   format: {extended: true}                     # identifiers have 29 bits; for CAN FD also fd and bit_rate_switch
//   byte_order: big_endian                       # for numbers that don't state their byte order
//   frames:                                      # the frames of one sample
//     - {id: 0x001, bytes: 8, starts_with: [0xAA, 0x07]}
//     - {id: 0x002, bytes: 6}
//   signals:                                     # value = scale · number + offset, in N and Nm
//     fx: {byte: 0, bits: 16, type: signed, scale: 0.02, offset: 0}   # or divisor: 50
//   matrix: 6 rows                               # with this key, `signals` is a list and wrench = matrix · values
//   counter: {byte: 4, bits: 16}                 # increases by one with each sample
//   status: {byte: 6, bits: 16, error_mask: 0xFC00, overload_mask: 0x03F0, bits_named: {"10": text}}
//   checksum: {kind: sum16, byte: 20, from: 0, to: 20}
//   poll: {id: 0x010, data: []}                  # requests one sample; without this key the sensor streams
//   rate_Hz: 1000                                # rate of the stream
//   commands:                                    # all optional; sent in this order to start the sensor
//     stop, clear_bias, rate, start: {id: 0x102, data: [0x03, 0x01]}   # `bias` too, but it is never sent by itself
// A DBC file (dbc_file.hpp) may supply the places and scales:
//   dbc: my_sensor.dbc
//   frames: [{message: FORCE}, {message: TORQUE}]
//   signals: {fx: {signal: Fx}, ...}             # also for counter, status and checksum
// A sensor on Modbus has registers instead of frames, format, poll and commands. Each register gives two bytes of the
// sample:
//   registers: {at: 180, count: 6, response_timeout_s: 0.05}   # holding registers, numbered from 0; read at rate_Hz
//   signals: {fx: {register: 180, bits: 16, type: signed, scale: 0.01}, ...}   # bits: 16 (the default) or 32
// A sensor on UDP has datagrams instead of frames and format; each datagram is one sample. Its commands have data
// alone:
//   datagrams: {bytes: 36, port: 49152}          # the sensor's port, if the cell doesn't state another
//   reading_counter: {byte: 4, bits: 32}         # the number of the reading; the simulated sensor counts it, nothing
//                                                # judges it
//   rate_Hz: rate                                # a number or, for datagrams, also the name of a setting
//   commands: {stop: {data: [...]}, start: {data: [...]}}
// The bits of a number are placed by two keys: `byte` is the number's first byte in the sample, and `shift` is how many
// bits of the number's lowest byte are below the number.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "models/description/sensor_choices.hpp"

namespace proxarm::description {

class YamlNode;

inline constexpr std::size_t max_sample_bytes = 256;
inline constexpr std::size_t max_sample_frames = 16;
inline constexpr std::size_t max_sensor_signals = 12;
inline constexpr std::size_t max_sensor_registers = 32;

enum class NumberKind : std::uint8_t { unsigned_integer, signed_integer, real };  // real: IEEE 754, 32 bits

struct NumberField {
  std::size_t byte = 0;
  int bits = 16;  // 1..32
  int shift = 0;  // 0..7
  bool big_endian = true;
  NumberKind kind = NumberKind::unsigned_integer;
  [[nodiscard]] std::size_t bytes() const noexcept { return static_cast<std::size_t>((shift + bits + 7) / 8); }
  [[nodiscard]] double lowest() const noexcept;  // lowest value that the bits can represent
  [[nodiscard]] double highest() const noexcept;
};

struct SensorSignal {
  NumberField number;
  double scale = 1.0;  // N or Nm per count; with a matrix, the matrix column's unit per count
  double offset = 0.0;
  // Numbers at or beyond saturated_below or saturated_above are saturated. By default, these are the ends of the range
  // of the bits.
  double saturated_below = 0.0;
  double saturated_above = 0.0;
};

struct SampleFrame {
  std::uint32_t id = 0;
  std::uint8_t bytes = 8;
  std::vector<std::uint8_t> starts_with;
};

enum class ChecksumKind : std::uint8_t { sum8, sum16, xor8, crc8, crc16 };

// A checksum over the bytes `from` to `to` − 1 of the sample. CRCs process the most significant bit first.
struct SensorChecksum {
  ChecksumKind kind = ChecksumKind::sum16;
  NumberField number;
  std::size_t from = 0, to = 0;
  std::uint32_t polynomial = 0, initial = 0;
};

struct SensorStatus {
  NumberField number;
  std::uint32_t error_mask = 0xFFFFFFFF;
  std::uint32_t overload_mask = 0;
  std::vector<std::pair<int, std::string>> bits_named;
};

// A command to the sensor. Data that doesn't fit into one frame continues in the next frame.
struct SensorCommand {
  std::uint32_t id = 0;
  std::vector<std::uint8_t> data;
  bool sum16 = false;                // whether to append the 16-bit sum of all data, high byte first
  std::optional<NumberField> value;  // place of the number round(divides_Hz / rate_Hz) in `data`
  double divides_Hz = 0.0;
};

struct SensorRegisters {
  std::uint16_t at = 0;
  int count = 0;
  double response_timeout_s = 0.05;
};

struct SensorDatagrams {
  int port = 0;  // the sensor's UDP port
};

struct SensorProtocol {
  bool extended = false, fd = false, bit_rate_switch = false;
  // For a sensor on Modbus. `frames` then has one frame with the bytes of the registers.
  std::optional<SensorRegisters> registers;
  // For a sensor on UDP. `frames` then has one frame with the bytes of a datagram.
  std::optional<SensorDatagrams> datagrams;
  bool has_base_id = false, has_settings = false;
  std::uint32_t base_id_min = 0, base_id_max = 0, base_id_step = 1;
  std::vector<SampleFrame> frames;
  std::vector<SensorSignal> signals;                  // fx fy fz tx ty tz, or one signal for each column of the matrix
  std::vector<std::array<double, 6>> matrix_columns;  // empty: there is no matrix
  std::optional<NumberField> counter;
  std::optional<NumberField> reading_counter;  // only for datagrams
  std::optional<SensorStatus> status;
  std::optional<SensorChecksum> checksum;
  std::optional<SensorCommand> poll;
  double rate_Hz = 0.0;     // rate of the stream; 0: a polled sensor
  double together_s = 0.0;  // longest time from a sample's first frame to its last frame
  std::optional<SensorCommand> stop, clear_bias, bias, rate, start;
  std::filesystem::path dbc;  // the DBC file that was read; empty: no DBC file

  [[nodiscard]] std::size_t sample_bytes() const noexcept;
  [[nodiscard]] bool streams() const noexcept { return !poll; }
  [[nodiscard]] bool on_can() const noexcept { return !registers && !datagrams; }
  // Returns the identifier on the wire.
  [[nodiscard]] std::uint32_t wire_id(std::uint32_t id, std::uint32_t base_id) const noexcept {
    return id + base_id * base_id_step;
  }
  // Returns the identifiers of all frames and commands, each once. Identifiers of 29 bits have no flag.
  [[nodiscard]] std::vector<std::uint32_t> wire_ids(std::uint32_t base_id) const;
  [[nodiscard]] std::size_t frame_capacity() const noexcept { return fd ? 64 : 8; }
};

// Reads the file of a sensor with protocol "described". Throws SetupError.
SensorProtocol read_sensor_protocol(const YamlNode& root, const SensorChoices& choices = {});

}  // namespace proxarm::description
