#include "controller/signals/signal_table.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "models/base/setup_error.hpp"
#include "models/files/json.hpp"
#include "models/packed/packed.hpp"

namespace proxarm::controller {
namespace {

using description::Json;
using description::SetupError;
using Form = SignalColumn::Form;

static_assert(std::endian::native == std::endian::little, "signals.bin is written as memory has it");

constexpr std::string_view magic = "PXSIGNAL";
constexpr std::uint32_t plain_version = 1, packed_version = 2;
constexpr std::size_t page_bytes = 4096;
constexpr std::size_t rows_of_block = SignalTableWriter::apart;
static_assert(rows_of_block == page_bytes / sizeof(double));
// Number of rows that are written at once; as many as the buffer of signals.csv holds.
constexpr std::size_t rows_at_once = 64;
constexpr std::size_t json_begins_at = 24;
// Largest number of rows per block that is read, far above the number that is written. Bounds the memory that a damaged
// head can request.
constexpr std::size_t most_block_rows = 1 << 16;
constexpr std::array<std::pair<Form, const char*>, 5> forms{{{Form::number, "number"},
                                                             {Form::integer, "integer"},
                                                             {Form::seconds, "seconds"},
                                                             {Form::word, "word"},
                                                             {Form::flags, "flags"}}};

// Returns the words joined by bars, like the flags of signals.csv. No word contains a bar.
std::string joined(const std::vector<std::string>& words) {
  std::string text = words[0];
  for (std::size_t i = 1; i < words.size(); ++i) text += "|" + words[i];
  return text;
}

std::vector<std::string> parted(std::string_view text) {
  std::vector<std::string> words;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t bar = std::min(text.find('|', from), text.size());
    words.emplace_back(text.substr(from, bar - from));
    from = bar + 1;
  }
  return words;
}

std::string table_head(const std::vector<SignalColumn>& columns, std::uint32_t version) {
  Json list = Json::array();
  for (const SignalColumn& column : columns) {
    Json one{{"name", column.name}};
    for (const auto& [form, name] : forms) {
      if (form == column.form) one["form"] = name;
    }
    if (!column.words.empty()) one["words"] = joined(column.words);
    list.push_back(std::move(one));
  }
  Json json = Json::object();
  json["columns"] = std::move(list);
  const std::string text = json.dump();
  const std::size_t bytes = (json_begins_at + text.size() + page_bytes - 1) / page_bytes * page_bytes;
  const std::array<std::uint32_t, 4> numbers{version, static_cast<std::uint32_t>(bytes), rows_of_block,
                                             static_cast<std::uint32_t>(columns.size())};
  std::string head(magic);
  head.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
  head += text;
  head.resize(bytes, ' ');
  return head;
}

}  // namespace

SignalTableWriter::SignalTableWriter(const std::filesystem::path& file, const std::vector<SignalColumn>& columns,
                                     Blocks blocks)
    : blocks_(blocks),
      descriptor_(open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666)),
      error_(descriptor_ < 0 ? errno : 0),
      columns_(columns.size()),
      block_(columns_ * rows_of_block) {
  const std::string head = table_head(columns, blocks == Blocks::packed ? packed_version : plain_version);
  write(head.data(), head.size(), 0);
  begins_at_ = head.size();
  begin_block();
}

SignalTableWriter::~SignalTableWriter() {
  if (descriptor_ >= 0) close(descriptor_);
}

void SignalTableWriter::begin_block() {
  std::fill(block_.begin(), block_.end(), std::bit_cast<double>(empty_bits));
  rows_ = 0;
}

void SignalTableWriter::write(const void* data, std::size_t bytes, std::size_t at) {
  const char* from = static_cast<const char*>(data);
  while (bytes > 0 && error_ == 0) {
    const ssize_t written = pwrite(descriptor_, from, bytes, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      error_ = written < 0 ? errno : EIO;
      return;
    }
    const auto done = static_cast<std::size_t>(written);
    from += done;
    at += done;
    bytes -= done;
  }
}

// Writes the first column last. It shows which rows exist, so these rows are complete even if the session dies.
void SignalTableWriter::write_block() {
  constexpr std::size_t column_bytes = rows_of_block * sizeof(double);
  write(block_.data() + rows_of_block, (columns_ - 1) * column_bytes, begins_at_ + column_bytes);
  write(block_.data(), column_bytes, begins_at_);
}

void SignalTableWriter::write_packed() {
  const std::string frame =
      models::packed({reinterpret_cast<const char*>(block_.data()), block_.size() * sizeof(double)});
  const auto bytes = static_cast<std::uint32_t>(frame.size());
  write(&bytes, sizeof bytes, begins_at_);
  write(frame.data(), frame.size(), begins_at_ + sizeof bytes);
  begins_at_ += sizeof bytes + frame.size();
}

void SignalTableWriter::end_row() {
  ++rows_;
  const bool full = rows_ == rows_of_block;
  if (blocks_ == Blocks::packed) {
    if (full) write_packed();
  } else {
    if (rows_ % rows_at_once == 0) write_block();
    if (full) begins_at_ += block_.size() * sizeof(double);
  }
  if (full) begin_block();
}

void SignalTableWriter::finish() {
  if (descriptor_ < 0) return;
  if (rows_ > 0) blocks_ == Blocks::packed ? write_packed() : write_block();
  if (close(descriptor_) != 0 && error_ == 0) error_ = errno;
  descriptor_ = -1;
}

SignalTable::SignalTable(const std::filesystem::path& file) : file_(file) {
  const auto refuse = [&](const std::string& found, const char* expected) {
    throw SetupError({.file = file.string(), .found = found, .expected = expected});
  };
  constexpr const char* a_table = "signals.bin of a session that was recorded";
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  const bool there = descriptor >= 0 && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  const std::size_t bytes = there ? static_cast<std::size_t>(status.st_size) : 0;
  void* const memory =
      bytes > json_begins_at ? mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, descriptor, 0) : MAP_FAILED;
  if (descriptor >= 0) close(descriptor);
  if (!there) refuse("no such file", a_table);
  if (memory == MAP_FAILED) refuse("a file of " + std::to_string(bytes) + " bytes", a_table);
  memory_ = static_cast<const char*>(memory);
  bytes_ = bytes;
  try {
    read_columns();
    find_blocks();
    count_rows();
  } catch (...) {
    munmap(memory, bytes);
    throw;
  }
}

SignalTable::~SignalTable() { munmap(const_cast<char*>(memory_), bytes_); }

void SignalTable::read_columns() {
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw SetupError({.file = file_.string(), .found = found, .expected = expected});
  };
  if (std::string_view(memory_, magic.size()) != magic) {
    refuse("another kind of file", "signals.bin of a session that was recorded");
  }
  std::array<std::uint32_t, 4> numbers{};
  std::memcpy(numbers.data(), memory_ + magic.size(), sizeof numbers);
  packed_ = numbers[0] == packed_version;
  if (!packed_ && numbers[0] != plain_version) {
    refuse("version " + std::to_string(numbers[0]), "version " + std::to_string(plain_version) + " or " +
                                                        std::to_string(packed_version) + ", as this proxarm writes");
  }
  first_block_ = numbers[1];
  block_rows_ = numbers[2];
  const bool fits = first_block_ > json_begins_at && first_block_ % page_bytes == 0 && first_block_ <= bytes_ &&
                    block_rows_ > 0 && block_rows_ <= most_block_rows && numbers[3] > 0 && numbers[3] <= first_block_;
  if (!fits) refuse("a head that is cut off or damaged", "signals.bin of a session that was recorded");
  const std::optional<Json> json =
      Json::parse(std::string_view(memory_ + json_begins_at, first_block_ - json_begins_at));
  const Json* const list = json ? json->find("columns") : nullptr;
  for (const Json& one : list ? list->items() : std::vector<Json>{}) {
    Column column{.name = one.text_of("name").value_or("")};
    const std::string form = one.text_of("form").value_or("");
    for (const auto& [known, name] : forms) {
      if (form == name) column.form = known;
    }
    if (const auto words = one.text_of("words")) column.words = parted(*words);
    columns_.push_back(std::move(column));
  }
  if (columns_.size() != numbers[3]) {
    refuse("a head that names " + std::to_string(columns_.size()) + " columns", std::to_string(numbers[3]));
  }
}

// Finds the complete blocks.
void SignalTable::find_blocks() {
  const std::size_t plain_bytes = columns_.size() * block_rows_ * sizeof(double);
  for (std::size_t at = first_block_; at < bytes_;) {
    std::size_t bytes = plain_bytes;
    if (packed_) {
      std::uint32_t length = 0;
      if (bytes_ - at < sizeof length) return;
      std::memcpy(&length, memory_ + at, sizeof length);
      bytes = sizeof length + length;
    }
    if (bytes > bytes_ - at) return;
    blocks_.push_back(at);
    at += bytes;
  }
}

// Counts the rows. In the last block, rows end before the first row without a cycle number.
void SignalTable::count_rows() {
  rows_ = blocks_.size() * block_rows_;
  while (rows_ > 0 && rows_ + block_rows_ > blocks_.size() * block_rows_ && is_empty(value(rows_ - 1, 0))) --rows_;
}

const char* SignalTable::block(std::size_t index) const {
  const char* const begin = memory_ + blocks_[index];
  if (!packed_) return begin;
  if (!unpacked_.empty() && unpacked_index_ == index) return unpacked_.data();
  std::uint32_t length = 0;
  std::memcpy(&length, begin, sizeof length);
  auto unpacked = models::unpacked({begin + sizeof length, length}, columns_.size() * block_rows_ * sizeof(double));
  if (!unpacked) {
    throw SetupError(
        {.file = file_.string(), .found = "a block that is damaged", .expected = "what a session has written"});
  }
  unpacked_ = *std::move(unpacked);
  unpacked_index_ = index;
  return unpacked_.data();
}

double SignalTable::value(std::size_t row, std::size_t column) const {
  double value = 0.0;
  std::memcpy(&value, block(row / block_rows_) + (column * block_rows_ + row % block_rows_) * sizeof(double),
              sizeof value);
  return value;
}

void SignalTable::append_row(std::string& text, std::size_t row) const {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (i > 0) text += ',';
    append_stored(text, columns_[i].form, columns_[i].words, value(row, i));
  }
}

std::string SignalTable::header() const {
  std::string text;
  for (const Column& column : columns_) text += (text.empty() ? "" : ",") + column.name;
  return text;
}

}  // namespace proxarm::controller
