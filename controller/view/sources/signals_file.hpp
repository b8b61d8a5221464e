// Reads any row of a record's signals.csv or signals.bin. The beginnings of text rows are found once; a row is parsed
// on request.
//
// Columns are identified by name, so known columns can be read from records of other versions. An incomplete last row
// counts as the end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_table.hpp"
#include "controller/view/sources/text_table.hpp"

namespace proxarm::view {

class SignalsFile {
 public:
  // `axis_names` as in the cell. Throws SetupError if the folder has no signals of a record.
  SignalsFile(const std::filesystem::path& folder, const std::vector<std::string>& axis_names);

  [[nodiscard]] std::size_t size() const noexcept { return table_ ? table_->rows() : text_->rows(); }
  // Everything that the file contains about a cycle. Precondition: index < size().
  [[nodiscard]] controller::CycleRecord row(std::size_t index) const;

  // A value as the file has it.
  struct Field {
    std::string_view text{};
    double number = 0.0;
    bool is_number = false;  // then there is no text
  };

 private:
  using Store = void (*)(controller::CycleRecord& record, std::size_t part, const Field& field);
  struct Column {
    Store store = nullptr;  // null: an unknown column
    std::size_t part = 0;   // component of a vector, or axis
  };
  [[nodiscard]] Column column_named(std::string_view name, const std::vector<std::string>& axis_names) const;

  void add_from_table(controller::CycleRecord& record, std::size_t index) const;

  std::unique_ptr<controller::SignalTable> table_;
  std::unique_ptr<TextTable> text_;  // null if there is a table
  std::vector<Column> columns_;
};

}  // namespace proxarm::view
