// A record's table as text (signals.csv, contacts.csv), mapped into memory: the table's header, and any of its rows.
// The beginnings of rows are found once. An incomplete last row counts as the end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace proxarm::view {

class TextTable {
 public:
  // Throws SetupError if the file is missing, or if its header doesn't begin with `header_begins`.
  TextTable(const std::filesystem::path& file, std::string_view header_begins);
  TextTable(const TextTable&) = delete;
  TextTable& operator=(const TextTable&) = delete;
  ~TextTable();

  [[nodiscard]] std::vector<std::string_view> names() const;  // names of the columns
  [[nodiscard]] std::size_t rows() const noexcept { return rows_.size(); }
  // Calls visit(column, text) for each field of a row. Precondition: row < rows().
  template <typename Visit>
  void visit(std::size_t row, Visit visit) const {
    const std::string_view line = line_at(rows_[row]);
    std::size_t at = 0;
    for (std::size_t column = 0; at <= line.size(); ++column) {
      const std::string_view value = line.substr(at, line.find(',', at) - at);
      visit(column, value);
      at += value.size() + 1;
    }
  }
  // Returns the row's first field, a whole number.
  [[nodiscard]] std::uint64_t first(std::size_t row) const noexcept;

 private:
  [[nodiscard]] std::string_view line_at(std::size_t at) const noexcept {
    return text_.substr(at, text_.find('\n', at) - at);
  }
  std::string_view text_;
  std::vector<std::uint64_t> rows_;  // offset of each row's beginning
};

}  // namespace proxarm::view
