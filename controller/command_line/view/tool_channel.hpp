// Speaks the WebSocket protocol of Foxglove and Lichtblick, under both of its names: foxglove.websocket.v1 and, since
// it was renamed, foxglove.sdk.v1.
//
// Text is JSON with "op": serverInfo and advertise when a client has come, subscribe, unsubscribe, getParameters,
// setParameters and (un)subscribeParameterUpdates from it. Binary is a message: 01h, the subscription's number (u32),
// the time (u64, ns), and the message's text. Parameters are mass, damping and spring; setting one is asking the
// session's control socket for it.
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
  // All must outlive it.
  ToolChannel(const view::Stage& stage, const view::PresentSettings& settings, ControlLine& control);

  void opened(const view::SocketPtr& socket) override;
  void received(const view::SocketPtr& socket, std::string_view message, bool binary) override;
  void closed(const view::SocketPtr& socket) override;
  [[nodiscard]] std::string choose(const std::vector<std::string>& offered) const override;

  // To all that have subscribed and have taken what they were sent before.
  void show(const view::Moment& moment);

 private:
  struct Client {
    view::SocketPtr socket;
    std::map<std::uint32_t, view::Topic> subscriptions;
    std::set<std::string> watched;    // parameters whose changes it is told
    std::vector<models::Pose> drawn;  // where objects were when it was sent the scene
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
  std::string session_id_;  // another for each session, by which tools know that one has begun anew
  std::vector<Client> clients_;
  std::array<double, 3> told_{};  // of the parameters, to those who watch them
  std::int64_t clock_ns_ = 0;     // of the machine, at the session's first cycle
  std::vector<models::Pose> links_, objects_;
};

}  // namespace proxarm::command_line
