// Writes and reads JSON through a plain class. It hides the library (nlohmann's), whose templates would double the
// compile time of each source that includes them.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace proxarm::description {

// A value: null, boolean, number, text, list, or an object whose keys keep their order.
//
//   Json json{{"cell", name}, {"stops", Json::array()}};
//   json["stops"].push_back({{"time_s", 0.1}, {"at_rest", true}});
class Json {
 public:
  Json() noexcept = default;  // null
  Json(std::nullptr_t) noexcept {}
  Json(bool value) noexcept : kind_(Kind::truth), integer_(value ? 1 : 0) {}
  Json(double value) noexcept : kind_(Kind::real), real_(value) {}
  Json(std::integral auto value) noexcept : kind_(Kind::integer), integer_(static_cast<std::int64_t>(value)) {}
  Json(std::string value) noexcept : kind_(Kind::text), text_(std::move(value)) {}
  Json(std::string_view value) : Json(std::string(value)) {}
  Json(const char* value) : Json(std::string(value)) {}
  Json(const std::optional<double>& value) noexcept : Json(value ? Json(*value) : Json()) {}
  template <class A, class B>
  Json(const std::pair<A, B>& pair) : kind_(Kind::list), items_{Json(pair.first), Json(pair.second)} {}
  template <class T>
  Json(const std::vector<T>& values) : kind_(Kind::list), items_(values.begin(), values.end()) {}

  // An object if every item is a pair that begins with a text; otherwise a list.
  Json(std::initializer_list<Json> items);

  static Json array() { return of_kind(Kind::list); }
  static Json object() { return of_kind(Kind::object); }

  // The value of a key; a missing one is created as null. Turns null into an object. Precondition: null or an object.
  Json& operator[](std::string_view key);

  // Turns null into a list. Precondition: null or a list.
  void push_back(Json value);

  // Precondition: a list that isn't empty.
  [[nodiscard]] Json& back() noexcept { return items_.back(); }

  // Precondition: both are objects.
  void update(const Json& other);

  // The text on one line, or with `indent` spaces per level. Invalid UTF-8 is replaced; numbers that aren't finite
  // become null.
  [[nodiscard]] std::string dump(int indent = -1) const;

  // nullopt if the text isn't JSON.
  static std::optional<Json> parse(std::string_view text);

  // The value of a key; nullptr if it is missing or this isn't an object.
  [[nodiscard]] const Json* find(std::string_view key) const noexcept;

  // The text, or whole number, of a key; nullopt if it is missing or of another kind.
  [[nodiscard]] std::optional<std::string> text_of(std::string_view key) const;
  [[nodiscard]] std::optional<std::int64_t> integer_of(std::string_view key) const noexcept;

  [[nodiscard]] const std::vector<Json>& items() const noexcept { return items_; }  // of a list or an object

 private:
  enum class Kind : std::uint8_t { null, truth, integer, real, text, list, object };
  friend struct JsonLibrary;  // json.cpp: converts to and from the library's values

  static Json of_kind(Kind kind) {
    Json value;
    value.kind_ = kind;
    return value;
  }
  [[nodiscard]] bool is_pair() const noexcept;

  Kind kind_ = Kind::null;
  std::int64_t integer_ = 0;
  double real_ = 0.0;
  std::string text_;
  std::vector<std::string> keys_;  // of an object, one per item
  std::vector<Json> items_;
};

}  // namespace proxarm::description
