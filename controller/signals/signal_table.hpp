// Reads and writes signals.bin and contacts.bin: a record's tables as numbers, column by column. A program that maps
// the file into memory reads any column of an hour in milliseconds (docs/reference/files.md). All numbers are
// little-endian.
//
//   byte  0   "PXSIGNAL"
//         8   u32, version: 1; 2 if blocks are packed
//        12   u32, number of bytes before the first block: a multiple of 4096
//        16   u32, number of rows per block: 512, so that a column of a block is a page
//        20   u32, number of columns
//        24   JSON, padded with spaces: {"columns": [{"name", "form", "words"}, …]}; see below
//   then the blocks. A block is all its rows of the first column, then of the second column, and so on, each a float64.
//   An empty field is the NaN 7FF800454D505459h. In the last block, rows with an empty cycle number don't count. In
//   version 2 each block is a frame of Zstandard, after the frame's length in bytes (u32).
//
// `form` says how a number is written as text: as number, integer or seconds; as word, an index from 0 into `words`; or
// as flags, with a bit for each of `words`, the lowest bit for the first word. `words` are joined by bars.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

// Writes a table. Not for the cycle. If the session is killed, at most the last 64 rows are lost, or the last 512 rows
// of a packed table.
class SignalTableWriter {
 public:
  enum class Blocks : std::uint8_t { plain, packed };
  // Replaces the file.
  SignalTableWriter(const std::filesystem::path& file, const std::vector<SignalColumn>& columns, Blocks blocks);
  SignalTableWriter(const SignalTableWriter&) = delete;
  SignalTableWriter& operator=(const SignalTableWriter&) = delete;
  ~SignalTableWriter();

  // For each row, the caller writes the values to row(), at a spacing of `apart`. end_row() then adds the row.
  static constexpr std::size_t apart = 512;
  [[nodiscard]] double* row() noexcept { return block_.data() + rows_; }
  void end_row();
  // Writes the remaining rows and closes the file.
  void finish();
  // Returns errno of the first error with the file; 0: no error.
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
  std::size_t begins_at_ = 0;  // position of the present block in the file
  std::size_t rows_ = 0;       // number of rows in the present block
  std::vector<double> block_;
};

// Reads a table. Of a truncated file, the rows of whole blocks are read.
class SignalTable {
 public:
  struct Column {
    std::string name;
    SignalColumn::Form form = SignalColumn::Form::number;
    std::vector<std::string> words{};
  };

  // Throws SetupError if the file isn't such a table, or has another version.
  explicit SignalTable(const std::filesystem::path& file);
  SignalTable(const SignalTable&) = delete;
  SignalTable& operator=(const SignalTable&) = delete;
  ~SignalTable();

  [[nodiscard]] const std::vector<Column>& columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  // Returns a value. Precondition: row < rows(), column < columns().size(); for a packed table, one thread at a time,
  // since the last block is cached. Throws SetupError if the block is damaged.
  [[nodiscard]] double value(std::size_t row, std::size_t column) const;
  // Appends the row as in signals.csv, without the line's end.
  void append_row(std::string& text, std::size_t row) const;
  // Returns the first row as in signals.csv, without the line's end.
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
  std::vector<std::size_t> blocks_;  // where each block begins: with its values, or with its length if packed
  mutable std::string unpacked_;     // the cached block, unpacked
  mutable std::size_t unpacked_index_ = 0;
};

}  // namespace proxarm::controller
