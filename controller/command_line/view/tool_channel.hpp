// Speaks the WebSocket protocol of Foxglove and Lichtblick under both of its names: foxglove.websocket.v1 and, since
// its renaming, foxglove.sdk.v1.
//
// Text messages are JSON with "op": to a new client serverInfo and advertise; from the client subscribe, unsubscribe,
// getParameters, setParameters and (un)subscribeParameterUpdates. Binary messages are 01h, the subscription's number
// (u32), the time (u64, ns), and the text. The parameters are mass, damping and spring; setting one sends it to the
// session's control socket.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "controller/command_line/view/control_line.hpp"
#include "controller/view/messages/session_messages.hpp"
#include "controller/view/stage/present_settings.hpp"
#include "controller/view/web/web_server.hpp"

namespace proxarm::command_line {

class ToolChannel final : public view::Channel {
 public:
  // Precondition: all arguments outlive this object.
  ToolChannel(const view::Stage& stage, const view::PresentSettings& settings, ControlLine& control);

  void opened(const view::SocketPtr& socket) override;
  void received(const view::SocketPtr& socket, std::string_view message, bool binary) override;
  void closed(const view::SocketPtr& socket) override;
  [[nodiscard]] std::string choose(const std::vector<std::string>& offered) const override;

  // Sends to all clients that have subscribed and have taken the previous messages.
  void show(const view::Moment& moment);

 private:
  struct Client {
    view::SocketPtr socket;
    std::map<std::uint32_t, view::Topic> subscriptions;
    std::set<std::string> watched;    // parameters whose changes the client gets
    std::vector<models::Pose> drawn;  // the objects' poses in the last scene sent
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
  std::string session_id_;  // differs for each session, so that tools recognize a new one
  std::vector<Client> clients_;
  std::array<double, 3> told_{};  // parameter values last sent to watching clients
  std::int64_t clock_ns_ = 0;     // the machine's time minus the session's
  std::vector<models::Pose> links_, objects_;
};

}  // namespace proxarm::command_line
