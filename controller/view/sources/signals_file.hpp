// Reads any row of a record's signals.csv. The rows' positions are found once; a row is parsed when it is asked for.
//
// Columns are identified by their names, so the columns that are known are read from records of other versions, too. An
// incomplete last row counts as the end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "controller/record/cycle_record.hpp"

namespace proxarm::view {

class SignalsFile {
 public:
  // `axis_names` as in the cell. Throws SetupError if the file isn't a record's signals.
  SignalsFile(const std::filesystem::path& file, const std::vector<std::string>& axis_names);
  SignalsFile(const SignalsFile&) = delete;
  SignalsFile& operator=(const SignalsFile&) = delete;
  ~SignalsFile();

  [[nodiscard]] std::size_t size() const noexcept { return rows_.size(); }
  // All that the file contains of a cycle. Precondition: index < size().
  [[nodiscard]] controller::CycleRecord row(std::size_t index) const;

 private:
  using Store = void (*)(controller::CycleRecord& record, std::size_t part, std::string_view text);
  struct Column {
    Store store = nullptr;  // null: an unknown column
    std::size_t part = 0;   // component of a vector, or axis
  };
  [[nodiscard]] Column column_named(std::string_view name, const std::vector<std::string>& axis_names) const;

  std::filesystem::path name_;
  std::string_view text_;
  std::vector<Column> columns_;
  std::vector<std::uint64_t> rows_;  // where each begins
};

}  // namespace proxarm::view
