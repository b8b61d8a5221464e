// Reads any row of a record's signals.csv or signals.bin. The beginnings of text rows are found once; a row is parsed
// on request.
//
// Columns are identified by their names, so columns with known names can be read from records of other versions. An
// incomplete last row counts as the end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/extras/view/sources/text_table.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_table.hpp"

namespace proxarm::view {

class SignalsFile {
 public:
  // `axis_names` are as in the cell. Throws SetupError if the folder has no signals of a record.
  SignalsFile(const std::filesystem::path& folder, const std::vector<std::string>& axis_names);

  [[nodiscard]] std::size_t size() const noexcept { return table_ ? table_->rows() : text_->rows(); }
  // Returns all that the file contains about a cycle. Precondition: index < size().
  [[nodiscard]] controller::CycleRecord row(std::size_t index) const;

  // The content of a field of the file.
  struct Field {
    std::string_view text{};
    double number = 0.0;
    bool is_number = false;  // then `text` is empty
  };

 private:
  using Store = void (*)(controller::CycleRecord& record, std::size_t part, const Field& field);
  struct Column {
    Store store = nullptr;  // null: an unknown column
    std::size_t part = 0;   // index of the vector's component, or of the axis
  };
  [[nodiscard]] Column column_named(std::string_view name, const std::vector<std::string>& axis_names) const;

  void add_from_table(controller::CycleRecord& record, std::size_t index) const;

  std::unique_ptr<controller::SignalTable> table_;
  std::unique_ptr<TextTable> text_;  // null if table_ is set
  std::vector<Column> columns_;
};

}  // namespace proxarm::view
