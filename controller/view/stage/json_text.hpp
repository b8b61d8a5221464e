// Writes JSON sequentially. For messages of every cycle this takes a tenth of the time of a JSON library's objects, and
// compiles in a quarter of the time.
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

  // Within an object: the name of the next value.
  JsonText& name(std::string_view name);

  // A number; null if it isn't finite, since JSON has no infinity (such as the distance to no object).
  JsonText& value(double number);
  JsonText& value(std::integral auto number) { return literal(std::to_string(number)); }
  JsonText& value(bool flag) { return literal(flag ? "true" : "false"); }
  // A text; bytes that aren't valid UTF-8 become U+FFFD.
  JsonText& value(std::string_view text);
  JsonText& value(const char* text) { return value(std::string_view(text)); }
  JsonText& value(const std::string& text) { return value(std::string_view(text)); }
  JsonText& null() { return literal("null"); }
  // Adds another complete text as a value, and clears that text.
  JsonText& splice(JsonText& whole) { return literal(whole.take()); }

  template <typename Value>
  JsonText& add(std::string_view its_name, const Value& its_value) {
    return name(its_name).value(its_value);
  }

  // Returns what was written, and clears it.
  std::string take() { return std::move(text_); }

 private:
  JsonText& literal(std::string_view text);
  void separate();
  std::string text_;
  std::string open_;  // pending closing brackets, the innermost last
};

}  // namespace proxarm::view
