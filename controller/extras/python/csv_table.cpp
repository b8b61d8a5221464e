#include "controller/extras/python/csv_table.hpp"

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
#include <utility>

#include "models/base/setup_error.hpp"

namespace proxarm::python {
namespace {

using description::SetupError;

constexpr std::size_t worth_a_thread = 1 << 20;  // bytes; less is read before a thread has begun

// A part of the text, whole rows. Its numbers go where they belong in the whole table; its words it numbers by itself.
struct Part {
  const char* begin;
  const char* end;
  std::size_t first_row = 0;
  std::vector<std::vector<std::string>> words{};  // by column
  std::exception_ptr failed{};
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

// The place of a word among those of its column, which are few.
std::int32_t code_of(std::vector<std::string>& words, std::string_view word) {
  const auto found = std::find(words.begin(), words.end(), word);
  const auto code = static_cast<std::int32_t>(found - words.begin());
  if (found == words.end()) words.emplace_back(word);
  return code;
}

// One field, into a row of a column; returns its end.
const char* read_field(const char* at, const char* row_end, TableColumn& column, std::size_t row,
                       std::vector<std::string>& words, const std::string& file) {
  if (column.is_text) {
    const char* const end = std::find(at, row_end, ',');
    column.codes[row] = code_of(words, {at, end});
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
  column.numbers[row] = value;
  return at;
}

// The end of the row that begins here.
const char* end_of_row(const char* row, const char* end) noexcept {
  const void* const newline = std::memchr(row, '\n', static_cast<std::size_t>(end - row));
  return newline == nullptr ? end : static_cast<const char*>(newline);
}

void read_part(Part& part, std::vector<TableColumn>& columns, const std::vector<Place>& places,
               const std::string& file) {
  std::size_t number = part.first_row;
  for (const char* row = part.begin; row < part.end; ++number) {
    const char* const row_end = end_of_row(row, part.end);
    const char* at = row;
    std::size_t field = 0;
    for (const Place& place : places) {
      const char* const there = pass_fields(at, row_end, place.field - field);
      if (there == row_end && place.field > field && (there == at || there[-1] != ',')) {
        refuse(file, columns[place.column].name, {row, std::min<std::size_t>(40, row_end - row)},
               "as many fields as the first row has");
      }
      at = read_field(there, row_end, columns[place.column], number, part.words[place.column], file);
      field = place.field;
    }
    row = row_end + 1;
  }
}

// Whole rows for each thread.
std::vector<Part> parts_of(std::string_view rows) {
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::clamp<std::size_t>(rows.size() / worth_a_thread, 1, threads);
  std::vector<Part> parts;
  const char *begin = rows.data(), *const end = rows.data() + rows.size();
  for (std::size_t i = 0; i < count && begin < end; ++i) {
    const char* stop = i + 1 == count ? end : std::max(begin, rows.data() + rows.size() / count * (i + 1));
    stop = end_of_row(stop, end);
    if (stop < end) ++stop;
    parts.push_back({.begin = begin, .end = stop});
    begin = stop;
  }
  return parts;
}

// Does something with each part, in a thread of its own; the first exception comes out of here.
template <typename Work>
void for_each_part(std::vector<Part>& parts, const Work& work) {
  const auto guarded = [&](Part& part) noexcept {
    try {
      work(part);
    } catch (...) {
      part.failed = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t i = 1; i < parts.size(); ++i) threads.emplace_back(guarded, std::ref(parts[i]));
  if (!parts.empty()) guarded(parts[0]);
  for (std::thread& thread : threads) thread.join();
  for (const Part& part : parts) {
    if (part.failed) std::rethrow_exception(part.failed);
  }
}

// Tells each part where its rows go; returns how many there are.
std::size_t count_rows(std::vector<Part>& parts) {
  for_each_part(parts, [](Part& part) {
    for (const char* row = part.begin; row < part.end; row = end_of_row(row, part.end) + 1) ++part.first_row;
  });
  std::size_t rows = 0;
  for (Part& part : parts) rows += std::exchange(part.first_row, rows);
  return rows;
}

// One numbering of the words of a column, in place of each part's own.
void join_words(const std::vector<Part>& parts, std::size_t place, TableColumn& column) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? parts[i + 1].first_row : column.codes.size();
    std::vector<std::int32_t> codes;
    for (const std::string& word : parts[i].words[place]) codes.push_back(code_of(column.words, word));
    for (std::size_t row = parts[i].first_row; row < end; ++row) {
      column.codes[row] = codes[static_cast<std::size_t>(column.codes[row])];
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

  std::vector<Part> parts = parts_of(rows);
  const std::size_t count = count_rows(parts);
  for (TableColumn& column : columns) column.is_text ? column.codes.resize(count) : column.numbers.resize(count);
  for_each_part(parts, [&](Part& part) {
    part.words.resize(columns.size());
    read_part(part, columns, places, file);
  });
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].is_text) join_words(parts, i, columns[i]);
  }
  return columns;
}

std::vector<TableColumn> read_table_file(const std::string& file, const std::vector<std::string>& wanted,
                                         const std::vector<std::string>& text) {
  const Mapped mapped(file);
  return read_table(mapped.text(), wanted, text, file);
}

}  // namespace proxarm::python
