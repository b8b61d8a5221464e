// HTTP and WebSocket on 127.0.0.1 for one page and the tools beside it, in one thread.
//
// Nothing that somebody sends or doesn't send can make it slow for others: heads of at most 8 KiB within 5 s, no
// bodies, 64 connections of which the oldest that shows nothing makes room, 16 WebSockets, messages of at most 1 KiB
// and 200 a second, and who reads too slowly is left out: of moments only the newest waits for each of them, and
// after 5 s without a byte taken the connection is closed.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/view/web/asset.hpp"

namespace proxarm::view {

using Bytes = std::shared_ptr<const std::string>;

// WebSockets at once.
inline constexpr std::size_t most_viewers = 16;

// One open WebSocket, as those who talk through it see it.
class Socket {
 public:
  Socket() = default;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  virtual ~Socket() = default;

  // Binary; replaces one that still waits to be sent: the newest counts.
  virtual void show(Bytes moment) = 0;
  // In order, all of them; a reader who lets too many come together is dropped.
  virtual void say(Bytes message, bool binary) = 0;
  virtual void drop() = 0;
  // All that was said and shown has been taken.
  [[nodiscard]] virtual bool idle() const noexcept = 0;
  // The subprotocol that was agreed on; empty for the page.
  [[nodiscard]] virtual const std::string& protocol() const noexcept = 0;
};
using SocketPtr = std::shared_ptr<Socket>;

// What talks through sockets of one kind. All calls come in the server's thread.
class Channel {
 public:
  Channel() = default;
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  virtual ~Channel() = default;

  virtual void opened(const SocketPtr& socket) = 0;
  virtual void received(const SocketPtr& socket, std::string_view message, bool binary) = 0;
  virtual void closed(const SocketPtr& socket) = 0;
  // Which of the subprotocols that a client offers it speaks; empty: none.
  [[nodiscard]] virtual std::string choose(const std::vector<std::string>& offered) const = 0;
};

struct ServerConfig {
  std::uint16_t port = 0;  // 0: any that is free
  std::vector<std::string> allowed_origins;
};

class WebServer {
 public:
  // The file at a path that isn't among the assets; null: there is none.
  using Finder = std::function<AssetPtr(const std::string& path)>;

  // Listens at once. `page` and `tools` must outlive it; without tools (null) there are none. Throws SetupError for a
  // port that can't be had.
  WebServer(boost::asio::io_context& context, const ServerConfig& config, Assets assets, Finder finder, Channel& page,
            Channel* tools);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  // With the token.
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::uint16_t port() const;
  // Closes all connections; none is accepted any more.
  void stop();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace proxarm::view
