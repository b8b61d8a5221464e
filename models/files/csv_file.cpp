#include "models/files/csv_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>

#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

constexpr std::uintmax_t most_bytes = 256U << 20U;
constexpr std::size_t most_rows = 1'000'000;
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF", blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

// Returns the field without the quotes that spreadsheets put around names.
std::string_view unquoted(std::string_view field) {
  const bool quoted = field.size() >= 2 && field.front() == '"' && field.back() == '"';
  return quoted ? field.substr(1, field.size() - 2) : field;
}

class Reader {
 public:
  Reader(std::string_view text, const std::filesystem::path& file) : rest_(text), file_(file) {
    if (rest_.starts_with(byte_order_mark)) rest_.remove_prefix(byte_order_mark.size());
  }

  // Reads the fields of the next line that is neither empty nor a comment. Returns false at the end of the text.
  bool next(std::vector<std::string_view>& fields) {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view text = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++line_;
      if (trimmed(text).empty() || trimmed(text).front() == '#') continue;
      if (separator_ == '\0') separator_ = separator_of(text);
      fields.clear();
      for (std::size_t at = 0; at <= text.size();) {
        const std::size_t stop = std::min(text.find(separator_, at), text.size());
        fields.push_back(unquoted(trimmed(text.substr(at, stop - at))));
        at = stop + 1;
      }
      return true;
    }
    return false;
  }

  [[nodiscard]] SetupError mistake(std::string key, std::string found, std::string expected,
                                   std::string advice = {}) const {
    return SetupError({.file = file_.string(),
                       .line = line_,
                       .key = std::move(key),
                       .found = std::move(found),
                       .expected = std::move(expected),
                       .advice = std::move(advice)});
  }

 private:
  static char separator_of(std::string_view line) {
    for (const char separator : {';', '\t'}) {
      if (line.find(separator) != std::string_view::npos) return separator;
    }
    return ',';
  }

  std::string_view rest_;
  const std::filesystem::path& file_;
  int line_ = 0;
  char separator_ = '\0';
};

// Returns a column's number, from 1, or nullopt if the column is a name.
std::optional<std::size_t> number_of(const std::string& column) {
  const auto number = strict_integer(column);
  if (!number || *number < 1 || *number > 10'000) return std::nullopt;
  return static_cast<std::size_t>(*number);
}

// Returns the places of the columns in a row, counted from 0.
std::array<std::size_t, 4> places(const Reader& reader, const CsvColumns& columns,
                                  const std::vector<std::string_view>& header) {
  std::array<std::size_t, 4> at{};
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (const auto number = number_of(columns[c])) {
      at[c] = *number - 1;
      continue;
    }
    const auto found = std::find(header.begin(), header.end(), columns[c]);
    if (found == header.end()) {
      std::string there;
      for (const std::string_view name : header) there += (there.empty() ? "" : ", ") + std::string(name);
      throw reader.mistake(columns[c], "no such column among " + in_quotes(there, 200), "a header that names it",
                           "`columns: {" + columns[c] + ": NAME}` maps another name, or its number from 1");
    }
    at[c] = static_cast<std::size_t>(found - header.begin());
  }
  return at;
}

double number_in(const Reader& reader, const std::vector<std::string_view>& row, std::size_t column,
                 const std::string& name, Range range) {
  if (column >= row.size()) {
    throw reader.mistake(name, std::to_string(row.size()) + (row.size() == 1 ? " field" : " fields"),
                         "at least " + std::to_string(column + 1));
  }
  const auto number = strict_number(row[column]);
  if (!number) throw reader.mistake(name, in_quotes(row[column]), "a number, with a decimal point");
  if (!range.contains(*number)) {
    throw reader.mistake(name, number_text(*number), number_text(range.min) + " to " + number_text(range.max));
  }
  return *number;
}

}  // namespace

std::vector<TimedVector> parse_csv(std::string_view text, const std::filesystem::path& file, const CsvColumns& columns,
                                   Range range) {
  Reader reader(text, file);
  std::vector<std::string_view> row;
  std::vector<TimedVector> rows;
  bool more = reader.next(row);
  if (!more) throw SetupError({.file = file.string(), .found = "no line", .expected = "a header and rows of numbers"});
  const bool all_numbers = std::all_of(columns.begin(), columns.end(), [](const auto& c) { return number_of(c); });
  const std::array<std::size_t, 4> at = places(reader, columns, row);
  // A first line without any number is a header, even if the names in it aren't needed.
  const bool header =
      !all_numbers || std::none_of(row.begin(), row.end(), [](const auto& f) { return strict_number(f); });
  if (header) more = reader.next(row);
  for (; more; more = reader.next(row)) {
    if (rows.size() == most_rows) throw reader.mistake("", "more rows", "at most a million");
    TimedVector sample;
    sample.time_s = number_in(reader, row, at[0], columns[0], between(-1e6, 1e6));
    if (!rows.empty() && sample.time_s <= rows.back().time_s) {
      throw reader.mistake(columns[0], number_text(sample.time_s),
                           "a time after that of the row before, " + number_text(rows.back().time_s));
    }
    for (std::size_t i = 0; i < 3; ++i) sample.value[i] = number_in(reader, row, at[i + 1], columns[i + 1], range);
    rows.push_back(sample);
  }
  if (rows.size() < 2) {
    throw SetupError({.file = file.string(),
                      .found = std::to_string(rows.size()) + (rows.size() == 1 ? " row" : " rows") + " of numbers",
                      .expected = "at least two"});
  }
  return rows;
}

std::vector<TimedVector> load_csv(const std::filesystem::path& file, const CsvColumns& columns, Range range) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw SetupError({.file = file.string(), .found = "no such file", .expected = "rows of numbers (CSV)"});
  }
  if (std::filesystem::file_size(file, error) > most_bytes) {
    throw SetupError({.file = file.string(), .found = "more than 256 MiB", .expected = "a million rows at most"});
  }
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) throw SetupError({.file = file.string(), .message = "can't be read; look at its permissions"});
  return parse_csv(text, file, columns, range);
}

}  // namespace proxarm::description
