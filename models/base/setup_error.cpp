#include "models/base/setup_error.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

std::string where(const SetupProblem& p) {
  std::string text = p.file;
  if (!p.file.empty() && p.line > 0) text += ":" + std::to_string(p.line);
  std::string device;
  const auto add = [&device](const std::string& part) {
    if (!device.empty()) device += ", ";
    device += part;
  };
  if (!p.bus.empty()) add("bus " + p.bus);
  if (p.node > 0) add("node " + std::to_string(p.node));
  if (!p.object.empty()) add("object " + p.object);
  for (const std::string& part : {device, p.key}) {
    if (part.empty()) continue;
    if (!text.empty()) text += ": ";
    text += part;
  }
  return text;
}

std::string one_line(const SetupProblem& p) {
  std::string what = p.message;
  if (!p.found.empty()) what += std::string(what.empty() ? "" : ": ") + "found " + p.found;
  if (!p.expected.empty()) what += std::string(what.empty() ? "" : ", ") + "expected " + p.expected;
  if (!p.advice.empty()) what += std::string(what.empty() ? "" : "; ") + p.advice;
  const std::string place = where(p);
  return place.empty() ? what : place + ": " + what;
}

}  // namespace

SetupError::SetupError(SetupProblem problem) : std::runtime_error(one_line(problem)), problem_(std::move(problem)) {}

std::string in_quotes(std::string_view text, std::size_t max_bytes) {
  std::string out = "\"";
  for (std::size_t i = 0; i < text.size();) {
    if (i >= max_bytes) return out + "...\"";
    const std::size_t length = utf8_length(text.substr(i));
    const auto byte = static_cast<unsigned char>(text[i]);
    // U+0080..U+009F are control characters of terminals, too.
    const bool c1 = length == 2 && byte == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0;
    if (length == 0 || byte < 0x20 || byte == 0x7f || c1) {
      constexpr std::string_view digits = "0123456789abcdef";
      out += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
      ++i;
    } else {
      out += text.substr(i, length);
      i += length;
    }
  }
  return out + "\"";
}

std::string number_text(double value) {
  std::array<char, 32> buffer;
  const double size = std::abs(value);
  const bool fixed = value == 0.0 || (size >= 1e-5 && size < 1e15);  // the result then has at most 6 + 17 digits
  const auto format = fixed ? std::chars_format::fixed : std::chars_format::scientific;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format);
  return {buffer.data(), result.ptr};
}

}  // namespace proxarm::description
