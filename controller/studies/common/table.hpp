// All runs of a study: rows of numbers and words, as in its CSV file.
//
// Numbers are written with 17 digits, so they are read back to the bit, and merged parts give the same headline and
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
  std::string name;   // with its unit: "mass_kg"
  bool text = false;  // words without commas, quotes and line ends
};

class Table {
 public:
  // Adds a first column for the number of the job that made the row.
  explicit Table(std::vector<Column> columns);

  // Adds a row, whose cells fit the columns after `job`.
  void add(std::size_t job, const Row& row);
  // Keeps the order of each job's rows.
  void sort_by_job();

  [[nodiscard]] std::size_t rows() const noexcept { return jobs_.size(); }
  [[nodiscard]] std::size_t job(std::size_t row) const noexcept { return jobs_[row]; }
  // Index of a column, for number() and text(). Throws std::out_of_range for an unknown name.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  [[nodiscard]] double number(std::size_t row, std::size_t column) const noexcept {
    return cells_[row * columns_.size() + column];
  }
  [[nodiscard]] const std::string& text(std::size_t row, std::size_t column) const noexcept {
    return words_[static_cast<std::size_t>(number(row, column))];
  }

  // Throws std::runtime_error if the file can't be written.
  void write_csv(const std::filesystem::path& file) const;
  // Adds the rows of a file that write_csv() made with the same columns. Throws description::SetupError with file and
  // line.
  void read_csv(const std::filesystem::path& file);

 private:
  std::size_t word(const std::string& text);

  std::vector<Column> columns_;
  std::vector<std::size_t> jobs_;
  std::vector<double> cells_;  // in a text column: the word's index
  std::vector<std::string> words_;
  std::map<std::string, std::size_t, std::less<>> word_index_;
};

}  // namespace proxarm::studies
