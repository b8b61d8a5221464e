// signals.bin, contacts.bin: tables of a record as numbers, column by column, so that a program maps the file into
// memory and has any column of an hour in some milliseconds (docs/files.md). All is little-endian.
//
//   byte  0   "PXSIGNAL"
//         8   u32, version: 1; 2 where blocks are packed
//        12   u32, bytes before the first block: a multiple of 4096
//        16   u32, rows of a block: 512, so that a column of it is a page
//        20   u32, columns
//        24   JSON, padded with spaces: {"columns": [{"name", "form", "words"}, …]}. `form` says how a number is
//        written
//             as text: number, integer, seconds, word (its place, from 0, among `words`, which are joined by bars) or
//             flags (a bit for each of `words`, the lowest for the first)
//   then blocks: all rows of the first column, all of the second, …, each a float64. A field without anything in it is
//   the NaN 7FF800454D505459h; rows of the last block that have no cycle number yet are none. In version 2 each block
//   is a frame of Zstandard, after its length in bytes (u32).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/signals/signal_columns.hpp"

namespace proxarm::controller {

// Not for the cycle, as SessionWriter. A session that is killed loses its last 64 rows at most, of a packed table 512.
class SignalTableWriter {
 public:
  enum class Blocks : std::uint8_t { plain, packed };
  // Begins the file anew.
  SignalTableWriter(const std::filesystem::path& file, const std::vector<SignalColumn>& columns, Blocks blocks);
  SignalTableWriter(const SignalTableWriter&) = delete;
  SignalTableWriter& operator=(const SignalTableWriter&) = delete;
  ~SignalTableWriter();

  // A row: its values go to row(), each `apart` places behind the one before; end_row() adds it.
  static constexpr std::size_t apart = 512;
  [[nodiscard]] double* row() noexcept { return block_.data() + rows_; }
  void end_row();
  // Writes what is left, and closes the file.
  void finish();
  // errno of the first thing that went wrong with the file; 0: nothing.
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
  std::size_t begins_at_ = 0;  // this block, in the file
  std::size_t rows_ = 0;       // that it has
  std::vector<double> block_;
};

// Reads one. A file that was cut off has the rows of its whole blocks.
class SignalTable {
 public:
  struct Column {
    std::string name;
    SignalColumn::Form form = SignalColumn::Form::number;
    std::vector<std::string> words{};
  };

  // Throws SetupError where the file is no such table, or one of another version.
  explicit SignalTable(const std::filesystem::path& file);
  SignalTable(const SignalTable&) = delete;
  SignalTable& operator=(const SignalTable&) = delete;
  ~SignalTable();

  [[nodiscard]] const std::vector<Column>& columns() const noexcept { return columns_; }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }
  // Precondition: both are there. Of a packed table not for several threads at once: the block that was read last is
  // kept. Throws SetupError where that is damaged.
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
  std::vector<std::size_t> blocks_;  // where each begins: its values, or its length
  mutable std::string unpacked_;     // a block
  mutable std::size_t unpacked_index_ = 0;
};

}  // namespace proxarm::controller
