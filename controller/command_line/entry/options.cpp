#include "controller/command_line/entry/options.hpp"

namespace proxarm::command_line {

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

}  // namespace proxarm::command_line
