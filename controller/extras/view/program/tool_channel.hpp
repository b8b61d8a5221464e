// Speaks the WebSocket protocol of the tools Foxglove and Lichtblick. The protocol's old name, foxglove.websocket.v1,
// and its new one, foxglove.sdk.v1, are both accepted.
//
// Text messages are JSON with the key "op". A new client gets serverInfo and advertise. A client may send subscribe,
// unsubscribe, getParameters, setParameters, subscribeParameterUpdates and unsubscribeParameterUpdates. A binary
// message consists of the byte 01h, the subscription's number (u32), the time (u64, ns), and a text. The parameters are
// mass, damping and spring. A value that a client sets goes to the session's control socket.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "controller/extras/view/program/control_line.hpp"
#include "controller/extras/view/web/web_server.hpp"
#include "controller/messages/session_messages.hpp"
#include "controller/stage/present_settings.hpp"

namespace proxarm::command_line {

class ToolChannel final : public view::Channel {
 public:
  // Precondition: all arguments outlive this object.
  ToolChannel(const view::Stage& stage, const view::PresentSettings& settings, ControlLine& control);

  void opened(const view::SocketPtr& socket) override;
  void received(const view::SocketPtr& socket, std::string_view message, bool binary) override;
  void closed(const view::SocketPtr& socket) override;
  [[nodiscard]] std::string choose(const std::vector<std::string>& offered) const override;

  // Sends the moment's topics to the clients that have subscribed to them. A client that hasn't yet taken its previous
  // messages is left out.
  void show(const view::Moment& moment);

 private:
  struct Client {
    view::SocketPtr socket;
    std::map<std::uint32_t, view::Topic> subscriptions;
    std::set<std::string> watched;    // names of the parameters whose changes the client gets
    std::vector<models::Pose> drawn;  // the objects' poses in the scene that was last sent to the client
    bool has_scene = false;
  };
  bool obey(Client& client, const nlohmann::json& said);
  void subscribe(Client& client, const nlohmann::json& subscriptions);
  void send_parameters(Client& client, const std::set<std::string>& names, const std::string& id);
  static void send_values(Client& client, const std::map<std::string, double>& values, const std::string& id);
  void set_parameters(Client& client, const nlohmann::json& parameters, const std::string& id);
  void set_parameter(const view::SocketPtr& socket, const std::string& name, double value, const std::string& id);
  void tell_changes();
  [[nodiscard]] double value_of(const std::string& name) const;

  const view::Stage& stage_;
  const view::PresentSettings& settings_;
  ControlLine& control_;
  view::SessionMessages messages_;
  std::string session_id_;  // differs for each session, so that tools recognize a new session
  std::vector<Client> clients_;
  std::array<double, 3> told_{};  // parameter values that were last sent to watching clients
  std::int64_t clock_ns_ = 0;     // the machine's time minus the session's
  std::vector<models::Pose> links_, objects_;
};

}  // namespace proxarm::command_line
