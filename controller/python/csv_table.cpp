#include "controller/python/csv_table.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <exception>
#include <limits>
#include <thread>

#include "models/base/setup_error.hpp"

namespace proxarm::python {
namespace {

using description::SetupError;

constexpr std::size_t worth_a_thread = 1 << 20;  // bytes; less is read before a thread has begun

// A part of the text, whole rows, and what was read of it.
struct Part {
  const char* begin;
  const char* end;
  std::vector<TableColumn> columns;
  std::exception_ptr failed;
};

// Which field of a row goes into which column.
struct Place {
  std::size_t field, column;
};

// The places of commas among eight bytes, as the highest bit of each (Warren, Hacker's Delight, 6-1: exact).
std::uint64_t commas_in(const char* at) noexcept {
  constexpr std::uint64_t low = 0x7F7F7F7F7F7F7F7FU;
  std::uint64_t bytes;
  std::memcpy(&bytes, at, sizeof bytes);
  bytes ^= 0x2C2C2C2C2C2C2C2CU;  // ','
  return ~(((bytes & low) + low) | bytes | low);
}

// Behind the `count`-th comma from here; `end` where there are fewer.
const char* pass_fields(const char* at, const char* end, std::size_t count) noexcept {
  while (count > 0 && end - at >= 8) {
    std::uint64_t commas = commas_in(at);
    const auto here = static_cast<std::size_t>(std::popcount(commas));
    if (here < count) {
      count -= here;
      at += 8;
      continue;
    }
    for (; count > 1; --count) commas &= commas - 1;
    return at + std::countr_zero(commas) / 8 + 1;
  }
  for (; count > 0 && at < end; ++at) count -= *at == ',' ? 1 : 0;
  return count == 0 ? at : end;
}

[[noreturn]] void refuse(const std::string& file, const std::string& key, std::string_view found,
                         const char* expected) {
  throw SetupError({.file = file, .key = key, .found = description::in_quotes(found), .expected = expected});
}

std::vector<std::string> fields_of(std::string_view row) {
  std::vector<std::string> fields;
  for (std::size_t from = 0; from <= row.size();) {
    const std::size_t comma = std::min(row.find(',', from), row.size());
    fields.emplace_back(row.substr(from, comma - from));
    from = comma + 1;
  }
  return fields;
}

bool is_number(std::string_view text) noexcept {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::int32_t code_of(TableColumn& column, std::string_view word) {
  // A column has few words, and the last row's is nearly always this one's.
  if (!column.codes.empty() && column.words[static_cast<std::size_t>(column.codes.back())] == word) {
    return column.codes.back();
  }
  const auto found = std::find(column.words.begin(), column.words.end(), word);
  if (found == column.words.end()) {
    column.words.emplace_back(word);
    return static_cast<std::int32_t>(column.words.size() - 1);
  }
  return static_cast<std::int32_t>(found - column.words.begin());
}

// One field; returns its end.
const char* read_field(const char* at, const char* row_end, TableColumn& column, const std::string& file) {
  if (column.is_text) {
    const char* const end = std::find(at, row_end, ',');
    column.codes.push_back(code_of(column, {at, end}));
    return end;
  }
  double value = std::numeric_limits<double>::quiet_NaN();
  if (at < row_end && *at != ',') {
    const auto [end, error] = std::from_chars(at, row_end, value);
    if (error != std::errc() || (end != row_end && *end != ',')) {
      refuse(file, column.name, {at, std::find(at, row_end, ',')}, "a number");
    }
    at = end;
  }
  column.numbers.push_back(value);
  return at;
}

void read_part(Part& part, const std::vector<Place>& places, const std::string& file) {
  for (const char* row = part.begin; row < part.end;) {
    const auto* newline = static_cast<const char*>(std::memchr(row, '\n', static_cast<std::size_t>(part.end - row)));
    const char* const row_end = newline == nullptr ? part.end : newline;
    const char* at = row;
    std::size_t field = 0;
    for (const Place& place : places) {
      const char* const there = pass_fields(at, row_end, place.field - field);
      if (there == row_end && place.field > field && (there == at || there[-1] != ',')) {
        refuse(file, part.columns[place.column].name, {row, std::min<std::size_t>(40, row_end - row)},
               "as many fields as the first row has");
      }
      at = read_field(there, row_end, part.columns[place.column], file);
      field = place.field;
    }
    row = row_end + 1;
  }
}

// Whole rows for each thread.
std::vector<Part> parts_of(std::string_view rows, const std::vector<TableColumn>& columns) {
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::clamp<std::size_t>(rows.size() / worth_a_thread, 1, threads);
  std::vector<Part> parts;
  const char *begin = rows.data(), *const end = rows.data() + rows.size();
  for (std::size_t i = 0; i < count && begin < end; ++i) {
    const char* stop = i + 1 == count ? end : std::max(begin, rows.data() + rows.size() / count * (i + 1));
    stop = std::find(stop, end, '\n');
    if (stop < end) ++stop;
    parts.push_back({begin, stop, columns, nullptr});
    begin = stop;
  }
  return parts;
}

// All parts' rows, one after the other; each part has numbered its words by itself.
void join(const std::vector<Part>& parts, std::vector<TableColumn>& columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    TableColumn& whole = columns[i];
    std::size_t rows = 0;
    for (const Part& part : parts) rows += part.columns[i].numbers.size() + part.columns[i].codes.size();
    (whole.is_text ? whole.codes.reserve(rows) : whole.numbers.reserve(rows));
    for (const Part& part : parts) {
      const TableColumn& of_part = part.columns[i];
      whole.numbers.insert(whole.numbers.end(), of_part.numbers.begin(), of_part.numbers.end());
      std::vector<std::int32_t> codes;
      for (const std::string& word : of_part.words) {
        const auto found = std::find(whole.words.begin(), whole.words.end(), word);
        codes.push_back(static_cast<std::int32_t>(found - whole.words.begin()));
        if (found == whole.words.end()) whole.words.push_back(word);
      }
      for (const std::int32_t code : of_part.codes) whole.codes.push_back(codes[static_cast<std::size_t>(code)]);
    }
  }
}

// A file in memory, for as long as it is read.
class Mapped {
 public:
  explicit Mapped(const std::string& file) {
    const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    const bool there = descriptor >= 0 && fstat(descriptor, &status) == 0;
    if (there && status.st_size > 0) {
      size_ = static_cast<std::size_t>(status.st_size);
      memory_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
    }
    const int error = errno;
    if (descriptor >= 0) close(descriptor);
    if (there && size_ > 0 && memory_ != MAP_FAILED) return;
    throw SetupError({.file = file, .found = there ? "nothing in it" : std::strerror(error), .expected = "a table"});
  }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  ~Mapped() { munmap(memory_, size_); }

  [[nodiscard]] std::string_view text() const noexcept { return {static_cast<const char*>(memory_), size_}; }

 private:
  void* memory_ = MAP_FAILED;
  std::size_t size_ = 0;
};

}  // namespace

std::vector<TableColumn> read_table(std::string_view csv, const std::vector<std::string>& wanted,
                                    const std::vector<std::string>& text, const std::string& file) {
  const std::size_t header_end = std::min(csv.find('\n'), csv.size());
  const std::vector<std::string> names = fields_of(csv.substr(0, header_end));
  const std::string_view rows = csv.substr(std::min(header_end + 1, csv.size()));
  const std::vector<std::string> first = fields_of(rows.substr(0, rows.find('\n')));

  std::vector<TableColumn> columns;
  std::vector<Place> places;
  for (const std::string& name : wanted.empty() ? names : wanted) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) refuse(file, "columns", name, "the name of a column in the first row");
    const auto field = static_cast<std::size_t>(found - names.begin());
    const bool is_word = field < first.size() && !first[field].empty() && !is_number(first[field]);
    const bool is_text = is_word || std::find(text.begin(), text.end(), name) != text.end();
    places.push_back({field, columns.size()});
    columns.push_back({name, is_text, {}, {}, {}});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.field < b.field; });
  const auto twice = std::adjacent_find(places.begin(), places.end(),
                                        [](const Place& a, const Place& b) { return a.field == b.field; });
  if (twice != places.end()) refuse(file, "columns", columns[twice->column].name, "each name once");

  std::vector<Part> parts = parts_of(rows, columns);
  const auto read = [&](Part& part) noexcept {
    try {
      read_part(part, places, file);
    } catch (...) {
      part.failed = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < parts.size(); ++i) threads.emplace_back(read, std::ref(parts[i]));
  if (!parts.empty()) read(parts[0]);
  for (std::thread& thread : threads) thread.join();
  for (const Part& part : parts) {
    if (part.failed) std::rethrow_exception(part.failed);
  }
  if (parts.size() == 1) return std::move(parts[0].columns);
  join(parts, columns);
  return columns;
}

std::vector<TableColumn> read_table_file(const std::string& file, const std::vector<std::string>& wanted,
                                         const std::vector<std::string>& text) {
  const Mapped mapped(file);
  return read_table(mapped.text(), wanted, text, file);
}

}  // namespace proxarm::python
