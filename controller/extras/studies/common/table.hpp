// Keeps all runs of a study as rows of numbers and words, as in the study's CSV file.
//
// Numbers are written with 17 digits, so reading them gives the same bits, and merged parts give the same headline and
// plots as a single run.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace proxarm::studies {

using Cell = std::variant<double, std::string>;
using Row = std::vector<Cell>;

struct Column {
  std::string name;   // name with its unit, such as "mass_kg"
  bool text = false;  // the column has words without commas, quotes and line ends
};

class Table {
 public:
  // Makes an empty table with these columns, preceded by a column `job` for the number of the job that made a row.
  explicit Table(std::vector<Column> columns);

  // Adds a row that the job of this number made. The row's cells belong to the columns after the column `job`.
  void add(std::size_t job, const Row& row);
  // Sorts the rows by their jobs. The order of each job's rows stays.
  void sort_by_job();

  [[nodiscard]] std::size_t rows() const noexcept { return jobs_.size(); }
  [[nodiscard]] std::size_t job(std::size_t row) const noexcept { return jobs_[row]; }
  // Returns the index of a column, for number() and text(). Throws std::out_of_range for an unknown name.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  [[nodiscard]] double number(std::size_t row, std::size_t column) const noexcept {
    return cells_[row * columns_.size() + column];
  }
  [[nodiscard]] const std::string& text(std::size_t row, std::size_t column) const noexcept {
    return words_[static_cast<std::size_t>(number(row, column))];
  }

  // Writes the table as CSV. Throws std::runtime_error if the file can't be written.
  void write_csv(const std::filesystem::path& file) const;
  // Adds the rows of a file that write_csv() made with the same columns. Throws a description::SetupError that names
  // file and line.
  void read_csv(const std::filesystem::path& file);

 private:
  std::size_t word(const std::string& text);

  std::vector<Column> columns_;
  std::vector<std::size_t> jobs_;
  std::vector<double> cells_;  // of a text column: the index of a word
  std::vector<std::string> words_;
  std::map<std::string, std::size_t, std::less<>> word_index_;
};

}  // namespace proxarm::studies
