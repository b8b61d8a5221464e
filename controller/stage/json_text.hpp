// Writes JSON sequentially. Compared with the objects of a JSON library, this takes a tenth of the time, which matters
// for messages of every cycle, and compiles in a quarter of the time.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace proxarm::view {

class JsonText {
 public:
  JsonText& begin_object();
  JsonText& begin_list();
  // Ends the innermost object or list. Precondition: there is one.
  JsonText& end();

  // Writes the name of the next value of an object.
  JsonText& name(std::string_view name);

  // Writes a number; null if the number isn't finite, since JSON has no infinity (such as the distance to no object).
  JsonText& value(double number);
  JsonText& value(std::integral auto number) { return literal(std::to_string(number)); }
  JsonText& value(bool flag) { return literal(flag ? "true" : "false"); }
  // Writes a text. Bytes that aren't valid UTF-8 become U+FFFD.
  JsonText& value(std::string_view text);
  JsonText& value(const char* text) { return value(std::string_view(text)); }
  JsonText& value(const std::string& text) { return value(std::string_view(text)); }
  JsonText& null() { return literal("null"); }
  // Adds what another JsonText has written as a value, and clears the other JsonText. Precondition: the other text is a
  // complete value.
  JsonText& splice(JsonText& whole) { return literal(whole.take()); }

  template <typename Value>
  JsonText& add(std::string_view its_name, const Value& its_value) {
    return name(its_name).value(its_value);
  }

  // Returns the written text, and clears it.
  std::string take() { return std::move(text_); }

 private:
  JsonText& literal(std::string_view text);
  void separate();
  std::string text_;
  std::string open_;  // closing brackets to come, the innermost last
};

}  // namespace proxarm::view
