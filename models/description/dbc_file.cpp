#include "models/description/dbc_file.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

constexpr std::size_t max_bytes = 4U << 20, max_messages = 4096, max_signals = 512;
constexpr int max_bytes_of_message = 64;  // the longest data of CAN FD
constexpr std::uint32_t extended_bit = 0x80000000U, unassigned_id = 0xC0000000U;
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
constexpr std::string_view unassigned_name = "VECTOR__INDEPENDENT_SIG_MSG";

// The sections that end a section whose ';' is missing.
constexpr std::string_view known_sections[] = {"BO_",          "SG_",         "CM_",       "VAL_",
                                               "VAL_TABLE_",   "BA_",         "BA_DEF_",   "BA_DEF_DEF_",
                                               "SIG_VALTYPE_", "SG_MUL_VAL_", "BO_TX_BU_", "SIG_GROUP_"};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct Token {
  enum class Kind { end, word, number, string, sign };
  Kind kind = Kind::end;
  std::string_view text;  // without the quotes
  int line = 1;
};

class Reader {
 public:
  Reader(std::string_view text, const std::filesystem::path& file) : rest_(text), file_(file) {
    unassigned_.bytes = max_bytes_of_message;
    if (rest_.starts_with(byte_order_mark)) rest_.remove_prefix(byte_order_mark.size());
    advance();
  }

  DbcFile read() {
    DbcFile dbc;
    dbc.file = file_;
    while (token_.kind != Token::Kind::end) read_section(dbc);
    return dbc;
  }

 private:
  [[nodiscard]] SetupError error(std::string expected) const {
    return SetupError({.file = file_.string(),
                       .line = token_.line,
                       .message = "not DBC",
                       .found = token_.kind == Token::Kind::end ? "the end of the file" : in_quotes(token_.text),
                       .expected = std::move(expected)});
  }

  // ---- Words

  void take(Token::Kind kind, std::size_t length) {
    token_ = {kind, rest_.substr(0, length), line_};
    rest_.remove_prefix(length);
  }

  // Skips blanks, ends of lines and // comments, which some tools write.
  void skip_blanks() {
    for (;;) {
      if (rest_.starts_with("//")) rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
      if (rest_.empty() || (rest_[0] != ' ' && rest_[0] != '\t' && rest_[0] != '\r' && rest_[0] != '\n')) return;
      line_ += rest_[0] == '\n' ? 1 : 0;
      first_in_line_ = first_in_line_ || rest_[0] == '\n';
      rest_.remove_prefix(1);
    }
  }

  void advance() {
    first_in_line_ = false;
    skip_blanks();
    if (rest_.empty()) return take(Token::Kind::end, 0);
    if (rest_[0] == '"') return advance_string();
    const auto length_of = [&](auto belongs) {
      return static_cast<std::size_t>(std::find_if_not(rest_.begin(), rest_.end(), belongs) - rest_.begin());
    };
    if (is_letter(rest_[0])) {
      return take(Token::Kind::word, length_of([](char c) { return is_letter(c) || is_digit(c); }));
    }
    std::size_t before_digits = rest_[0] == '-' || rest_[0] == '+' ? 1 : 0;
    before_digits += rest_.substr(before_digits).starts_with('.') ? 1 : 0;
    if (rest_.size() <= before_digits || !is_digit(rest_[before_digits])) return take(Token::Kind::sign, 1);
    std::size_t length = 1;
    while (length < rest_.size() && (is_digit(rest_[length]) || rest_[length] == '.' || exponent_at(length))) ++length;
    take(Token::Kind::number, length);
  }

  [[nodiscard]] bool exponent_at(std::size_t at) const {
    const char c = rest_[at], before = rest_[at - 1];
    if (c == 'e' || c == 'E') return is_digit(before);
    return (c == '-' || c == '+') && (before == 'e' || before == 'E');
  }

  void advance_string() {
    const int line = line_;
    const std::size_t end = rest_.find('"', 1);
    if (end == std::string_view::npos) {
      take(Token::Kind::sign, 1);
      throw error("a string that ends");
    }
    token_ = {Token::Kind::string, rest_.substr(1, end - 1), line};
    line_ += static_cast<int>(std::count(token_.text.begin(), token_.text.end(), '\n'));
    rest_.remove_prefix(end + 1);
  }

  std::string word(const char* what) {
    if (token_.kind != Token::Kind::word || token_.text.size() > 128) throw error(what);
    std::string text(token_.text);
    advance();
    return text;
  }

  std::string_view string(const char* what) {
    if (token_.kind != Token::Kind::string) throw error(what);
    const std::string_view text = token_.text;
    advance();
    return text;
  }

  void sign(char expected) {
    if (!at_sign(expected)) throw error(std::string("'") + expected + "'");
    advance();
  }

  [[nodiscard]] bool at_sign(char c) const { return token_.kind == Token::Kind::sign && token_.text[0] == c; }

  std::int64_t integer(const char* what, std::int64_t min, std::int64_t max) {
    const auto value = token_.kind == Token::Kind::number ? strict_integer(token_.text) : std::nullopt;
    if (!value || *value < min || *value > max) {
      throw error(std::string(what) + " from " + std::to_string(min) + " to " + std::to_string(max));
    }
    advance();
    return *value;
  }

  double number(const char* what) {
    const auto value = token_.kind == Token::Kind::number ? strict_number(token_.text) : std::nullopt;
    if (!value) throw error(what);
    advance();
    return *value;
  }

  // ---- Sections

  void read_section(DbcFile& dbc) {
    const int line = token_.line;
    const std::string name = word("a section such as BO_");
    if (name == "BO_") return read_or_note(dbc, [&] { read_message(dbc, line); });
    if (name == "SG_") {
      if (current(dbc) == nullptr) throw error("a message (BO_) before its signals");
      return read_or_note(dbc, [&] { read_signal(*current(dbc)); });
    }
    if (name == "SIG_VALTYPE_") return read_type(dbc);
    if (name == "BA_") read_long_name(dbc);
    if (name == "VERSION") return void(string("the version, in quotes"));
    if (name == "NS_") return skip_new_symbols();
    if (name == "BS_") return skip_line(line);
    if (name == "BU_") return skip_nodes(line);
    skip_section(dbc, name);
  }

  // Skips to the ';' that ends the section. If the ';' is missing, stops at the next known section.
  void skip_section(DbcFile& dbc, const std::string& name) {
    while (token_.kind != Token::Kind::end && !at_sign(';') && !(first_in_line_ && begins_known_section())) advance();
    if (!at_sign(';')) {
      dbc.remarks.emplace_back(error("';', which ends " + name).what());
      return;
    }
    sign(';');
  }

  [[nodiscard]] bool begins_known_section() const {
    return token_.kind == Token::Kind::word &&
           std::find(std::begin(known_sections), std::end(known_sections), token_.text) != std::end(known_sections);
  }

  // Reads a name that an editor cut to 32 characters:
  //   BA_ "SystemSignalLongSymbol" SG_ 256 Fx_of_the_sen "Fx_of_the_sensor_at_the_flange"
  // Leaves the rest of this section, and any other BA_ section, to skip_section().
  void read_long_name(DbcFile& dbc) {
    if (token_.kind != Token::Kind::string) return;
    const bool of_signal = token_.text == "SystemSignalLongSymbol",
               of_message = token_.text == "SystemMessageLongSymbol";
    if (!of_signal && !of_message) return;
    advance();
    if (token_.kind != Token::Kind::word) return;
    advance();
    const auto number = token_.kind == Token::Kind::number ? strict_integer(token_.text) : std::nullopt;
    if (!number) return;
    advance();
    std::string_view cut;
    if (of_signal) {
      if (token_.kind != Token::Kind::word) return;
      cut = token_.text;
      advance();
    }
    if (token_.kind != Token::Kind::string || token_.text.size() > 128) return;
    for (DbcMessage& message : dbc.messages) {
      const std::uint32_t id = message.id | (message.extended ? extended_bit : 0U);
      if (*number != std::int64_t{id}) continue;
      if (of_message) message.long_name = std::string(token_.text);
      for (DbcSignal& signal : message.signals) {
        if (of_signal && signal.name == cut) signal.long_name = std::string(token_.text);
      }
    }
  }

  // Returns the message to which the next signals belong.
  DbcMessage* current(DbcFile& dbc) {
    if (in_unassigned_) return &unassigned_;
    return dbc.messages.empty() ? nullptr : &dbc.messages.back();
  }

  // Calls read(). Stores an error with the current message, and continues at the next line that begins a section.
  template <typename Read>
  void read_or_note(DbcFile& dbc, Read read) {
    try {
      read();
    } catch (const SetupError& mistake) {
      dbc.remarks.emplace_back(mistake.what());
      if (DbcMessage* message = current(dbc); message != nullptr && message->mistake.empty()) {
        message->mistake = mistake.what();
      }
      while (token_.kind != Token::Kind::end && !(first_in_line_ && begins_section())) advance();
    }
  }

  [[nodiscard]] bool begins_section() const { return token_.kind == Token::Kind::word && token_.text.ends_with('_'); }

  // Skips a list of words that begin sections elsewhere. The list ends at BS_ with a colon.
  void skip_new_symbols() {
    sign(':');
    while (token_.kind == Token::Kind::word) {
      std::string_view after = rest_;
      after.remove_prefix(std::min(after.find_first_not_of(" \t\r\n"), after.size()));
      if (token_.text == "BS_" && after.starts_with(':')) return;
      advance();
    }
  }

  // Skips the names of nodes, which may be on several lines.
  void skip_nodes(int line) {
    skip_line(line);
    while (token_.kind == Token::Kind::word && !(first_in_line_ && begins_section())) advance();
  }

  void skip_line(int line) {
    while (token_.kind != Token::Kind::end && token_.line == line) advance();
  }

  // Reads a message, for example: BO_ 256 FORCE: 8 SENSOR
  void read_message(DbcFile& dbc, int line) {
    in_unassigned_ = false;
    if (dbc.messages.size() >= max_messages) throw error("no more than 4096 messages");
    DbcMessage& message = dbc.messages.emplace_back();
    message.line = line;
    message.bytes = max_bytes_of_message;  // until the length is read
    const auto id = static_cast<std::uint32_t>(integer("an identifier", 0, 0xFFFFFFFF));
    message.extended = (id & extended_bit) != 0;
    message.id = id & ~extended_bit;
    const SetupError wrong_id = error("an identifier of 11 bits, or of 29 with bit 31 set");
    message.name = word("the message's name");
    sign(':');
    message.bytes = static_cast<std::uint8_t>(integer("a length", 0, max_bytes_of_message));
    (void)word("the sender's name");
    if (id == unassigned_id || message.name == unassigned_name) {
      dbc.messages.pop_back();
      in_unassigned_ = true;
      return unassigned_.signals.clear();
    }
    if (message.id > (message.extended ? 0x1FFFFFFFU : 0x7FFU)) throw SetupError(wrong_id);
    for (DbcMessage& other : dbc.messages) {
      if (&other == &message || other.name != message.name) continue;
      other.mistake = error("a message that isn't there yet: " + message.name).what();
      throw error("a message that isn't there yet: " + message.name);
    }
  }

  // Reads a signal, for example: SG_ Fx m0 : 7|16@0- (0.01,0) [-300|300] "N" A,B
  void read_signal(DbcMessage& message) {
    DbcSignal signal;
    signal.name = word("the signal's name");
    if (token_.kind == Token::Kind::word) {
      signal.multiplexed = token_.text != "M";
      advance();
    }
    sign(':');
    const auto start = integer("the start bit", 0, 511);
    sign('|');
    signal.length = static_cast<int>(integer("the length in bits", 1, 64));
    sign('@');
    const bool big_endian = integer("the byte order, 0 (Motorola) or 1 (Intel),", 0, 1) == 0;
    const bool is_signed = at_sign('-');
    if (!is_signed && !at_sign('+')) throw error("'+' (unsigned) or '-' (signed)");
    advance();
    place(message, signal, static_cast<int>(start), big_endian);
    signal.number.kind = is_signed ? NumberKind::signed_integer : NumberKind::unsigned_integer;
    sign('(');
    signal.factor = number("the factor");
    sign(',');
    signal.offset = number("the offset");
    sign(')');
    sign('[');
    (void)number("the lowest value");
    sign('|');
    (void)number("the highest value");
    sign(']');
    signal.unit = std::string(string("the unit, in quotes"));
    skip_receivers();
    // Several branches of a multiplexer may use one name. Such signals are dropped, because sensors don't use them.
    const DbcSignal* same = message.find(signal.name);
    if (same != nullptr && same->multiplexed && signal.multiplexed) return;
    if (same != nullptr) throw error("a signal that isn't there yet: " + signal.name);
    if (message.signals.size() >= max_signals) throw error("no more than 512 signals in a message");
    message.signals.push_back(std::move(signal));
  }

  // Skips the receivers. They are separated by commas or blanks, or aren't separated.
  void skip_receivers() {
    bool goes_on = !first_in_line_;
    while (goes_on && (token_.kind == Token::Kind::word || at_sign(','))) {
      const bool comma = at_sign(',');
      advance();
      goes_on = comma || !first_in_line_;
    }
  }

  // Computes the place of a signal from its start bit.
  //   Intel      `start` is the signal's lowest bit.
  //   Motorola   `start` is the highest bit. Bits are numbered 7 .. 0 in byte 0, then 15 .. 8 in byte 1, and so
  //              on. The signal continues towards lower bits and then into the next byte.
  void place(const DbcMessage& message, DbcSignal& signal, int start, bool big_endian) const {
    NumberField& number = signal.number;
    number.big_endian = big_endian;
    number.byte = static_cast<std::size_t>(start / 8);
    const int above = big_endian ? 7 - start % 8 : 0;  // bits of the first byte above the signal
    const int used = big_endian ? above + signal.length : start % 8 + signal.length;
    const int bytes = (used + 7) / 8;
    number.shift = big_endian ? 8 * bytes - used : start % 8;
    number.bits = std::min(signal.length, 32);
    if (number.byte + static_cast<std::size_t>(bytes) > message.bytes) {
      throw error("a signal that ends within the " + std::to_string(message.bytes) + " bytes of " + message.name);
    }
  }

  // Reads the type of a signal, for example: SIG_VALTYPE_ 256 Fx : 1;
  void read_type(DbcFile& dbc) {
    const auto id = static_cast<std::uint32_t>(integer("an identifier", 0, 0xFFFFFFFF));
    const std::string name = word("a signal's name");
    if (at_sign(':')) advance();
    const auto type = integer("0 (integer), 1 (float) or 2 (double)", 0, 2);
    sign(';');
    for (DbcMessage& message : dbc.messages) {
      if (message.id != (id & ~extended_bit) || message.extended != ((id & extended_bit) != 0)) continue;
      for (DbcSignal& signal : message.signals) {
        if (signal.name != name || type == 0) continue;
        if (type == 1 && signal.length != 32) throw error("a float of 32 bits");
        // A double is accepted here, but its 64 bits can't be used.
        if (type == 1) signal.number.kind = NumberKind::real;
        if (type == 2) signal.length = 64;
      }
    }
  }

  DbcMessage unassigned_;
  bool in_unassigned_ = false;
  std::string_view rest_;
  const std::filesystem::path& file_;
  Token token_;
  int line_ = 1;
  bool first_in_line_ = false;  // whether token_ is the first token on its line
};

}  // namespace

const DbcSignal* DbcMessage::find(std::string_view signal) const noexcept {
  const auto found = std::find_if(signals.begin(), signals.end(), [&](const DbcSignal& s) {
    return s.name == signal || (!s.long_name.empty() && s.long_name == signal);
  });
  return found == signals.end() ? nullptr : &*found;
}

const DbcMessage* DbcFile::find(std::string_view message) const noexcept {
  const auto found = std::find_if(messages.begin(), messages.end(), [&](const DbcMessage& m) {
    return m.name == message || (!m.long_name.empty() && m.long_name == message);
  });
  return found == messages.end() ? nullptr : &*found;
}

DbcFile parse_dbc(std::string_view text, const std::filesystem::path& file) {
  if (text.size() > max_bytes) {
    throw SetupError({.file = file.string(), .message = "is larger than 4 MiB", .advice = "is it the right file?"});
  }
  DbcFile dbc = Reader(text, file).read();
  const bool all_lost = std::none_of(dbc.messages.begin(), dbc.messages.end(),
                                     [](const DbcMessage& message) { return message.mistake.empty(); });
  if (all_lost && !dbc.remarks.empty()) throw SetupError({.message = dbc.remarks.front()});
  return dbc;
}

DbcFile load_dbc(const std::filesystem::path& file) {
  std::error_code trouble;
  const auto size = std::filesystem::file_size(file, trouble);
  std::ifstream in(file, std::ios::binary);
  if (trouble || !in) throw SetupError({.file = file.string(), .message = "can't be read"});
  if (size > max_bytes) return parse_dbc(std::string(max_bytes + 1, ' '), file);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return parse_dbc(text, file);
}

}  // namespace proxarm::description
