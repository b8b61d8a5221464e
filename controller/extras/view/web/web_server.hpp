// HTTP and WebSocket server on 127.0.0.1 for one page and other tools, in one thread.
//
// No client can slow down the others. Limits: a request's head has at most 8 KiB and arrives within 5 s; no bodies; 64
// connections, of which the oldest without the secret makes room for a new one; 16 WebSockets; messages of at most 1
// KiB, at most 200 a second. Only the newest moment waits for a slow reader. A reader that accepts no byte for 5 s is
// disconnected.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "controller/extras/view/web/asset.hpp"

namespace proxarm::view {

using Bytes = std::shared_ptr<const std::string>;

// The most WebSockets at a time.
inline constexpr std::size_t most_viewers = 16;

// An open WebSocket, as channels use it.
class Socket {
 public:
  Socket() = default;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  virtual ~Socket() = default;

  // Sends a moment (binary). If an earlier moment still waits, the new one replaces it, since only the newest moment
  // counts.
  virtual void show(Bytes moment) = 0;
  // Sends a message. All messages are sent, in order. A reader for which too many messages wait is dropped.
  virtual void say(Bytes message, bool binary) = 0;
  virtual void drop() = 0;
  // Whether all messages and moments have been sent.
  [[nodiscard]] virtual bool idle() const noexcept = 0;
  // The subprotocol that was agreed on; empty for the page.
  [[nodiscard]] virtual const std::string& protocol() const noexcept = 0;
};
using SocketPtr = std::shared_ptr<Socket>;

// A party that talks through WebSockets of one kind. All functions are called from the server's thread.
class Channel {
 public:
  Channel() = default;
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;
  virtual ~Channel() = default;

  virtual void opened(const SocketPtr& socket) = 0;
  virtual void received(const SocketPtr& socket, std::string_view message, bool binary) = 0;
  virtual void closed(const SocketPtr& socket) = 0;
  // Chooses one of the subprotocols that a client offers; empty: none of them.
  [[nodiscard]] virtual std::string choose(const std::vector<std::string>& offered) const = 0;
};

struct ServerConfig {
  std::uint16_t port = 0;  // 0: any free port
  std::vector<std::string> allowed_origins;
};

class WebServer {
 public:
  // Returns the file for a path that isn't among the assets; null: there is no such file.
  using Finder = std::function<AssetPtr(const std::string& path)>;

  // Listens at once. Precondition: `page` and `tools` outlive this object; `tools` may be null. Throws SetupError if
  // the port isn't available.
  WebServer(boost::asio::io_context& context, const ServerConfig& config, Assets assets, Finder finder, Channel& page,
            Channel* tools);
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;
  ~WebServer();

  // Returns the URL with the token.
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::uint16_t port() const;
  // Closes all connections, and accepts no new connections.
  void stop();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace proxarm::view
