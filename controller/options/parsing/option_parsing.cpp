#include "controller/options/parsing/option_parsing.hpp"

#include <algorithm>

namespace proxarm::controller {

std::string options_mistake(const CLI::App& command, const std::vector<std::string>& words,
                            const CLI::ParseError& error) {
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  std::string message = error.what();
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (word.substr(0, 2) != "--" || std::find(known.begin(), known.end(), name) != known.end()) continue;
    message = "unknown option " + description::in_quotes(name);
    const std::string near = description::nearest(name, known);
    if (!near.empty()) message += "; did you mean " + near + "?";
    break;
  }
  return message;
}

CLI::callback_t whole_number(std::string option, std::function<void(std::uint64_t)> store) {
  return [option = std::move(option), store = std::move(store)](const CLI::results_t& words) {
    const std::string& word = words.back();
    if (word.empty() || word.size() > 16 || word.find_first_not_of("0123456789") != std::string::npos) {
      throw description::SetupError(
          {.key = option, .found = description::in_quotes(word), .expected = "a whole number of at most 16 digits"});
    }
    store(std::stoull(word));
    return true;
  };
}

void refuse_options_as_values(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (!option->nonpositional() || option->get_items_expected_max() == 0) continue;
    option->check([option](const std::string& value) -> std::string {
      if (value.rfind("--", 0) != 0) return {};
      throw description::SetupError({.key = option->get_name(),
                                     .found = value + ", which is another option",
                                     .expected = option->get_type_name()});
    });
  }
  for (CLI::App* command : app.get_subcommands({})) refuse_options_as_values(*command);
}

}  // namespace proxarm::controller
