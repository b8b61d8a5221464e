// Defines the exception for mistakes at set-up: a file, an option, a bus or a drive isn't as required.
//
// The error states the place (file, line, key; or bus, node, object), the value found, the value expected, and what to
// do. what() returns one line, such as
//   scenes/wall.yaml:12: objects[0].friction: found -0.3, expected a number from 0 to 10 (no unit)
//   bus axes_1_3, node 2, object 1000h:00: found 0x00030191, expected 0x00020192; is another drive set to this node?
// It is thrown only during set-up, never from the cycle. The command line then exits with status 2.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace proxarm::description {

// The parts of an error. All fields may be empty. Use designated initialisers: SetupError({.key = "--mass", .found =
// "-1", ...}).
struct SetupProblem {
  std::string file{};    // as the user gave it
  int line = 0;          // from 1; 0: unknown
  int column = 0;        // from 1; 0: unknown
  std::string bus{};     // name in the cell, or name of the interface
  int node = 0;          // CANopen node or Modbus unit; 0: no node
  std::string object{};  // object in the node, such as "1000h:00 device type"
  // The dotted path in the file, such as objects[0].friction, or an option of the command line.
  std::string key{};
  std::string message{};   // a sentence, if `found` and `expected` aren't enough
  std::string found{};     // the value found
  std::string expected{};  // the expected range or kind, with its unit
  std::string advice{};    // what the user can do
};

class SetupError : public std::runtime_error {
 public:
  explicit SetupError(SetupProblem problem);

  [[nodiscard]] const SetupProblem& problem() const noexcept { return problem_; }
  [[nodiscard]] const std::string& file() const noexcept { return problem_.file; }
  [[nodiscard]] int line() const noexcept { return problem_.line; }
  [[nodiscard]] int column() const noexcept { return problem_.column; }
  [[nodiscard]] const std::string& bus() const noexcept { return problem_.bus; }
  [[nodiscard]] int node() const noexcept { return problem_.node; }
  [[nodiscard]] const std::string& object() const noexcept { return problem_.object; }
  [[nodiscard]] const std::string& key() const noexcept { return problem_.key; }
  [[nodiscard]] const std::string& found() const noexcept { return problem_.found; }
  [[nodiscard]] const std::string& expected() const noexcept { return problem_.expected; }
  [[nodiscard]] const std::string& advice() const noexcept { return problem_.advice; }

 private:
  SetupProblem problem_;
};

// Returns foreign text in double quotes, safe for one line of a message. Control characters and broken UTF-8 are
// replaced by \xNN. The text ends with "..." after `max_bytes`.
std::string in_quotes(std::string_view text, std::size_t max_bytes = 60);

// Returns the shortest decimal number that reads back as `value`.
std::string number_text(double value);

}  // namespace proxarm::description
