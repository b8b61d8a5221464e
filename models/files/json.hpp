// Writes and reads JSON through a plain class. The class hides the library (nlohmann's), whose templates would double
// the compile time of each source that includes them.
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

// A JSON value: null, boolean, number, text, list, or an object, whose keys keep their order.
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

  // Makes an object if every item is a pair that begins with a text; otherwise makes a list.
  Json(std::initializer_list<Json> items);

  static Json array() { return of_kind(Kind::list); }
  static Json object() { return of_kind(Kind::object); }

  // Returns the value of a key. If the key is missing, it is added with the value null. Turns a null value into an
  // object. Precondition: this value is null or an object.
  Json& operator[](std::string_view key);

  // Appends to a list. Turns a null value into a list. Precondition: this value is null or a list.
  void push_back(Json value);

  // Precondition: this value is a list that isn't empty.
  [[nodiscard]] Json& back() noexcept { return items_.back(); }

  // Takes the keys and values of `other`. Precondition: both values are objects.
  void update(const Json& other);

  // Returns the text on one line or, with `indent` ≥ 0, with this number of spaces per level. Invalid UTF-8 is
  // replaced, and numbers that aren't finite become null.
  [[nodiscard]] std::string dump(int indent = -1) const;

  // Returns nullopt if the text isn't JSON.
  static std::optional<Json> parse(std::string_view text);

  // Returns the value of a key, or nullptr if the key is missing or this value isn't an object.
  [[nodiscard]] const Json* find(std::string_view key) const noexcept;

  // Return the text or the whole number of a key, or nullopt if the key is missing or its value has another kind.
  [[nodiscard]] std::optional<std::string> text_of(std::string_view key) const;
  [[nodiscard]] std::optional<std::int64_t> integer_of(std::string_view key) const noexcept;

  // Returns the items of a list, or the values of an object.
  [[nodiscard]] const std::vector<Json>& items() const noexcept { return items_; }

 private:
  enum class Kind : std::uint8_t { null, truth, integer, real, text, list, object };
  friend struct JsonLibrary;  // in json.cpp; converts to and from the library's values

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
  std::vector<std::string> keys_;  // the keys of an object, one per item
  std::vector<Json> items_;
};

}  // namespace proxarm::description
