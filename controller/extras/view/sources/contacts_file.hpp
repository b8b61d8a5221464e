// Reads the contacts of any cycle of a record from contacts.csv or contacts.bin.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "controller/extras/view/sources/text_table.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/signals/signal_table.hpp"

namespace proxarm::view {

class ContactsFile {
 public:
  // Throws SetupError if the file is of another kind.
  explicit ContactsFile(const std::filesystem::path& folder);

  // Sets the contacts of the cycle whose number the record has. If the session was recorded without this file, the
  // contacts come from the signals, and their places and forces are computed as for a point tool.
  void complete(controller::CycleRecord& record) const;

 private:
  using Store = void (*)(controller::RecordedContact& contact, std::size_t part, double value);
  struct Column {
    Store store = nullptr;  // null: a column that isn't stored
    std::size_t part = 0;   // index of the vector's component
  };
  [[nodiscard]] static Column column_named(std::string_view name);
  [[nodiscard]] std::size_t rows() const noexcept { return table_ ? table_->rows() : text_ ? text_->rows() : 0; }
  [[nodiscard]] std::uint64_t cycle_of(std::size_t row) const;
  [[nodiscard]] controller::RecordedContact contact(std::size_t row) const;

  std::unique_ptr<controller::SignalTable> table_;
  std::unique_ptr<TextTable> text_;
  std::vector<Column> columns_;
};

}  // namespace proxarm::view
