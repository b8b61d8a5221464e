// Makes parsers of option values. CLI11 calls a parser while it parses the command line, so CLI11's error message names
// the option.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {

// Adds an option that takes a quantity with its unit. `parse` reads its text, and names the option in errors.
// Precondition: `target` outlives the parsing.
template <typename Value, typename Target>
CLI::Option* add_quantity(CLI::App& app, const char* name, Value (*parse)(std::string_view, std::string_view),
                          Target& target, const char* help) {
  const auto take = [name, parse, &target](const CLI::results_t& words) {
    target = parse(words.back(), name);
    return true;
  };
  return app.add_option(name, CLI::callback_t(take), help);
}

// Returns a callback that parses the option's text and stores the value.
template <typename Parse, typename Store>
CLI::callback_t quantity(Parse parse, Store store) {
  return [parse, store](const CLI::results_t& words) {
    store(parse(words.back()));
    return true;
  };
}

template <typename Value, typename Store>
CLI::callback_t choice(std::string option, std::map<std::string, Value> choices, Store store) {
  return [option = std::move(option), choices = std::move(choices), store](const CLI::results_t& words) {
    const auto found = choices.find(words.back());
    if (found == choices.end()) {
      std::vector<std::string> known;
      for (const auto& [word, value] : choices) known.push_back(word);
      throw description::SetupError(
          {.key = option, .found = description::in_quotes(words.back()), .expected = description::one_of(known)});
    }
    store(found->second);
    return true;
  };
}

// Returns CLI11's message about options as one line, with the option of `command` that is spelt most like the wrong
// one.
std::string options_mistake(const CLI::App& command, const std::vector<std::string>& words,
                            const CLI::ParseError& error);

// Returns a parser of a whole number in decimal digits.
CLI::callback_t whole_number(std::string option, std::function<void(std::uint64_t)> store);

// Refuses an option in the place of another one's value, in the app and its commands: in `--record --duration=1s` the
// folder was left out. Call it after all options are added.
void refuse_options_as_values(CLI::App& app);

}  // namespace proxarm::controller
