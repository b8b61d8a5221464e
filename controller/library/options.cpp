#include "controller/library/options.hpp"

#include <algorithm>
#include <iterator>

#include "controller/options/run_words.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm {
namespace {

using description::SetupError;

// An option of the program alone, and what a session offers instead.
struct OfTheProgram {
  const char* name;
  const char* expected;
  const char* advice;
};

constexpr const char* real_arm = "sim: a real arm is run by the program alone, which has its supervision and clocks";
constexpr const char* run_it = "`proxarm run` runs one as a process of its own; from Python proxarm.run(\"--bus\", …)";
constexpr const char* no_view = "a session that nobody looks at while it runs";
constexpr const char* look_later = "give it a record, and look at that: proxarm view DIR";
constexpr const char* no_output = "a session that prints nothing: its summary is what it returns";
constexpr OfTheProgram of_the_program[] = {{"--bus", real_arm, run_it},
                                           {"--hardware", real_arm, run_it},
                                           {"--without-proof", real_arm, run_it},
                                           {"--view", no_view, look_later},
                                           {"--view-port", no_view, look_later},
                                           {"--view-control", no_view, look_later},
                                           {"--allow-origin", no_view, look_later},
                                           {"--json", no_output, ""},
                                           {"--verbose", no_output, ""}};

std::string option_of(const std::string& name) {
  std::string option = name == "cell" ? name : "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

void refuse_what_is_the_programs(const std::string& option, const OptionValue& value) {
  if (option == "--bus" && value.texts() == std::vector<std::string>{"sim"}) return;
  const auto* const found = std::find_if(std::begin(of_the_program), std::end(of_the_program),
                                         [&](const OfTheProgram& other) { return option == other.name; });
  if (found == std::end(of_the_program)) return;
  const std::string given = value.texts().empty() ? "this option" : description::in_quotes(value.texts().front());
  throw SetupError({.key = option, .found = given, .expected = found->expected, .advice = found->advice});
}

// The command line wants a unit with a time; it takes all other numbers in SI units without one.
std::string text_of(const std::string& text, bool is_number, const std::string& type) {
  const bool time = type.find("TIME") != std::string::npos && type.find('@') == std::string::npos;
  return is_number && time ? text + "s" : text;
}

constexpr const char* flag = "";  // the type of an option without a value

// `type`: what the option takes. The table refuses values that don't fit.
void add_words(std::vector<std::string>& words, const std::string& option, const OptionValue& value,
               const std::string& type) {
  if (value.is_on()) return words.push_back(option);
  if (type == flag) {
    throw SetupError(
        {.key = option, .found = description::in_quotes(value.texts().front()), .expected = "true or false"});
  }
  for (const std::string& given : value.texts()) {
    const std::string text = text_of(given, value.is_number(), type);
    if (option == "cell") {
      words.insert(words.end(), {"--", text});  // goes last, see run_options()
    } else if (text.empty()) {
      words.insert(words.end(), {option, text});
    } else {
      words.push_back(option + "=" + text);
    }
  }
}

}  // namespace

OptionValue::OptionValue(double number) : kind_(Kind::number), texts_{description::number_text(number)} {}

controller::RunOptions run_options(const SessionOptions& options) {
  std::vector<std::string> words, cell;
  for (const SessionOption& given : options) {
    if (given.value.is_off()) continue;
    const std::string option = option_of(given.name);
    refuse_what_is_the_programs(option, given.value);
    const std::string type = controller::run_option_type(option).value_or("unknown");
    add_words(option == "cell" ? cell : words, option, given.value, type);
  }
  words.insert(words.end(), cell.begin(), cell.end());
  return controller::run_options(words);
}

}  // namespace proxarm
