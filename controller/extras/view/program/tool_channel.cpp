#include "controller/extras/view/program/tool_channel.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>

#include "controller/extras/view/program/page_channel.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using nlohmann::json;
using view::SocketPtr;
using view::Topic;

constexpr std::array protocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};
constexpr std::size_t most_subscriptions = 64;

struct Parameter {
  const char* name;
  const char* unit;
};
constexpr std::array<Parameter, 3> parameters{{{"mass", "kg"}, {"damping", "Ns/m"}, {"spring", "N/m"}}};

// Returns the number of a topic's channel. Channels are numbered from 1 in the order of the topics.
std::uint32_t channel_of(Topic topic) { return static_cast<std::uint32_t>(topic) + 1; }

// Returns whether a topic needs a controller. A simulated arm without a controller doesn't have such topics.
bool is_of_controller(Topic topic) {
  return topic == Topic::proxy || topic == Topic::contact || topic == Topic::session || topic == Topic::contacts ||
         topic == Topic::contact_arrows;
}

json channels(bool arm_alone) {
  json all = json::array();
  for (std::size_t i = 0; i < view::topic_count; ++i) {
    if (arm_alone && is_of_controller(static_cast<Topic>(i))) continue;
    const view::TopicDescription& topic = view::describe(static_cast<Topic>(i));
    all.push_back({{"id", channel_of(static_cast<Topic>(i))},
                   {"topic", topic.topic},
                   {"encoding", "json"},
                   {"schemaName", topic.schema},
                   {"schema", topic.json_schema},
                   {"schemaEncoding", "jsonschema"}});
  }
  return all;
}

view::Bytes data_message(std::uint32_t subscription, std::int64_t time_ns, const std::string& text) {
  std::string bytes(13, '\x01');
  std::memcpy(bytes.data() + 1, &subscription, sizeof subscription);
  std::memcpy(bytes.data() + 5, &time_ns, sizeof time_ns);
  return std::make_shared<const std::string>(bytes + text);
}

std::set<std::string> names_in(const json& list) {
  std::set<std::string> names;
  for (const json& name : list) {
    if (name.is_string()) names.insert(name.get<std::string>());
  }
  if (names.empty()) {
    for (const Parameter& parameter : parameters) names.insert(parameter.name);
  }
  return names;
}

void warn(view::Socket& socket, const std::string& text) {
  constexpr int warning = 1;
  socket.say(text_of({{"op", "status"}, {"level", warning}, {"message", text}}), false);
}

std::int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

bool same(const std::vector<models::Pose>& a, const std::vector<models::Pose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const auto& x, const auto& y) { return x.matrix() == y.matrix(); });
}

}  // namespace

ToolChannel::ToolChannel(const view::Stage& stage, const view::PresentSettings& settings, ControlLine& control)
    : stage_(stage), settings_(settings), control_(control), messages_(stage), session_id_(std::to_string(now_ns())) {}

std::string ToolChannel::choose(const std::vector<std::string>& offered) const {
  for (const char* known : protocols) {
    if (std::find(offered.begin(), offered.end(), known) != offered.end()) return known;
  }
  return {};
}

void ToolChannel::opened(const SocketPtr& socket) {
  if (socket->protocol().empty()) return socket->drop();
  clients_.push_back({.socket = socket, .subscriptions = {}, .watched = {}, .drawn = {}, .has_scene = false});
  socket->say(text_of({{"op", "serverInfo"},
                       {"name", "proxarm: " + stage_.scene().name},
                       {"capabilities", {"parameters", "parametersSubscribe"}},
                       {"supportedEncodings", {"json"}},
                       {"metadata", json::object()},
                       {"sessionId", session_id_}}),
              false);
  socket->say(text_of({{"op", "advertise"}, {"channels", channels(stage_.options().arm_alone)}}), false);
}

void ToolChannel::closed(const SocketPtr& socket) {
  std::erase_if(clients_, [&](const Client& client) { return client.socket == socket; });
}

void ToolChannel::received(const SocketPtr& socket, std::string_view message, bool binary) {
  const auto client =
      std::find_if(clients_.begin(), clients_.end(), [&](const Client& c) { return c.socket == socket; });
  if (client == clients_.end()) return;
  const json said = binary ? json() : json::parse(message, nullptr, false);
  if (!said.is_object() || !said.contains("op") || !said["op"].is_string() || !obey(*client, said)) socket->drop();
}

// Does what a client's message says. Returns false if the message isn't of the protocol, or uses a capability that this
// server doesn't offer.
bool ToolChannel::obey(Client& client, const json& said) {
  const auto op = said["op"].get<std::string>();
  const auto list = [&](const char* name) {
    return said.contains(name) && said[name].is_array() ? said[name] : json::array();
  };
  const std::string id = said.contains("id") && said["id"].is_string() ? said["id"].get<std::string>() : "";
  if (op == "subscribe") {
    subscribe(client, list("subscriptions"));
  } else if (op == "unsubscribe") {
    for (const json& number : list("subscriptionIds")) {
      if (number.is_number_unsigned()) client.subscriptions.erase(number.get<std::uint32_t>());
    }
  } else if (op == "getParameters") {
    send_parameters(client, names_in(list("parameterNames")), id);
  } else if (op == "setParameters") {
    set_parameters(client, list("parameters"), id);
  } else if (op == "subscribeParameterUpdates") {
    client.watched.merge(names_in(list("parameterNames")));
  } else if (op == "unsubscribeParameterUpdates") {
    for (const std::string& name : names_in(list("parameterNames"))) client.watched.erase(name);
  } else {
    return false;
  }
  return true;
}

void ToolChannel::subscribe(Client& client, const json& subscriptions) {
  for (const json& one : subscriptions) {
    if (!one.is_object() || !one.contains("id") || !one["id"].is_number_unsigned() || !one.contains("channelId") ||
        !one["channelId"].is_number_unsigned()) {
      continue;
    }
    const auto channel = one["channelId"].get<std::uint64_t>();
    if (channel < 1 || channel > view::topic_count ||
        (stage_.options().arm_alone && is_of_controller(static_cast<Topic>(channel - 1))) ||
        client.subscriptions.size() >= most_subscriptions) {
      warn(*client.socket, "there is no channel " + std::to_string(channel));
      continue;
    }
    client.subscriptions[one["id"].get<std::uint32_t>()] = static_cast<Topic>(channel - 1);
    client.has_scene = client.has_scene && static_cast<Topic>(channel - 1) != Topic::scene;
  }
}

double ToolChannel::value_of(const std::string& name) const {
  if (name == "mass") return settings_.mass_kg;
  return name == "damping" ? settings_.damping_Ns_per_m : settings_.spring_N_per_m;
}

void ToolChannel::send_parameters(Client& client, const std::set<std::string>& names, const std::string& id) {
  std::map<std::string, double> values;
  for (const Parameter& parameter : parameters) {
    if (names.contains(parameter.name)) values[parameter.name] = value_of(parameter.name);
  }
  send_values(client, values, id);
}

void ToolChannel::send_values(Client& client, const std::map<std::string, double>& all, const std::string& id) {
  json values = json::array();
  for (const auto& [name, value] : all) values.push_back({{"name", name}, {"value", value}, {"type", "float64"}});
  json answer{{"op", "parameterValues"}, {"parameters", values}};
  if (!id.empty()) answer["id"] = id;
  client.socket->say(text_of(answer), false);
}

void ToolChannel::set_parameters(Client& client, const json& wanted, const std::string& id) {
  for (const json& one : wanted) {
    if (!one.is_object() || !one.contains("name") || !one["name"].is_string() || !one.contains("value")) continue;
    const auto name = one["name"].get<std::string>();
    const bool known = std::any_of(parameters.begin(), parameters.end(), [&](const auto& p) { return name == p.name; });
    if (!known || !one["value"].is_number()) {
      warn(*client.socket, "there is no parameter " + description::in_quotes(name) + " of such a value");
      continue;
    }
    set_parameter(client.socket, name, one["value"].get<double>(), id);
  }
}

void ToolChannel::set_parameter(const SocketPtr& socket, const std::string& name, double value, const std::string& id) {
  const auto parameter =
      std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& p) { return name == p.name; });
  control_.ask(name + "=" + description::number_text(value) + parameter->unit,
               [this, socket, name, value, id](const std::string& answer) {
                 const auto client = std::find_if(clients_.begin(), clients_.end(),
                                                  [&](const Client& c) { return c.socket == socket; });
                 if (client == clients_.end()) return;
                 // `settings_` doesn't have an accepted value yet, as the value takes effect in one of the next cycles.
                 // So the accepted value itself is sent.
                 const bool taken = answer.compare(0, 4, "ok: ") == 0;
                 if (!taken) warn(*socket, answer);
                 if (!id.empty()) send_values(*client, {{name, taken ? value : value_of(name)}}, id);
               });
}

void ToolChannel::tell_changes() {
  std::array<double, 3> now{};
  for (std::size_t i = 0; i < parameters.size(); ++i) now[i] = value_of(parameters[i].name);
  if (now == told_) return;
  told_ = now;
  for (Client& client : clients_) {
    if (!client.watched.empty()) send_parameters(client, client.watched, "");
  }
}

void ToolChannel::show(const view::Moment& given) {
  if (clock_ns_ == 0) {
    clock_ns_ = now_ns() - given.record.time_ns;
  }
  if (clients_.empty()) return;
  tell_changes();
  // The tools expect the machine's time instead of the session's.
  view::Moment moment = given;
  moment.record.time_ns += clock_ns_;
  stage_.place(moment.record, moment.rendered_s, links_, objects_);
  std::map<Topic, std::string> texts;
  for (Client& client : clients_) {
    if (!client.socket->idle()) continue;  // a busy client gets a later moment
    for (const auto& [subscription, topic] : client.subscriptions) {
      if (topic == Topic::scene) {
        if (client.has_scene && same(client.drawn, objects_)) continue;
        client.drawn = objects_;
        client.has_scene = true;
      }
      auto text = texts.find(topic);
      if (text == texts.end()) text = texts.emplace(topic, messages_.message(topic, moment, links_, objects_)).first;
      client.socket->say(data_message(subscription, moment.record.time_ns, text->second), true);
    }
  }
}

}  // namespace proxarm::command_line
