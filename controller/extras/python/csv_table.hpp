// Reads tables such as a record's signals.csv into columns, fast: an hour has 3.6 million rows of a hundred fields.
//
// The first row has the names, fields end at commas, nothing is quoted. A row's fields that nobody asked for are passed
// over eight bytes at a time; parts of the text are read by a thread each, all into the same columns.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::python {

struct TableColumn {
  std::string name;
  bool is_text = false;
  std::vector<double> numbers;      // an empty field is NaN
  std::vector<std::int32_t> codes;  // of a text column: places in `words`
  std::vector<std::string> words;
};

// `wanted`: names of columns, in the order of the result; empty: all. `text`: names of those that hold words; any other
// column whose first field is neither a number nor empty does, too. `file` is for messages. Throws SetupError for names
// that aren't there, a row with too few fields, and what is no number in a column of numbers.
std::vector<TableColumn> read_table(std::string_view csv, const std::vector<std::string>& wanted,
                                    const std::vector<std::string>& text, const std::string& file);
// The same of a file.
std::vector<TableColumn> read_table_file(const std::string& file, const std::vector<std::string>& wanted,
                                         const std::vector<std::string>& text);

}  // namespace proxarm::python
