// Exchanges messages with pages over their WebSockets.
//
// Text messages to the page are JSON with one key:
//   "stage"      what to draw (view/stage/stage.hpp), with "mode" and "control"
//   "settings"   the settings after a change (view/stage/present_settings.hpp)
//   "status"     the session's status
//   "answer"     {"id": N, "text": …}, the answer to the page's line with that id
//   "spectrum"   in a running session, the handle's vibration, four times a second (vibration.hpp)
// Binary messages to the page are moments and histories (view/stage/moment.hpp).
//
// Messages from the page are JSON: {"ask": LINE, "id": N} holds a line for the session's control socket. If a record is
// shown, the page also sends the requests in play_view.hpp.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "controller/extras/view/program/control_line.hpp"
#include "controller/extras/view/web/web_server.hpp"

namespace proxarm::command_line {

class PageChannel final : public view::Channel {
 public:
  // Sends the first messages to a page that has opened.
  using Welcome = std::function<void(view::Socket& socket)>;
  // Handles a message that isn't for the control socket. Returns false if the page doesn't send such messages.
  using Wanted = std::function<bool(view::Socket& socket, const nlohmann::json& said)>;

  PageChannel(ControlLine& control, Welcome welcome, Wanted wanted = {});

  void opened(const view::SocketPtr& socket) override;
  void received(const view::SocketPtr& socket, std::string_view message, bool binary) override;
  void closed(const view::SocketPtr& socket) override;
  [[nodiscard]] std::string choose(const std::vector<std::string>& offered) const override;

  [[nodiscard]] bool empty() const noexcept { return sockets_.empty(); }
  void show(const view::Bytes& moment);
  void say(const view::Bytes& text);

 private:
  ControlLine& control_;
  Welcome welcome_;
  Wanted wanted_;
  std::vector<view::SocketPtr> sockets_;
};

// Returns JSON as the bytes of a text message.
view::Bytes text_of(const nlohmann::json& value);

}  // namespace proxarm::command_line
