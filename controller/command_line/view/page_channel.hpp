// The messages between the page and the process over the page's WebSocket.
//
// To the page, as text: JSON with one key. "stage" (view/stage/stage.hpp, with "mode" and "control"), "settings" after
// a change (view/stage/present_settings.hpp), "status", "answer", and in a running session "spectrum" four times a
// second (vibration.hpp). To the page, binary: moments and histories (view/stage/moment.hpp). From the page: JSON
// {"ask": LINE, "id": N}, a line for the session's control socket, answered by {"answer": {"id": N, "text": …}}; with a
// record, also the requests in play_view.hpp.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "controller/command_line/view/control_line.hpp"
#include "controller/view/web/web_server.hpp"

namespace proxarm::command_line {

class PageChannel final : public view::Channel {
 public:
  // `welcome` sends the first messages to a page that opens.
  using Welcome = std::function<void(view::Socket& socket)>;
  // Takes messages that aren't for the control socket. False: not a message of the page.
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

// Encodes a message of JSON.
view::Bytes text_of(const nlohmann::json& value);

}  // namespace proxarm::command_line
