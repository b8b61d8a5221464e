#include "models/files/json.hpp"

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>

namespace proxarm::description {

using Library = nlohmann::ordered_json;

struct JsonLibrary {
  static Library to(const Json& value) {
    switch (value.kind_) {
      case Json::Kind::null:
        return nullptr;
      case Json::Kind::truth:
        return value.integer_ != 0;
      case Json::Kind::integer:
        return value.integer_;
      case Json::Kind::real:
        return value.real_;
      case Json::Kind::text:
        return value.text_;
      case Json::Kind::list:
        break;
      case Json::Kind::object: {
        Library object = Library::object();
        for (std::size_t i = 0; i < value.items_.size(); ++i) object.emplace(value.keys_[i], to(value.items_[i]));
        return object;
      }
    }
    Library list = Library::array();
    for (const Json& item : value.items_) list.push_back(to(item));
    return list;
  }

  static Json from(const Library& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number_integer()) return value.get<std::int64_t>();
    if (value.is_number()) return value.get<double>();
    if (value.is_string()) return value.get<std::string>();
    Json result;
    if (value.is_array()) {
      result = Json::array();
      for (const Library& item : value) result.push_back(from(item));
    } else if (value.is_object()) {
      result = Json::object();
      for (const auto& item : value.items()) result[item.key()] = from(item.value());
    }
    return result;
  }
};

Json::Json(std::initializer_list<Json> items) {
  if (items.size() > 0 && std::all_of(items.begin(), items.end(), [](const Json& item) { return item.is_pair(); })) {
    kind_ = Kind::object;
    for (const Json& item : items) (*this)[item.items_[0].text_] = item.items_[1];
  } else {
    kind_ = Kind::list;
    items_ = items;
  }
}

bool Json::is_pair() const noexcept {
  return kind_ == Kind::list && items_.size() == 2 && items_[0].kind_ == Kind::text;
}

Json& Json::operator[](std::string_view key) {
  assert(kind_ == Kind::null || kind_ == Kind::object);
  kind_ = Kind::object;
  const auto at = std::find(keys_.begin(), keys_.end(), key);
  if (at != keys_.end()) return items_[static_cast<std::size_t>(at - keys_.begin())];
  keys_.emplace_back(key);
  return items_.emplace_back();
}

void Json::push_back(Json value) {
  assert(kind_ == Kind::null || kind_ == Kind::list);
  kind_ = Kind::list;
  items_.push_back(std::move(value));
}

void Json::update(const Json& other) {
  for (std::size_t i = 0; i < other.items_.size(); ++i) (*this)[other.keys_[i]] = other.items_[i];
}

std::string Json::dump(int indent) const {
  return JsonLibrary::to(*this).dump(indent, ' ', false, Library::error_handler_t::replace);
}

std::optional<Json> Json::parse(std::string_view text) {
  const Library value = Library::parse(text.begin(), text.end(), nullptr, false);
  if (value.is_discarded()) return std::nullopt;
  return JsonLibrary::from(value);
}

const Json* Json::find(std::string_view key) const noexcept {
  const auto at = std::find(keys_.begin(), keys_.end(), key);
  return at == keys_.end() ? nullptr : &items_[static_cast<std::size_t>(at - keys_.begin())];
}

std::optional<std::string> Json::text_of(std::string_view key) const {
  const Json* value = find(key);
  if (!value || value->kind_ != Kind::text) return std::nullopt;
  return value->text_;
}

std::optional<std::int64_t> Json::integer_of(std::string_view key) const noexcept {
  const Json* value = find(key);
  if (!value || value->kind_ != Kind::integer) return std::nullopt;
  return value->integer_;
}

}  // namespace proxarm::description
