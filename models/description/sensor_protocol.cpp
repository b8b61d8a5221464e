#include "models/description/sensor_protocol.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "models/description/dbc_file.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {
namespace {

constexpr std::array<const char*, 6> components{"fx", "fy", "fz", "tx", "ty", "tz"};

// A value that a sensor's file leaves to the cell. It is the cell's value or the default.
struct Setting {
  std::int64_t value = 0;
  bool is_identifier = false;
};

struct Reader {
  const YamlNode& root;
  SensorProtocol& protocol;
  const SensorChoices& choices;
  std::map<std::string, Setting> settings{};
  bool big_endian = true;
  std::optional<DbcFile> dbc{};
  std::vector<const DbcMessage*> messages{};  // one for each frame; null if the frame states its own identifier

  void read_settings() {
    if (const auto node = root.find_map("settings")) {
      protocol.has_settings = true;
      const Pattern pattern{"[A-Za-z].*", "a setting whose name begins with a letter"};
      for (const std::string& name : names_like(*node, pattern))
        settings.emplace(name, read_setting(node->map(name), name));
    }
    for (const SensorSettingChoice& choice : choices.settings) {
      if (settings.contains(choice.name)) continue;
      std::string names;
      for (const auto& [name, setting] : settings) names += (names.empty() ? "" : ", ") + name;
      throw SetupError({.file = choices.file.string(),
                        .line = choice.line,
                        .key = "sensor.settings",
                        .found = in_quotes(choice.name),
                        .expected = names.empty()
                                        ? "none: " + root.file().filename().string() + " has no settings"
                                        : "one of those of " + root.file().filename().string() + ": " + names});
    }
  }

  [[nodiscard]] Setting read_setting(const YamlNode& node, const std::string& name) const {
    constexpr std::int64_t most = 0xFFFFFFFF;
    const std::int64_t min = node.integer("min", 0, most), max = node.integer("max", min, most);
    Setting setting{node.integer("default", min, max)};
    static_cast<void>(node.string("means"));
    for (const SensorSettingChoice& choice : choices.settings) {
      if (choice.name != name) continue;
      if (choice.value < min || choice.value > max) {
        throw SetupError(
            {.file = choices.file.string(),
             .line = choice.line,
             .key = "sensor.settings." + name,
             .found = std::to_string(choice.value),
             .expected = std::to_string(min) + " to " + std::to_string(max) + " (" + node.string("means") + ")"});
      }
      setting.value = choice.value;
    }
    return setting;
  }

  [[nodiscard]] std::map<std::string, Setting>::const_iterator setting_named(const YamlNode& node) const {
    return settings.empty() || !node.is_scalar() ? settings.end() : settings.find(node.as_string());
  }

  // Returns a number, or the value of the setting that `node` names.
  [[nodiscard]] std::int64_t number_of(const YamlNode& node, std::int64_t min, std::int64_t max) const {
    const auto named = setting_named(node);
    if (named == settings.end()) return node.as_integer(min, max);
    const std::int64_t value = named->second.value;
    if (value >= min && value <= max) return value;
    throw node.error("a setting of " + std::to_string(min) + " to " + std::to_string(max),
                     named->first + " = " + std::to_string(value));
  }

  // Returns the signal with the name in `node` from the DBC file. `at` becomes the first byte of the signal's frame in
  // the sample.
  [[nodiscard]] const DbcSignal* find_signal(const YamlNode& node, std::size_t& at) const {
    const std::string name = node.string("signal");
    at = 0;
    for (std::size_t i = 0; i < messages.size(); ++i) {
      const DbcSignal* signal = messages[i] != nullptr ? messages[i]->find(name) : nullptr;
      if (signal != nullptr && (signal->multiplexed || signal->length > 32)) {
        throw node.error_at("signal", "one of up to 32 bits that is always in its message");
      }
      if (signal != nullptr) return signal;
      at += protocol.frames[i].bytes;
    }
    throw node.error_at("signal", "a signal of the messages that `frames` names");
  }

  void read_message(const YamlNode& node, SampleFrame& frame) {
    if (!dbc) throw node.error_at("message", "the key `dbc` with a file beside it, at the top");
    const DbcMessage* message = dbc->find(node.string("message"));
    if (message == nullptr) throw node.error_at("message", "a message of " + dbc->file.filename().string());
    if (!message->mistake.empty()) throw SetupError({.message = message->mistake});
    if (message->extended != protocol.extended) {
      throw node.error_at("message",
                          protocol.extended ? "one of 29 bits" : "one of 11 bits, or format: {extended: true}");
    }
    frame.id = message->id;
    frame.bytes = message->bytes;
    messages.push_back(message);
  }

  [[nodiscard]] bool read_order(const YamlNode& node, bool otherwise) const {
    return node.choice_or("byte_order", otherwise ? "big_endian" : "little_endian", {"big_endian", "little_endian"}) ==
           "big_endian";
  }

  // Reads the place of a number. Throws SetupError unless the number is within the first `within` bytes.
  [[nodiscard]] NumberField read_number(const YamlNode& node, std::size_t within) const {
    if (!node.has("signal")) return read_place(node, within);
    std::size_t at = 0;
    NumberField number = find_signal(node, at)->number;
    number.byte += at;
    return number;
  }

  // Does what read_number() does, for a number that has no signal in a DBC file.
  [[nodiscard]] NumberField read_place(const YamlNode& node, std::size_t within) const {
    NumberField number;
    if (protocol.registers) {
      const std::int64_t first = protocol.registers->at, last = first + protocol.registers->count - 1;
      within = 2 * static_cast<std::size_t>(protocol.registers->count);  // the frame may be longer than the registers
      number.byte = 2 * static_cast<std::size_t>(node.integer("register", first, last) - first);
      number.bits = static_cast<int>(node.integer_or("bits", 16, 1, 32));
    } else {
      number.byte = static_cast<std::size_t>(node.integer("byte", 0, static_cast<std::int64_t>(within) - 1));
      number.bits = static_cast<int>(node.integer("bits", 1, 32));
    }
    number.shift = static_cast<int>(node.integer_or("shift", 0, 0, 7));
    number.big_endian = read_order(node, big_endian);
    const std::string type = node.choice_or("type", "unsigned", {"unsigned", "signed", "float"});
    number.kind = type == "signed"  ? NumberKind::signed_integer
                  : type == "float" ? NumberKind::real
                                    : NumberKind::unsigned_integer;
    if (number.kind == NumberKind::real && (number.bits != 32 || number.shift != 0)) {
      throw node.error_at("bits", "32 for a float, with shift 0");
    }
    if (number.byte + number.bytes() > within) {
      throw node.error_at("byte", "a number that ends within the " + std::to_string(within) + " bytes",
                          "one that ends after byte " + std::to_string(number.byte + number.bytes() - 1));
    }
    return number;
  }

  // Notes that a setting is an identifier. Throws SetupError if another identifier has the same value.
  void note_identifier(const std::string& name) {
    Setting& setting = settings[name];
    setting.is_identifier = true;
    for (const auto& [other_name, other] : settings) {
      if (other_name == name || !other.is_identifier || other.value != setting.value) continue;
      const bool chosen = !choices.settings.empty();
      throw SetupError({.file = (chosen ? choices.file : root.file()).string(),
                        .line = chosen ? choices.settings.front().line : 0,
                        .key = chosen ? "sensor.settings" : "settings",
                        .found = std::min(name, other_name) + " and " + std::max(name, other_name) +
                                 " with one value, " + std::to_string(setting.value),
                        .expected = "identifiers that differ"});
    }
  }

  [[nodiscard]] std::uint32_t read_id(const YamlNode& node) {
    const YamlNode id = node.at("id");
    const auto named = setting_named(id);
    if (named != settings.end()) note_identifier(named->first);
    return static_cast<std::uint32_t>(number_of(id, 0, protocol.extended ? 0x1FFFFFFF : 0x7FF));
  }

  [[nodiscard]] std::vector<std::uint8_t> read_bytes(const YamlNode& node, std::string_view key, std::size_t most,
                                                     std::size_t least = 0) const {
    std::vector<std::uint8_t> bytes;
    for (const YamlNode& item : node.list(key, least, most)) {
      bytes.push_back(static_cast<std::uint8_t>(number_of(item, 0, 255)));
    }
    return bytes;
  }

  void read_format() {
    big_endian = read_order(root, true);
    if (root.has("datagrams")) return;  // these keys are those of CAN frames
    if (const auto format = root.find_map("format")) {
      protocol.extended = format->boolean_or("extended", false);
      protocol.fd = format->boolean_or("fd", false);
      protocol.bit_rate_switch = format->boolean_or("bit_rate_switch", false);
      if (protocol.bit_rate_switch && !protocol.fd) throw format->error_at("bit_rate_switch", "fd: true along with it");
    }
    if (const auto base = root.find_map("base_id")) {
      protocol.has_base_id = true;
      protocol.base_id_min = static_cast<std::uint32_t>(base->integer("min", 0, 0x1FFFFFFF));
      protocol.base_id_max = static_cast<std::uint32_t>(base->integer("max", protocol.base_id_min, 0x1FFFFFFF));
      protocol.base_id_step = static_cast<std::uint32_t>(base->integer_or("step", 1, 1, 0x1000000));
    }
    if (root.has("dbc")) dbc = load_dbc(protocol.dbc = root.existing_file("dbc"));
  }

  [[nodiscard]] SampleFrame read_frame(const YamlNode& node) {
    SampleFrame frame;
    const bool named = node.has("message");
    if (named) {
      read_message(node, frame);
    } else {
      messages.push_back(nullptr);
      frame.id = read_id(node);
    }
    const auto capacity = static_cast<std::int64_t>(protocol.frame_capacity());
    // The possible lengths of CAN FD frames.
    const std::vector<std::int64_t> lengths{1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    const auto bytes = named ? std::int64_t{frame.bytes} : integer_of(node, "bytes", lengths);
    if (bytes < 1 || bytes > capacity) {
      throw node.error_at(named ? "message" : "bytes", "one of 1 to " + std::to_string(capacity) + " bytes");
    }
    if (std::find(lengths.begin(), lengths.end(), bytes) == lengths.end()) {
      throw node.error_at("message", "a length of CAN FD: up to 8, 12, 16, 20, 24, 32, 48 or 64");
    }
    frame.bytes = static_cast<std::uint8_t>(bytes);
    if (node.has("starts_with")) frame.starts_with = read_bytes(node, "starts_with", frame.bytes);
    return frame;
  }

  [[nodiscard]] SensorSignal read_signal(const YamlNode& node) const {
    SensorSignal signal;
    signal.number = read_number(node, protocol.sample_bytes());
    double scale = 1.0, offset = 0.0;
    if (node.has("signal")) {
      std::size_t at = 0;
      const DbcSignal* named = find_signal(node, at);
      scale = named->factor;
      offset = named->offset;
      if (!named->unit.empty() && named->unit != "N" && named->unit != "Nm" && !node.has("scale")) {
        throw node.error_at("signal", "a signal in N or Nm, or a `scale` and `offset` of your own that make it so",
                            "one in " + in_quotes(named->unit));
      }
    }
    if (node.has("divisor")) {
      refuse_key(node, "scale", "either `divisor` or `scale`");
      scale = 1.0 / static_cast<double>(number_of(node.at("divisor"), 1, 1'000'000'000));
    }
    signal.scale = node.number_or("scale", scale, -1e9, 1e9);
    if (signal.scale == 0.0) throw node.error_at("scale", "a number other than 0");
    signal.offset = node.number_or("offset", offset, -1e9, 1e9);
    signal.saturated_below = node.number_or("saturated_below", signal.number.lowest(), -1e12, 1e12);
    signal.saturated_above = node.number_or("saturated_above", signal.number.highest(), -1e12, 1e12);
    return signal;
  }

  // Reads the registers. They count as one frame that is long enough for all of them; the frame's identifier is unused.
  void read_registers() {
    const YamlNode node = root.map("registers");
    SensorRegisters registers;
    registers.at = static_cast<std::uint16_t>(node.integer("at", 0, 0xFFFF));
    registers.count = static_cast<int>(node.integer("count", 1, max_sensor_registers));
    if (registers.at + registers.count > 0x10000) throw node.error_at("count", "no register above 65535");
    registers.response_timeout_s = node.number_or("response_timeout_s", registers.response_timeout_s, 0.001, 1.0);
    protocol.registers = registers;
    protocol.fd = true;
    constexpr int lengths[] = {2, 4, 6, 8, 12, 16, 20, 24, 32, 48, 64};
    const int* length =
        std::find_if(std::begin(lengths), std::end(lengths), [&](int bytes) { return bytes >= 2 * registers.count; });
    protocol.frames.push_back({.id = 1, .bytes = static_cast<std::uint8_t>(*length), .starts_with = {}});
    messages.push_back(nullptr);
  }

  // Reads the datagrams. Each counts as one frame; its identifier is unused.
  void read_datagrams() {
    const YamlNode node = root.map("datagrams");
    protocol.fd = true;  // a frame with room for 64 bytes
    const auto bytes = node.integer("bytes", 1, static_cast<std::int64_t>(protocol.frame_capacity()));
    protocol.datagrams = SensorDatagrams{.port = static_cast<int>(node.integer("port", 1, 65535))};
    protocol.frames.push_back({.id = 1, .bytes = static_cast<std::uint8_t>(bytes), .starts_with = {}});
    messages.push_back(nullptr);
  }

  void read_frames() {
    if (root.has("registers")) return read_registers();
    if (root.has("datagrams")) return read_datagrams();
    for (const YamlNode& node : root.list("frames", 1, max_sample_frames)) protocol.frames.push_back(read_frame(node));
    if (protocol.sample_bytes() > max_sample_bytes) throw root.error_at("frames", "up to 256 bytes in all");
    // The first frame must differ from all other frames by its identifier, its length or its first bytes.
    for (std::size_t i = 1; i < protocol.frames.size(); ++i) {
      const SampleFrame &first = protocol.frames[0], &other = protocol.frames[i];
      if (first.id == other.id && first.bytes == other.bytes && first.starts_with.empty()) {
        throw root.error_at("frames", "a first frame that can be told from the others",
                            "frame " + std::to_string(i + 1) + " looks like it",
                            "give the first one `starts_with`, or another identifier");
      }
    }
  }

  void read_signals() {
    if (!root.has("matrix")) {
      const YamlNode signals = root.map("signals");
      for (const char* name : components) protocol.signals.push_back(read_signal(signals.map(name)));
      return;
    }
    for (const YamlNode& node : root.list("signals", 1, max_sensor_signals)) {
      protocol.signals.push_back(read_signal(node));
    }
    const std::size_t columns = protocol.signals.size();
    protocol.matrix_columns.resize(columns);
    const auto rows = root.list("matrix", 6, 6);
    for (std::size_t row = 0; row < 6; ++row) {
      const auto entries = rows[row].as_numbers(columns, columns, between(-1e12, 1e12));
      for (std::size_t column = 0; column < columns; ++column) protocol.matrix_columns[column][row] = entries[column];
    }
  }

  void read_status() {
    const auto node = root.find_map("status");
    if (!node) return;
    SensorStatus status;
    status.number = read_number(*node, protocol.sample_bytes());
    status.error_mask = static_cast<std::uint32_t>(node->integer_or("error_mask", 0xFFFFFFFF, 0, 0xFFFFFFFF));
    status.overload_mask = static_cast<std::uint32_t>(node->integer_or("overload_mask", 0, 0, 0xFFFFFFFF));
    if (const auto names = node->find_map("bits_named")) {
      for (const std::string& key : names_like(*names, {"[0-2]?[0-9]|3[01]", "the number of a bit, 0 to 31,"})) {
        status.bits_named.emplace_back(std::stoi(key), names->string(key));
      }
    }
    protocol.status = std::move(status);
  }

  void read_checksum() {
    const auto node = root.find_map("checksum");
    if (!node) return;
    SensorChecksum sum;
    const std::string kind = node->choice("kind", {"sum8", "sum16", "xor8", "crc8", "crc16"});
    sum.kind = kind == "sum8"    ? ChecksumKind::sum8
               : kind == "sum16" ? ChecksumKind::sum16
               : kind == "xor8"  ? ChecksumKind::xor8
               : kind == "crc8"  ? ChecksumKind::crc8
                                 : ChecksumKind::crc16;
    const bool wide = sum.kind == ChecksumKind::sum16 || sum.kind == ChecksumKind::crc16;
    const auto size = static_cast<std::int64_t>(protocol.sample_bytes());
    const std::int64_t width = wide ? 2 : 1;
    if (size <= width) throw node->error("a sample that is longer than its checksum");
    sum.number.byte = static_cast<std::size_t>(node->integer("byte", 0, size - width));
    sum.number.bits = wide ? 16 : 8;
    sum.number.big_endian = read_order(*node, big_endian);
    sum.from = static_cast<std::size_t>(node->integer("from", 0, size - 1));
    sum.to = static_cast<std::size_t>(node->integer("to", static_cast<std::int64_t>(sum.from) + 1, size));
    if (sum.number.byte < sum.to && sum.number.byte + sum.number.bytes() > sum.from) {
      throw node->error_at("byte", "a checksum outside of the bytes that it is of");
    }
    if (kind == "crc8" || kind == "crc16") {
      const std::int64_t most = wide ? 0xFFFF : 0xFF;
      sum.polynomial = static_cast<std::uint32_t>(node->integer("polynomial", 1, most));
      sum.initial = static_cast<std::uint32_t>(node->integer_or("initial", 0, 0, most));
    }
    protocol.checksum = sum;
  }

  [[nodiscard]] std::optional<SensorCommand> read_command(const YamlNode& from, std::string_view key) {
    const auto node = from.find_map(key);
    if (!node) return std::nullopt;
    SensorCommand command;
    command.id = read_id(*node);
    command.data = read_bytes(*node, "data", 64);
    command.sum16 = node->boolean_or("sum16", false);
    if (key != "rate") {
      refuse_key(*node, "value", "no value but in the command `rate`");
    } else if (const auto value = node->find_map("value")) {
      if (command.data.empty()) throw node->error_at("data", "bytes that hold the value");
      command.value = read_number(*value, command.data.size());
      command.divides_Hz = node->number("divides_Hz", above(0.0, 1e9));
    }
    return command;
  }

  void read_conversation() {
    if (protocol.datagrams) return read_stream();
    protocol.poll = read_command(root, "poll");
    if (protocol.poll && protocol.poll->data.size() + (protocol.poll->sum16 ? 2U : 0U) > protocol.frame_capacity()) {
      throw root.error_at("poll", "a poll of one frame");
    }
    if (!protocol.poll) protocol.rate_Hz = root.number("rate_Hz", above(0.0, 1e5));
    const double half_period_s = protocol.poll ? 5e-3 : 0.5 / protocol.rate_Hz;
    protocol.together_s = 1e-6 * root.number_or("together_us", 1e6 * half_period_s, above(0.0, 1e6));
    const auto commands = root.find_map("commands");
    if (!commands) return;
    protocol.stop = read_command(*commands, "stop");
    protocol.clear_bias = read_command(*commands, "clear_bias");
    protocol.bias = read_command(*commands, "bias");
    protocol.rate = read_command(*commands, "rate");
    protocol.start = read_command(*commands, "start");
    check_rate(*commands);
  }

  // Reads the stream of a sensor on UDP, which must be started and can be stopped.
  void read_stream() {
    constexpr std::int64_t fastest_Hz = 20'000;
    const YamlNode rate = root.at("rate_Hz");
    protocol.rate_Hz = setting_named(rate) == settings.end() ? root.number("rate_Hz", above(0.0, fastest_Hz))
                                                             : static_cast<double>(number_of(rate, 1, fastest_Hz));
    protocol.together_s = 0.5 / protocol.rate_Hz;
    const YamlNode commands = root.map("commands");
    protocol.stop = read_datagram(commands.map("stop"));
    protocol.start = read_datagram(commands.map("start"));
  }

  [[nodiscard]] SensorCommand read_datagram(const YamlNode& node) const {
    SensorCommand command;
    command.id = 1;
    command.data = read_bytes(node, "data", 64, 1);
    return command;
  }

  void check_rate(const YamlNode& commands) const {
    if (!protocol.rate || !protocol.rate->value) return;
    if (protocol.poll) throw commands.error_at("rate", "no rate for a sensor that is polled");
    const double value = std::round(protocol.rate->divides_Hz / protocol.rate_Hz);
    if (value < 1.0 || value > protocol.rate->value->highest()) {
      throw root.error_at("rate_Hz", "a rate whose code, divides_Hz / rate_Hz, is from 1 to " +
                                         number_text(protocol.rate->value->highest()));
    }
    // A sensor's crystal deviates by up to 1 %; a larger difference is a mistake in the file.
    if (std::abs(protocol.rate->divides_Hz / value - protocol.rate_Hz) > 0.01 * protocol.rate_Hz) {
      throw root.error_at("rate_Hz", "a rate that the sensor has: " + number_text(protocol.rate->divides_Hz / value) +
                                         " is the nearest");
    }
  }

  // Returns the bit of the sample that holds bit j of a number. It is `shift + j` bits above the lowest bit of the
  // number's lowest byte.
  [[nodiscard]] static std::size_t bit_of(const NumberField& number, int j) {
    const auto above = static_cast<std::size_t>(number.shift + j);
    return 8 * (number.big_endian ? number.byte + number.bytes() - 1 - above / 8 : number.byte + above / 8) + above % 8;
  }

  void claim(const YamlNode& node, const std::string& name, const NumberField& number,
             std::map<std::size_t, std::string>& taken) const {
    for (int j = 0; j < number.bits; ++j) {
      const auto [place, free] = taken.emplace(bit_of(number, j), name);
      if (free) continue;
      const char* key = node.has("signal") ? "signal" : protocol.registers ? "register" : "byte";
      throw node.error_at(key, "bits that nothing else has",
                          "bit " + std::to_string(place->first % 8) + " of byte " + std::to_string(place->first / 8) +
                              ", which is " + place->second + "'s");
    }
  }

  void check_overlaps() const {
    std::map<std::size_t, std::string> taken;
    std::size_t at = 0;
    for (const SampleFrame& frame : protocol.frames) {
      for (std::size_t bit = 8 * at; bit < 8 * (at + frame.starts_with.size()); ++bit)
        taken.emplace(bit, "starts_with");
      at += frame.bytes;
    }
    const bool by_name = protocol.matrix_columns.empty();
    const auto listed = by_name ? std::vector<YamlNode>{} : root.list("signals", 1, max_sensor_signals);
    for (std::size_t i = 0; i < protocol.signals.size(); ++i) {
      const YamlNode node = by_name ? root.map("signals").map(components[i]) : listed[i];
      claim(node, by_name ? components[i] : "signal " + std::to_string(i + 1), protocol.signals[i].number, taken);
    }
    if (protocol.counter) claim(root.map("counter"), "counter", *protocol.counter, taken);
    if (protocol.reading_counter) {
      claim(root.map("reading_counter"), "reading_counter", *protocol.reading_counter, taken);
    }
    if (protocol.status) claim(root.map("status"), "status", protocol.status->number, taken);
    if (protocol.checksum) claim(root.map("checksum"), "checksum", protocol.checksum->number, taken);
  }

  void check_identifiers() const {
    const std::uint64_t most = protocol.extended ? 0x1FFFFFFF : 0x7FF;
    const std::uint64_t base = std::uint64_t{protocol.base_id_max} * protocol.base_id_step;
    std::vector<std::uint32_t> ids;
    for (const SampleFrame& frame : protocol.frames) ids.push_back(frame.id);
    for (const auto* command :
         {&protocol.poll, &protocol.stop, &protocol.clear_bias, &protocol.bias, &protocol.rate, &protocol.start}) {
      if (*command) ids.push_back((*command)->id);
    }
    for (const std::uint32_t id : ids) {
      if (id + base > most) throw root.map("base_id").error_at("max", "identifiers that stay within the format's bits");
    }
  }
};

}  // namespace

double NumberField::lowest() const noexcept {
  if (kind == NumberKind::real) return -static_cast<double>(std::numeric_limits<float>::max());
  return kind == NumberKind::signed_integer ? -std::ldexp(1.0, bits - 1) : 0.0;
}

double NumberField::highest() const noexcept {
  if (kind == NumberKind::real) return static_cast<double>(std::numeric_limits<float>::max());
  return std::ldexp(1.0, kind == NumberKind::signed_integer ? bits - 1 : bits) - 1.0;
}

std::size_t SensorProtocol::sample_bytes() const noexcept {
  std::size_t bytes = 0;
  for (const SampleFrame& frame : frames) bytes += frame.bytes;
  return bytes;
}

std::vector<std::uint32_t> SensorProtocol::wire_ids(std::uint32_t base_id) const {
  std::vector<std::uint32_t> ids;
  const auto add = [&](std::uint32_t id) {
    if (std::find(ids.begin(), ids.end(), wire_id(id, base_id)) == ids.end()) ids.push_back(wire_id(id, base_id));
  };
  for (const SampleFrame& frame : frames) add(frame.id);
  for (const auto* command : {&poll, &stop, &clear_bias, &bias, &rate, &start}) {
    if (*command) add((*command)->id);
  }
  return ids;
}

SensorProtocol read_sensor_protocol(const YamlNode& root, const SensorChoices& choices) {
  SensorProtocol protocol;
  Reader reader{root, protocol, choices};
  reader.read_settings();
  reader.read_format();
  reader.read_frames();
  reader.read_signals();
  if (const auto node = root.find_map("counter")) {
    protocol.counter = reader.read_number(*node, protocol.sample_bytes());
    if (protocol.counter->kind != NumberKind::unsigned_integer || protocol.counter->bits < 2) {
      throw node->error("a counter that is unsigned and has 2 bits or more");
    }
  }
  if (const auto node = protocol.datagrams ? root.find_map("reading_counter") : std::nullopt) {
    protocol.reading_counter = reader.read_place(*node, protocol.sample_bytes());
  }
  reader.read_status();
  reader.read_checksum();
  reader.read_conversation();
  reader.check_identifiers();
  reader.check_overlaps();
  return protocol;
}

}  // namespace proxarm::description
