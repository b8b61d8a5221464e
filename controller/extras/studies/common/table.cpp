#include "controller/extras/studies/common/table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <numeric>
#include <stdexcept>

#include "models/base/setup_error.hpp"

namespace proxarm::studies {
namespace {

std::string number_text(double value) {
  char text[40];
  if (value == std::floor(value) && std::abs(value) < 1e15) {
    std::snprintf(text, sizeof text, "%.0f", value);
  } else {
    std::snprintf(text, sizeof text, "%.17g", value);
  }
  return text;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells{""};
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

bool parse_number(const std::string& text, double& value) {
  char* end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return !text.empty() && end == text.c_str() + text.size();
}

}  // namespace

Table::Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

std::size_t Table::word(const std::string& text) {
  if (text.find_first_of(",\"\r\n") != std::string::npos) throw std::logic_error("no word of a table: " + text);
  const auto [found, is_new] = word_index_.emplace(text, words_.size());
  if (is_new) words_.push_back(text);
  return found->second;
}

void Table::add(std::size_t job, const Row& row) {
  if (row.size() != columns_.size()) throw std::logic_error("a row that doesn't fit its table");
  jobs_.push_back(job);
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (columns_[i].text) {
      cells_.push_back(static_cast<double>(word(std::get<std::string>(row[i]))));
    } else {
      cells_.push_back(std::get<double>(row[i]));
    }
  }
}

void Table::sort_by_job() {
  std::vector<std::size_t> order(jobs_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) { return jobs_[a] < jobs_[b]; });
  std::vector<std::size_t> jobs;
  std::vector<double> cells;
  jobs.reserve(jobs_.size());
  cells.reserve(cells_.size());
  for (const std::size_t row : order) {
    jobs.push_back(jobs_[row]);
    const auto from = cells_.begin() + static_cast<std::ptrdiff_t>(row * columns_.size());
    cells.insert(cells.end(), from, from + static_cast<std::ptrdiff_t>(columns_.size()));
  }
  jobs_ = std::move(jobs);
  cells_ = std::move(cells);
}

std::size_t Table::column(std::string_view name) const {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].name == name) return i;
  }
  throw std::out_of_range("no column " + std::string(name));
}

void Table::write_csv(const std::filesystem::path& file) const {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(file.c_str(), "w"), &std::fclose);
  if (out == nullptr) throw std::runtime_error(file.string() + ": can't be written");
  std::string line = "job";
  for (const Column& column : columns_) line += "," + column.name;
  line += "\n";
  bool good = std::fwrite(line.data(), 1, line.size(), out.get()) == line.size();
  for (std::size_t row = 0; row < rows(); ++row) {
    line = std::to_string(jobs_[row]);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      line += "," + (columns_[i].text ? text(row, i) : number_text(number(row, i)));
    }
    line += "\n";
    good = good && std::fwrite(line.data(), 1, line.size(), out.get()) == line.size();
  }
  if (!good || std::fflush(out.get()) != 0) throw std::runtime_error(file.string() + ": can't be written");
}

void Table::read_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  int line_number = 0;
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    throw description::SetupError(
        {.file = file.string(), .line = line_number, .key = "row", .found = found, .expected = expected});
  };
  if (!in) refuse("no such file", "the CSV file of a study");
  std::string header = "job";
  for (const Column& column : columns_) header += "," + column.name;
  std::string line;
  ++line_number;
  if (!std::getline(in, line) || line != header) refuse("'" + line.substr(0, 60) + "'", "'" + header + "'");
  while (std::getline(in, line)) {
    ++line_number;
    const std::vector<std::string> cells = split(line);
    if (cells.size() != columns_.size() + 1) refuse(std::to_string(cells.size()) + " cells", "as many as the header");
    double job = 0.0;
    if (!parse_number(cells[0], job) || !(job >= 0.0 && job < 1e15)) refuse("'" + cells[0] + "'", "a job's number");
    Row row;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      double value = 0.0;
      if (columns_[i].text) {
        row.emplace_back(cells[i + 1]);
      } else if (parse_number(cells[i + 1], value)) {
        row.emplace_back(value);
      } else {
        refuse("'" + cells[i + 1] + "'", "a number for " + columns_[i].name);
      }
    }
    add(static_cast<std::size_t>(job), row);
  }
}

}  // namespace proxarm::studies
