#include "controller/extras/commissioning/cell_change.hpp"

#include <fstream>
#include <sstream>

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw SetupError({.file = file.string(), .message = "can't be read"});
  return text.str();
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw SetupError({.file = file.string(), .message = "can't be written"});
}

fs::path backup_of(const fs::path& file, const std::string& what) {
  for (int number = 1; number < 1000; ++number) {
    const fs::path backup = file.string() + ".before-" + what + (number == 1 ? "" : "-" + std::to_string(number));
    std::error_code ignored;
    if (!fs::exists(backup, ignored)) return backup;
  }
  throw SetupError({.file = file.string(), .message = "a thousand backups are there already"});
}

}  // namespace

bool in_comment(const std::string& text, std::size_t at) {
  const std::size_t line_begin = text.rfind('\n', at);
  const std::size_t from = line_begin == std::string::npos ? 0 : line_begin;
  return text.substr(from, at - from).find('#') != std::string::npos;
}

fs::path change_cell(const fs::path& file, const std::string& what,
                     const std::function<std::string(const std::string& text)>& edit,
                     const std::function<void(const description::Cell& written)>& check) {
  const std::string before = read_text(file);
  const fs::path fresh = file.string() + ".changing";
  write_text(fresh, edit(before));
  try {
    check(description::load_cell(fresh));
  } catch (const SetupError&) {
    std::error_code ignored;
    fs::remove(fresh, ignored);
    throw;
  }
  const fs::path backup = backup_of(file, what);
  write_text(backup, before);
  fs::rename(fresh, file);
  return backup;
}

}  // namespace proxarm::command_line
