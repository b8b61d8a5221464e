#include "controller/extras/schema/json_schema.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <regex>

namespace proxarm::command_line {
namespace {

using description::Json;

// Converts a number to JSON. Whole numbers become integers, up to the largest that a double holds exactly.
Json number_json(double value) {
  constexpr double exact = 9007199254740992.0;  // 2⁵³
  if (value >= -exact && value <= exact && value == static_cast<double>(static_cast<std::int64_t>(value))) {
    return static_cast<std::int64_t>(value);
  }
  return value;
}

Json numeric(const Alternative& a, const char* type) {
  Json schema{{"type", type}};
  if (!a.values.empty()) {
    schema["enum"] = a.values;
    return schema;
  }
  if (a.range.min > std::numeric_limits<double>::lowest()) {
    schema[a.range.above_min ? "exclusiveMinimum" : "minimum"] = number_json(a.range.min);
  }
  if (a.range.max < std::numeric_limits<double>::max()) schema["maximum"] = number_json(a.range.max);
  if (!a.zero) return schema;
  Json any = Json::array();
  any.push_back(Json{{"const", 0}});
  any.push_back(schema);
  Json both = Json::object();
  both["anyOf"] = any;
  return both;
}

void add_sizes(Json& schema, const Alternative& a) {
  if (a.min_size > 0) schema["minItems"] = a.min_size;
  if (a.max_size != static_cast<std::size_t>(-1)) schema["maxItems"] = a.max_size;
}

Json text_schema(const Alternative& a, bool alone) {
  Json types = Json::array();
  types.push_back("string");
  if (a.pattern.empty()) {
    // Where only a text is allowed, the reader also takes an unquoted number or truth value as text.
    if (alone) types.push_back("number"), types.push_back("boolean");
    return {{"type", types},
            {"minLength", 1},
            {"maxLength", std::min<std::size_t>(a.max_size, 4096)}};  // the longest text that the reader takes
  }
  const std::regex expression(a.pattern);
  if (std::regex_match("123", expression) || std::regex_match("0x1000", expression)) types.push_back("integer");
  return {{"type", types}, {"pattern", "^(?:" + a.pattern + ")$"}};
}

Json one_schema(const Alternative& a, bool alone) {
  switch (a.kind) {
    case Alternative::Kind::map:
      return schema_of(*a.map);
    case Alternative::Kind::list: {
      Json schema{{"type", "array"}, {"items", schema_of(a.element)}};
      add_sizes(schema, a);
      return schema;
    }
    case Alternative::Kind::numbers: {
      Json schema{{"type", "array"}, {"items", numeric(a, "number")}};
      add_sizes(schema, a);
      return schema;
    }
    case Alternative::Kind::number:
      return numeric(a, "number");
    case Alternative::Kind::integer:
      return numeric(a, "integer");
    case Alternative::Kind::boolean:
      return Json{{"type", "boolean"}};
    case Alternative::Kind::choice:
      return Json{{"type", "string"}, {"enum", a.choices}};
    case Alternative::Kind::path:
    case Alternative::Kind::text:
      break;
  }
  return text_schema(a, alone);
}

Json condition_schema(const Condition& condition) {
  Json required = Json::array();
  required.push_back(condition.key);
  Json schema = Json::object();
  if (condition.kind == Condition::Kind::there) {
    schema["required"] = required;
    return schema;
  }
  if (condition.kind == Condition::Kind::absent) {
    schema["not"]["required"] = required;
    return schema;
  }
  schema["properties"][condition.key]["enum"] = condition.values;
  if (!condition.or_absent) schema["required"] = required;
  return schema;
}

Json all_of(const std::vector<Condition>& conditions) {
  if (conditions.size() == 1) return condition_schema(conditions.front());
  Json all = Json::array();
  for (const Condition& condition : conditions) all.push_back(condition_schema(condition));
  Json schema = Json::object();
  schema["allOf"] = all;
  return schema;
}

void add_case(Json& properties, Json& required, const KeyModel& key, const KeyCase& one) {
  if (one.standing == Standing::refused) {
    properties[key.name] = false;
    return;
  }
  Json value = schema_of(one.value);
  if (one.otherwise.size() == 1 && one.standing == Standing::optional) value["default"] = one.otherwise.front();
  properties[key.name].update(value);
  if (one.standing == Standing::required) required.push_back(key.name);
}

Json described(const KeyModel& key, const std::string& unit) {
  Json schema = Json::object();
  schema["description"] = key.meaning + (unit.empty() ? "" : " [" + unit + "]");
  return schema;
}

// The properties and the required keys that apply under one condition.
struct Branch {
  Json condition{}, properties = Json::object(), required = Json::array();
};

void add_branches(Json& schema, const std::vector<Branch>& branches) {
  if (branches.empty()) return;
  Json all = Json::array();
  for (const Branch& branch : branches) {
    Json then{{"properties", branch.properties}};
    if (!branch.required.items().empty()) then["required"] = branch.required;
    all.push_back(Json{{"if", branch.condition}, {"then", then}});
  }
  schema["allOf"] = all;
}

Branch& branch_for(std::vector<Branch>& branches, const std::vector<Condition>& when) {
  const Json condition = all_of(when);
  for (Branch& branch : branches) {
    if (branch.condition.dump() == condition.dump()) return branch;
  }
  branches.push_back({.condition = condition});
  return branches.back();
}

Json names_schema(const MapModel& map) {
  Json schema{{"type", "object"}, {"additionalProperties", schema_of(map.keys.front().cases.front().value)}};
  if (!map.names->empty()) schema["propertyNames"]["pattern"] = "^(?:" + *map.names + ")$";
  return schema;
}

}  // namespace

Json schema_of(const std::vector<Alternative>& value) {
  if (value.size() == 1) return one_schema(value.front(), true);
  Json any = Json::array();
  for (const Alternative& a : value) any.push_back(one_schema(a, false));
  Json schema = Json::object();
  schema["anyOf"] = any;
  return schema;
}

Json schema_of(const MapModel& map) {
  if (map.names) return names_schema(map);
  Json properties = Json::object(), required = Json::array();
  std::vector<Branch> branches;
  for (const KeyModel& key : map.keys) {
    if (is_refused(key)) continue;
    properties[key.name] = described(key, unit_of(key));
    for (const KeyCase& one : key.cases) {
      if (one.when.empty()) {
        add_case(properties, required, key, one);
      } else {
        Branch& branch = branch_for(branches, one.when);
        add_case(branch.properties, branch.required, key, one);
      }
    }
  }
  Json schema{{"type", "object"}, {"properties", properties}};
  if (!required.items().empty()) schema["required"] = required;
  schema["additionalProperties"] = false;
  add_branches(schema, branches);
  if (!map.exactly_one.empty()) {
    Json one = Json::array();
    for (const std::string& key : map.exactly_one) {
      Json keys = Json::array();
      keys.push_back(key);
      one.push_back(Json{{"required", keys}});
    }
    schema["oneOf"] = one;
  }
  return schema;
}

Json schema_of_file(const MapModel& root, const std::string& kind) {
  Json schema{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "proxarm " + kind + " file"}};
  schema.update(schema_of(root));
  return schema;
}

}  // namespace proxarm::command_line
