// What a session of a program of one's own is asked for: the options of `proxarm run`, by the names that they have
// there.
//
//   {{"scene", "scenes/wall.yaml"}, {"mass", 5.0}, {"duration", 6.0}, {"fault", {"axis_2:silent@2s"}}}
//
// The command line's own table reads them (command_line/options/run_words.hpp): it knows their values, and it refuses
// with its words what it doesn't know.
#pragma once

#include <concepts>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "controller/command_line/preparation/run_options.hpp"

namespace proxarm {

// A number in SI units; a text as on the command line, such as "4kg"; several of an option that may be repeated; true
// of one that takes nothing. False is as if the option weren't there.
class OptionValue {
 public:
  OptionValue(bool on) : kind_(on ? Kind::on : Kind::off) {}
  OptionValue(double number);
  OptionValue(std::integral auto number) : OptionValue(static_cast<double>(number)) {}
  OptionValue(std::string text) : texts_{std::move(text)} {}
  OptionValue(const char* text) : texts_{text} {}
  OptionValue(const std::filesystem::path& file) : texts_{file.string()} {}
  OptionValue(std::vector<std::string> texts) : texts_(std::move(texts)) {}
  OptionValue(std::initializer_list<const char*> texts) : texts_(texts.begin(), texts.end()) {}

  [[nodiscard]] bool is_off() const noexcept { return kind_ == Kind::off; }
  [[nodiscard]] bool is_on() const noexcept { return kind_ == Kind::on; }
  [[nodiscard]] bool is_number() const noexcept { return kind_ == Kind::number; }
  [[nodiscard]] const std::vector<std::string>& texts() const noexcept { return texts_; }

 private:
  enum class Kind : unsigned char { off, on, number, text };

  Kind kind_ = Kind::text;
  std::vector<std::string> texts_;
};

// `name` without its hyphens in front; within it a hyphen or an underscore: "extra-delay" and "extra_delay" are one.
// The cell's file, which has no name on the command line, is "cell".
struct SessionOption {
  std::string name;
  OptionValue value;
};

// No vector: of one option with a text, {{"scene", "scenes/wall.yaml"}}, that would take the two for iterators.
class SessionOptions {
 public:
  SessionOptions() = default;
  SessionOptions(std::initializer_list<SessionOption> options) : options_(options) {}
  void add(SessionOption option) { options_.push_back(std::move(option)); }

  [[nodiscard]] auto begin() const noexcept { return options_.begin(); }
  [[nodiscard]] auto end() const noexcept { return options_.end(); }

 private:
  std::vector<SessionOption> options_;
};

// What the command line makes of them. Throws SetupError, with its words; also for options that only the program has:
// those of a real arm, of the view, and of what it prints.
command_line::RunOptions run_options(const SessionOptions& options);

}  // namespace proxarm
