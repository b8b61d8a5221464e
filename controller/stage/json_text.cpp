#include "controller/stage/json_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "models/base/text.hpp"

namespace proxarm::view {

// Writes a comma if a member or value precedes, else nothing.
void JsonText::separate() {
  constexpr std::string_view nothing_before = "{[:";
  if (!text_.empty() && nothing_before.find(text_.back()) == std::string_view::npos) text_ += ',';
}

JsonText& JsonText::literal(std::string_view text) {
  separate();
  text_ += text;
  return *this;
}

JsonText& JsonText::begin_object() {
  open_ += '}';
  return literal("{");
}

JsonText& JsonText::begin_list() {
  open_ += ']';
  return literal("[");
}

JsonText& JsonText::end() {
  text_ += open_.back();
  open_.pop_back();
  return *this;
}

JsonText& JsonText::name(std::string_view name) {
  value(name);
  text_ += ':';
  return *this;
}

JsonText& JsonText::value(double number) {
  if (!std::isfinite(number)) return literal("null");
  std::array<char, 32> digits;  // the shortest exact text of a double has at most 24 characters
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return literal({digits.data(), static_cast<std::size_t>(end - digits.data())});
}

JsonText& JsonText::value(std::string_view text) {
  separate();
  text_ += '"';
  while (!text.empty()) {
    const std::size_t length = description::utf8_length(text);
    const char first = text.front();
    if (length == 0) {
      text_ += "\uFFFD";
    } else if (static_cast<unsigned char>(first) < 0x20) {
      std::array<char, 8> escaped;
      std::snprintf(escaped.data(), escaped.size(), "\\u%04x", static_cast<unsigned>(first));
      text_ += escaped.data();
    } else {
      if (first == '"' || first == '\\') text_ += '\\';
      text_ += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  text_ += '"';
  return *this;
}

}  // namespace proxarm::view
