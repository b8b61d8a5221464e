#include "fieldbus/can/candump_log.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>

#include "fieldbus/can/can_timing.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::in_quotes;
using description::SetupError;

constexpr std::string_view digits = "0123456789ABCDEF";
constexpr std::uint32_t error_flag = 0x20000000;  // set in the identifier of an error frame, as in SocketCAN
constexpr unsigned switch_flag = 1;               // CANFD_BRS
constexpr std::size_t longest_line = 4096;        // a longer line is rejected without parsing

class Output {
 public:
  explicit Output(char* at) : begin_(at), at_(at) {}
  void put(char c) noexcept { *at_++ = c; }
  void hex(std::uint32_t value, int count) noexcept {
    for (int i = count - 1; i >= 0; --i) put(digits[(value >> (4 * i)) & 15]);
  }
  void decimal(std::int64_t value, int least_digits) noexcept {
    char text[20];
    const auto end = std::to_chars(text, text + sizeof text, value).ptr;
    for (auto i = end - text; i < least_digits; ++i) put('0');
    for (const char* c = text; c != end; ++c) put(*c);
  }
  [[nodiscard]] std::size_t size() const noexcept { return static_cast<std::size_t>(at_ - begin_); }

 private:
  char* begin_;
  char* at_;
};

void put_frame(Output& out, const CanFrame& frame) noexcept {
  if (frame.error) {
    out.hex((frame.id & 0x1fffffff) | error_flag, 8);
  } else {
    out.hex(frame.id, frame.extended ? 8 : 3);
  }
  out.put('#');
  if (frame.fd) {
    out.put('#');
    out.hex(frame.bit_rate_switch ? switch_flag : 0, 1);
  } else if (frame.remote) {
    out.put('R');
    if (frame.length > 0) out.decimal(std::min<int>(frame.length, 8), 1);
    return;
  }
  const std::size_t bytes = std::min<std::size_t>(frame.length, frame.fd ? 64 : 8);
  for (std::size_t i = 0; i < bytes; ++i) out.hex(frame.data[i], 2);
}

int hex_value(char c) noexcept {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r'; }

// Removes the next word from the text and returns it.
std::string_view take_word(std::string_view& text) noexcept {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  std::size_t length = 0;
  while (length < text.size() && !is_blank(text[length])) ++length;
  const std::string_view word = text.substr(0, length);
  text.remove_prefix(length);
  return word;
}

struct Mistake {
  std::string_view found;
  const char* expected;
};

// Converts a time such as "(1436509052.249713)" to ns.
std::optional<Mistake> parse_time(std::string_view word, std::int64_t& out) noexcept {
  const Mistake mistake{word, "a time such as (1436509052.249713)"};
  if (word.size() < 3 || word.front() != '(' || word.back() != ')') return mistake;
  const char* const end = word.data() + word.size() - 1;
  std::int64_t seconds = 0, fraction = 0;
  const auto whole = std::from_chars(word.data() + 1, end, seconds);
  if (whole.ec != std::errc() || whole.ptr == end || *whole.ptr != '.') return mistake;
  if (seconds < 0 || seconds > 9'000'000'000 || word[1] == '-') return mistake;
  const char* const first = whole.ptr + 1;
  const auto rest = std::from_chars(first, end, fraction);
  const auto count = end - first;
  if (rest.ec != std::errc() || rest.ptr != end || *first == '-' || (count != 6 && count != 9)) return mistake;
  out = seconds * 1'000'000'000 + fraction * (count == 6 ? 1000 : 1);
  return std::nullopt;
}

std::optional<Mistake> parse_identifier(std::string_view word, CanFrame& out) noexcept {
  std::uint32_t id = 0;
  for (const char c : word) {
    const int value = hex_value(c);
    if (value < 0) return Mistake{word, "an identifier of hexadecimal digits"};
    id = (id << 4) | static_cast<std::uint32_t>(value);
  }
  if (word.size() == 3) {
    if (id > 0x7ff) return Mistake{word, "an 11-bit identifier, 000 to 7FF"};
  } else {
    out.error = (id & error_flag) != 0;
    if (id > 0x1fffffff && !(out.error && id <= (error_flag | 0x1fffffff))) {
      return Mistake{word, "a 29-bit identifier, 00000000 to 1FFFFFFF"};
    }
    out.extended = !out.error;
    id &= 0x1fffffff;
  }
  out.id = id;
  return std::nullopt;
}

std::optional<Mistake> parse_data(std::string_view text, CanFrame& out) noexcept {
  const std::size_t room = out.fd ? 64 : 8;
  std::size_t bytes = 0;
  std::string_view rest = text;
  while (!rest.empty() && rest.front() != '_') {
    if (rest.front() == '.') {
      rest.remove_prefix(1);
      continue;
    }
    const int high = hex_value(rest[0]), low = rest.size() > 1 ? hex_value(rest[1]) : -1;
    if (high < 0 || low < 0) return Mistake{text, "pairs of hexadecimal digits"};
    if (bytes == room) return Mistake{text, out.fd ? "at most 64 bytes" : "at most 8 bytes (CAN FD has two #)"};
    out.data[bytes++] = static_cast<std::uint8_t>(high << 4 | low);
    rest.remove_prefix(2);
  }
  if (!rest.empty()) {  // the raw DLC: values of 9 to 15 also mean eight bytes
    if (out.fd || bytes != 8 || rest.size() != 2 || hex_value(rest[1]) < 9) {
      return Mistake{text, "_9 to _F after eight bytes only"};
    }
  }
  if (!is_valid_length(static_cast<int>(bytes), out.fd)) {
    return Mistake{text, "a length of CAN FD: 0 to 8, 12, 16, 20, 24, 32, 48 or 64 bytes"};
  }
  out.length = static_cast<std::uint8_t>(bytes);
  return std::nullopt;
}

std::optional<Mistake> parse_remote(std::string_view text, CanFrame& out) noexcept {
  out.remote = true;
  text.remove_prefix(1);
  if (text.empty()) return std::nullopt;
  if (text.size() >= 1 && text[0] >= '0' && text[0] <= '8') {
    out.length = static_cast<std::uint8_t>(text[0] - '0');
    if (text.size() == 1) return std::nullopt;
    if (out.length == 8 && text.size() == 3 && text[1] == '_' && hex_value(text[2]) >= 9) return std::nullopt;
  }
  return Mistake{text, "R, or R and a length from 0 to 8"};
}

std::optional<Mistake> parse_frame(std::string_view word, CanFrame& out) noexcept {
  out = {};
  const std::size_t mark = word.find('#');
  if (mark != 3 && mark != 8) {
    return Mistake{word, "a frame such as 123#DEADBEEF: 3 or 8 digits of identifier, #, data"};
  }
  if (auto mistake = parse_identifier(word.substr(0, mark), out)) return mistake;
  std::string_view text = word.substr(mark + 1);
  if (text.empty()) return std::nullopt;
  if (text.front() == '#') {
    const int flags = text.size() > 1 ? hex_value(text[1]) : -1;
    if (flags < 0 || out.error) return Mistake{word, "one digit of flags after ##"};
    out.fd = true;
    out.bit_rate_switch = (static_cast<unsigned>(flags) & switch_flag) != 0;
    return parse_data(text.substr(2), out);
  }
  if (text.front() == 'R' || text.front() == 'r') return parse_remote(text, out);
  return parse_data(text, out);
}

std::optional<Mistake> parse_line(std::string_view text, CandumpEntry& out) {
  if (auto mistake = parse_time(take_word(text), out.time_ns)) return mistake;
  const std::string_view interface = take_word(text);
  if (interface.empty()) return Mistake{interface, "the name of an interface after the time"};
  const std::string_view frame = take_word(text);
  if (auto mistake = parse_frame(frame, out.frame)) return mistake;
  const std::string_view direction = take_word(text);
  if (!direction.empty() && direction != "R" && direction != "T") return Mistake{direction, "R or T after the frame"};
  const std::string_view more = take_word(text);
  if (!more.empty()) return Mistake{more, "the end of the line"};
  out.interface = interface;
  return std::nullopt;
}

}  // namespace

std::size_t format_candump_line(CandumpLine& out, std::int64_t time_ns, std::string_view interface,
                                const CanFrame& frame) noexcept {
  Output output(out.data());
  const std::int64_t time_us = std::max<std::int64_t>(time_ns, 0) / 1000;
  output.put('(');
  output.decimal(time_us / 1'000'000, 10);
  output.put('.');
  output.decimal(time_us % 1'000'000, 6);
  output.put(')');
  output.put(' ');
  for (const char c : interface.empty() ? std::string_view("can") : interface.substr(0, 15)) {
    output.put(static_cast<unsigned char>(c) <= ' ' ? '_' : c);
  }
  output.put(' ');
  put_frame(output, frame);
  output.put('\n');
  return output.size();
}

CandumpLogWriter::CandumpLogWriter(const std::string& path, std::int64_t epoch_ns)
    : path_(path), epoch_ns_(epoch_ns), file_(std::fopen(path.c_str(), "we")) {
  if (!file_) {
    throw SetupError({.file = path, .message = std::string("cannot write the CAN log: ") + std::strerror(errno)});
  }
  std::setvbuf(file_.get(), nullptr, _IOFBF, 1 << 16);
}

void CandumpLogWriter::write(std::int64_t time_ns, std::string_view interface, const CanFrame& frame) noexcept {
  if (!file_) return;
  CandumpLine line;
  const std::size_t size = format_candump_line(line, time_ns + epoch_ns_, interface, frame);
  if (std::fwrite(line.data(), 1, size, file_.get()) != size) failed_ = true;
}

void CandumpLogWriter::finish() {
  if (!file_) return;
  if (std::fclose(file_.release()) != 0) failed_ = true;
  if (failed_) throw SetupError({.file = path_, .message = "the CAN log could not be written completely: disk full?"});
}

CandumpLogReader::CandumpLogReader(std::istream& stream, std::string name) : stream_(stream), name_(std::move(name)) {}

bool CandumpLogReader::next(CandumpEntry& out) {
  while (std::getline(stream_, text_)) {
    ++line_;
    std::string_view rest = text_;
    while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
    if (rest.empty() || rest.front() == '#') continue;
    std::optional<Mistake> mistake;
    if (rest.size() > longest_line) {
      mistake = Mistake{rest, "a line of candump -L"};
    } else {
      mistake = parse_line(rest, out);
    }
    if (!mistake) return true;
    throw SetupError({.file = name_, .line = line_, .found = in_quotes(mistake->found), .expected = mistake->expected});
  }
  return false;
}

std::vector<CandumpEntry> read_candump_log(const std::string& path) {
  std::ifstream file(path);
  if (!file)
    throw SetupError({.file = path, .message = std::string("cannot read the CAN log: ") + std::strerror(errno)});
  CandumpLogReader reader(file, path);
  std::vector<CandumpEntry> entries;
  CandumpEntry entry;
  while (reader.next(entry)) entries.push_back(entry);
  if (file.bad()) throw SetupError({.file = path, .message = "cannot read the CAN log (is it a folder?)"});
  return entries;
}

}  // namespace proxarm::fieldbus
