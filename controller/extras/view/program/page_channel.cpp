#include "controller/extras/view/program/page_channel.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace proxarm::command_line {

using nlohmann::json;
using view::SocketPtr;

view::Bytes text_of(const json& value) {
  return std::make_shared<const std::string>(value.dump(-1, ' ', false, json::error_handler_t::replace));
}

PageChannel::PageChannel(ControlLine& control, Welcome welcome, Wanted wanted)
    : control_(control), welcome_(std::move(welcome)), wanted_(std::move(wanted)) {}

void PageChannel::opened(const SocketPtr& socket) {
  sockets_.push_back(socket);
  welcome_(*socket);
}

void PageChannel::closed(const SocketPtr& socket) { std::erase(sockets_, socket); }

std::string PageChannel::choose(const std::vector<std::string>& /*offered*/) const { return {}; }

// Passes a page's message on. Drops the connection if the message is none that the page sends.
void PageChannel::received(const SocketPtr& socket, std::string_view message, bool binary) {
  const json said = binary ? json() : json::parse(message, nullptr, false);
  if (wanted_ && said.is_object() && wanted_(*socket, said)) return;
  if (!said.is_object() || said.size() != 2 || !said.contains("ask") || !said["ask"].is_string() ||
      !said.contains("id") || !said["id"].is_number_unsigned()) {
    return socket->drop();
  }
  const auto id = said["id"].get<std::uint64_t>();
  control_.ask(said["ask"].get<std::string>(), [socket, id](const std::string& answer) {
    socket->say(text_of({{"answer", {{"id", id}, {"text", answer}}}}), false);
  });
}

void PageChannel::show(const view::Bytes& moment) {
  const auto all = sockets_;  // a copy, because show() may remove a socket from `sockets_`
  for (const SocketPtr& socket : all) socket->show(moment);
}

void PageChannel::say(const view::Bytes& text) {
  const auto all = sockets_;
  for (const SocketPtr& socket : all) socket->say(text, false);
}

}  // namespace proxarm::command_line
