#include "controller/command_line/entry/help.hpp"

#include <sstream>

namespace proxarm::command_line {
namespace {

constexpr std::size_t text_column = 30;

// Wraps text to help_columns. The first line starts after `used` columns; later lines are indented by `margin`. Line
// breaks in the text are kept.
std::string wrapped(const std::string& text, std::size_t margin, std::size_t used) {
  std::string result;
  std::size_t column = used;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (column > margin && column + 1 + word.size() > help_columns) {
        result += "\n" + std::string(margin, ' ');
        column = margin;
      } else if (column > margin) {
        result += " ";
        ++column;
      }
      result += word;
      column += word.size();
    }
    if (lines.peek() == std::istringstream::traits_type::eof()) break;
    result += "\n" + std::string(margin, ' ');
    column = margin;
  }
  return result;
}

std::string entry(const std::string& name, const std::string& text) {
  std::string line = "  " + name;
  if (text.empty()) return line + "\n";
  if (line.size() >= text_column) {
    line += "\n" + std::string(text_column, ' ');
  } else {
    line += std::string(text_column - line.size(), ' ');
  }
  return line + wrapped(text, text_column, text_column) + "\n";
}

}  // namespace

// CLI11 shows a flag's default value as part of its name: "--hardware{ask}".
std::string HelpFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  std::string name = Formatter::make_option_name(option, is_positional);
  const std::size_t brace = name.find('{');
  if (brace != std::string::npos) name.erase(brace, name.find('}') + 1 - brace);
  return name;
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  return entry(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return entry(command->get_name(), command->get_description());
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return wrapped(app->get_description(), 0, 0) + "\n";
}

}  // namespace proxarm::command_line
