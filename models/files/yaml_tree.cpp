// Builds the tree of a YAML text. Checks size, encoding and tabs. yaml-cpp parses the structure, and its events are
// turned into Items. The events are used because, unlike yaml-cpp's nodes, they show duplicate keys, anchors and depth
// before anything is built from them.
#include "models/files/yaml_tree.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>
#include <unordered_set>
#include <utility>

#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

constexpr std::size_t max_bytes = 16U << 20U;
constexpr auto patience_with_pipes = std::chrono::seconds(2);  // longest total time for reading a pipe
constexpr std::size_t max_depth = 32;
constexpr std::size_t max_key_bytes = 100;
// Largest number of keys in one map. Files have some dozens. More keys would be slow, because the time of a look-up is
// proportional to the number of keys.
constexpr std::size_t max_keys = 1000;

// Largest number of values in one file. A tree of this many values takes about 100 MB.
constexpr std::size_t max_values = 500'000;

// yaml-cpp accepts the end of the file as the end of an unclosed quote. This extra last line makes an unclosed quote
// visible: for YAML the line is a comment, unless it is inside a quote.
constexpr std::string_view last_line = "\n# end of file, unless in quotes: 5bd0d7a1\n";
constexpr std::string_view last_words = "5bd0d7a1";

SetupError mistake(const std::filesystem::path& file, int line, int column, std::string message,
                   std::string advice = {}) {
  return SetupError({.file = file.string(),
                     .line = line,
                     .column = column,
                     .message = std::move(message),
                     .advice = std::move(advice)});
}

// Checks encoding, indentation and control characters.
void check_text(std::string_view text, const std::filesystem::path& file) {
  int line = 1, column = 1;
  bool indentation = true;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0) throw mistake(file, line, column, "found a byte that is not UTF-8", "save the file as UTF-8");
    if (byte == '\t' && indentation) throw mistake(file, line, column, "found a tab in the indentation", "use spaces");
    if ((byte < 0x20 && byte != '\n' && byte != '\r' && byte != '\t') || byte == 0x7f) {
      throw mistake(file, line, column, "found a control character: not a text file");
    }
    indentation = byte == '\n' || (indentation && byte == ' ');
    column = byte == '\n' ? 1 : column + 1;
    line += byte == '\n' ? 1 : 0;
    i += length;
  }
}

// Limits the number of opening brackets in a row ([[[…), because yaml-cpp reads a whole such row before its first
// event. Brackets in quotes and comments count, too.
void check_brackets(std::string_view text, const std::filesystem::path& file) {
  int line = 1;
  std::size_t run = 0;  // opening brackets and indicators in a row, without blanks
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') {
      if (++run > max_depth)
        throw mistake(file, line, 0, "nested deeper than " + std::to_string(max_depth) + " levels");
    } else if (c != ' ' && c != '\n' && c != '\r' && c != '\t' && c != '?' && c != '-' && c != ':') {
      run = 0;
    }
  }
}

// Reads a pipe, such as a shell's <(...). Gives up if the pipe's writer is silent or missing.
std::string read_pipe(const std::filesystem::path& file) {
  using Clock = std::chrono::steady_clock;
  const auto give_up = Clock::now() + patience_with_pipes;
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
  if (descriptor < 0) throw mistake(file, 0, 0, "can't be read", "look at its permissions");
  std::string text;
  std::vector<char> block(65536);
  while (text.size() <= max_bytes) {
    const ssize_t n = ::read(descriptor, block.data(), block.size());
    if (n > 0) text.append(block.data(), static_cast<std::size_t>(n));
    if (n > 0) continue;
    // A named pipe that has no writer yet also reads as ended.
    const bool may_begin = n == 0 && text.empty() && std::filesystem::is_fifo(file);
    if (!may_begin && (n == 0 || (errno != EAGAIN && errno != EINTR))) break;
    if (Clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      continue;
    }
    ::close(descriptor);
    throw mistake(file, 0, 0, "is a pipe from which nothing comes", "is anybody writing to it?");
  }
  ::close(descriptor);
  if (text.size() > max_bytes) throw mistake(file, 0, 0, "is larger than 16 MiB", "is it the right file?");
  return text;
}

std::string read_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  const auto fails = [&](std::string message, std::string advice = {}) {
    return mistake(file, 0, 0, std::move(message), std::move(advice));
  };
  if (status.type() == std::filesystem::file_type::not_found) throw fails("no such file");
  if (std::filesystem::is_directory(status)) throw fails("is a folder", "name a file in it");
  if (status.type() != std::filesystem::file_type::regular) return read_pipe(file);
  std::ifstream in(file, std::ios::binary);
  if (!in) throw fails("can't be read", "look at its permissions");
  std::string text;
  std::vector<char> block(65536);
  while (in) {
    in.read(block.data(), static_cast<std::streamsize>(block.size()));
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > max_bytes) throw fails("is larger than 16 MiB", "is it the right file?");
  }
  if (in.bad()) throw fails("can't be read to its end");
  return text;
}

}  // namespace

std::string number_advice(std::string_view text) {
  std::string_view digits = text;
  if (digits.starts_with('-') || digits.starts_with('+')) digits.remove_prefix(1);
  if (digits.size() > 1 && digits[0] == '0' && digits[1] >= '0' && digits[1] <= '9') {
    return "write it without leading zeros";
  }
  if (digits.find(',') != std::string_view::npos) return "write a decimal point, not a comma";
  // The text is a number followed by letters, such as "3kg" or "5 N".
  const std::size_t end = text.find_first_not_of("+-0123456789.eE");
  if (end != std::string_view::npos && end > 0 && strict_number(text.substr(0, end))) {
    return "write the number alone; the key's name states the unit";
  }
  return {};
}

class YamlNode::Builder : public YAML::EventHandler {
 public:
  explicit Builder(Document& document) : document_(document) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse(mark, {}, anchor);
    if (expects_key()) throw fail(mark, "a key is missing");
    add(mark, Item::Kind::null);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { throw fail(mark, "aliases (*name) are not allowed"); }
  void OnAnchor(const YAML::Mark& mark, const std::string&) override {
    throw fail(mark, "anchors (&name) are not allowed");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse(mark, tag, anchor);
    if (value.find(last_words) != std::string::npos) {
      throw fail(mark, "a quote or a block of text that begins here never ends");
    }
    if (expects_key()) {
      set_key(mark, value);
      return;
    }
    Item& item = add(mark, Item::Kind::scalar);
    item.text = value;
    item.is_quoted = tag == "!";
    if (!item.is_quoted && (value == "~" || value == "null")) item.kind = Item::Kind::null;
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Item::Kind::list);
  }
  void OnSequenceEnd() override { stack_.pop_back(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Item::Kind::map);
  }
  void OnMapEnd() override { stack_.pop_back(); }

 private:
  struct Level {
    Item* item;
    std::unordered_set<std::string> keys{};
    bool has_key = false;  // whether a key was read whose value hasn't been read yet
    std::string key{};
    YAML::Mark key_mark{};
  };

  [[nodiscard]] SetupError fail(const YAML::Mark& mark, std::string message, std::string advice = {}) const {
    return mistake(document_.file, mark.line + 1, mark.column + 1, std::move(message), std::move(advice));
  }

  [[nodiscard]] bool expects_key() const {
    return !stack_.empty() && stack_.back().item->kind == Item::Kind::map && !stack_.back().has_key;
  }

  void refuse(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) const {
    if (anchor != 0) throw fail(mark, "anchors (&name) are not allowed");
    if (!tag.empty() && tag != "?" && tag != "!") throw fail(mark, "tags (!name) are not allowed");
  }

  void set_key(const YAML::Mark& mark, const std::string& key) {
    Level& level = stack_.back();
    if (key.empty()) throw fail(mark, "a key is missing");
    if (key == "<<") throw fail(mark, "merge keys (<<) are not allowed");
    if (key.size() > max_key_bytes || in_quotes(key, max_key_bytes).find("\\x") != std::string::npos) {
      throw fail(mark, "a key must be a word: found " + in_quotes(key));
    }
    if (!level.keys.insert(key).second) {
      int first = 0;
      for (const Item* item : level.item->children) {
        if (item->key == key) first = item->key_line;
      }
      throw fail(mark, "the key " + in_quotes(key) + " stands here twice", "first in line " + std::to_string(first));
    }
    if (level.keys.size() > max_keys) throw fail(mark, "more than " + std::to_string(max_keys) + " keys in one map");
    level.has_key = true;
    level.key = key;
    level.key_mark = mark;
  }

  Item& add(const YAML::Mark& mark, Item::Kind kind) {
    if (document_.items.size() >= max_values) throw fail(mark, "more than 500000 values in the file");
    Item& item = document_.items.emplace_back();
    item.kind = kind;
    item.line = item.key_line = mark.line + 1;
    item.column = item.key_column = mark.column + 1;
    if (stack_.empty()) return item;
    Level& level = stack_.back();
    item.parent = level.item;
    item.index = level.item->children.size();
    if (level.has_key) {
      item.key = std::exchange(level.key, {});
      item.key_line = level.key_mark.line + 1;
      item.key_column = level.key_mark.column + 1;
      level.has_key = false;
      if (kind == Item::Kind::null) {  // yaml-cpp reports an absent value at the next token
        item.line = item.key_line;
        item.column = item.key_column;
      }
    }
    level.item->children.push_back(&item);
    return item;
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Item::Kind kind) {
    refuse(mark, tag, anchor);
    if (expects_key()) throw fail(mark, "a key must be a word", "is a value or a quote missing?");
    if (stack_.size() >= max_depth) {
      throw fail(mark, "nested deeper than " + std::to_string(max_depth) + " levels");
    }
    stack_.push_back({.item = &add(mark, kind)});
  }

  Document& document_;
  std::vector<Level> stack_;
};

YamlNode YamlNode::load(const std::filesystem::path& file) { return parse(read_file(file), file); }

YamlNode YamlNode::parse(std::string_view text, const std::filesystem::path& file) {
  if (text.size() > max_bytes) throw mistake(file, 0, 0, "is larger than 16 MiB", "is it the right file?");
  check_text(text, file);
  check_brackets(text, file);
  auto document = std::make_shared<Document>();
  document->file = file;
  document->folder = std::filesystem::absolute(file).parent_path();
  Builder builder(*document);
  try {
    std::istringstream in(std::string(text).append(last_line));
    YAML::Parser parser(in);
    if (!parser.HandleNextDocument(builder) || document->items.empty() ||
        document->items.front().kind == Item::Kind::null) {
      throw mistake(file, 0, 0, "the file is empty");
    }
    Document rest;
    rest.file = file;
    Builder ignored(rest);
    if (parser.HandleNextDocument(ignored)) throw mistake(file, 0, 0, "more than one document in the file (---)");
  } catch (const YAML::Exception& error) {
    throw mistake(file, error.mark.line + 1, error.mark.column + 1, "not YAML: " + error.msg,
                  "look at indentation, colons and quotes here and just above");
  }
  const Item& root = document->items.front();
  return {std::move(document), root};
}

}  // namespace proxarm::description
