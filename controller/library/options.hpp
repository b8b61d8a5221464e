// Options of a session in your own program: the options of `proxarm run`, by their names there.
//
//   {{"scene", "scenes/wall.yaml"}, {"mass", 5.0}, {"duration", 6.0}, {"fault", {"axis_2:silent@2s"}}}
//
// The command line's table reads them (controller/options/run_words.hpp), so names, values and error messages are the
// command line's.
#pragma once

#include <concepts>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "controller/preparation/run_options.hpp"

namespace proxarm {

// A number is in SI units; a text is as on the command line, such as "4kg". A list is for an option that may be
// repeated, true for an option without a value. False leaves the option out.
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

// `name` has no leading hyphens; "extra-delay" and "extra_delay" are the same option. The cell's file, a positional
// argument of the command line, is "cell".
struct SessionOption {
  std::string name;
  OptionValue value;
};

// A class instead of a vector: a vector would take {{"scene", "scenes/wall.yaml"}} for a pair of iterators.
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

// Returns what the command line makes of these options. Throws SetupError with the command line's words, also for
// options of the program alone: a real arm, the view, and what is printed.
controller::RunOptions run_options(const SessionOptions& options);

}  // namespace proxarm
