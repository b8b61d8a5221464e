// Reads and writes signals.bin and contacts.bin: a record's tables as numbers, column by column. A program that maps
// the file into memory has any column of an hour in milliseconds (docs/files.md). All is little-endian.
//
//   byte  0   "PXSIGNAL"
//         8   u32, version: 1; 2 where blocks are packed
//        12   u32, bytes before the first block: a multiple of 4096
//         16   u32, rows per block: 512, so that a block's column is a page
//        20   u32, columns
//         24   JSON, padded with spaces: {"columns": [{"name", "form", "words"}, …]}. `form` is a number's text form:
//              number, integer, seconds, word (index from 0 into `words`, which are joined by bars) or flags (a bit for
//              each of `words`, the lowest for the first)
//   then blocks: all rows of the first column, all of the second, …, each a float64. An empty field is the NaN
//    7FF800454D505459h; in the last block, rows with an empty cycle number don't count. In version 2 each block is a
//    frame of Zstandard, after its length in bytes (u32).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

// Not for the cycle. A session that is killed loses at most its last 64 rows, or 512 of a packed table.
class SignalTableWriter {
 public:
  enum class Blocks : std::uint8_t { plain, packed };
  // Replaces the file.
  SignalTableWriter(const std::filesystem::path& file, const std::vector<SignalColumn>& columns, Blocks blocks);
  SignalTableWriter(const SignalTableWriter&) = delete;
  SignalTableWriter& operator=(const SignalTableWriter&) = delete;
  ~SignalTableWriter();

  // A row: the caller writes its values to row(), at a spacing of `apart`; end_row() adds it.
  static constexpr std::size_t apart = 512;
  [[nodiscard]] double* row() noexcept { return block_.data() + rows_; }
  void end_row();
  // Writes the rest and closes the file.
  void finish();
  // errno of the first error of the file; 0: none.
  [[nodiscard]] int error() const noexcept { return error_; }

 private:
  void write_block();
  void write_packed();
  void write(const void* data, std::size_t bytes, std::size_t at);
  void begin_block();

  Blocks blocks_;
  int descriptor_ = -1;
  int error_ = 0;
  std::size_t columns_;
  std::size_t begins_at_ = 0;  // of this block, in the file
  std::size_t rows_ = 0;       // of this block
  std::vector<double> block_;
};

// Reads such a table. A truncated file has the rows of its whole blocks.
class SignalTable {
 public:
  struct Column {
    std::string name;
    SignalColumn::Form form = SignalColumn::Form::number;
    std::vector<std::string> words{};
  };

  // Throws SetupError if the file is no such table, or of another version.
  explicit SignalTable(const std::filesystem::path& file);
  SignalTable(const SignalTable&) = delete;
  SignalTable& operator=(const SignalTable&) = delete;
  ~SignalTable();

  [[nodiscard]] const std::vector<Column>& columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  // Precondition: row < rows(), column < columns().size(). For a packed table not from several threads at once, since
  // the last block is cached. Throws SetupError if the block is damaged.
  [[nodiscard]] double value(std::size_t row, std::size_t column) const;
  // As a row of signals.csv, without its end.
  void append_row(std::string& text, std::size_t row) const;
  // The first row of signals.csv, without its end.
  [[nodiscard]] std::string header() const;

 private:
  void read_columns();
  void find_blocks();
  void count_rows();
  [[nodiscard]] const char* block(std::size_t index) const;

  std::filesystem::path file_;
  const char* memory_ = nullptr;
  std::size_t bytes_ = 0;
  std::size_t first_block_ = 0, block_rows_ = 0, rows_ = 0;
  std::vector<Column> columns_;
  bool packed_ = false;
  std::vector<std::size_t> blocks_;  // begin of each block: its values, or its length if packed
  mutable std::string unpacked_;     // the cached block
  mutable std::size_t unpacked_index_ = 0;
};

}  // namespace proxarm::controller
