// State shared by the connections of a WebServer. Private to this room.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <list>
#include <memory>
#include <string>

#include "controller/extras/view/web/budget.hpp"
#include "controller/extras/view/web/gate.hpp"
#include "controller/extras/view/web/web_server.hpp"

namespace proxarm::view {

// web_server.hpp gives the reasons for these limits.
inline constexpr std::size_t most_connections = 64;
inline constexpr std::size_t longest_head = 8192, longest_message = 1024;
// Timeout for receiving a request's head, and for a reader that accepts no byte.
inline constexpr auto patience = std::chrono::seconds(5);
inline constexpr auto idle_time = std::chrono::seconds(20);  // timeout between two requests on one connection

class Connection {
 public:
  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  virtual ~Connection() = default;
  virtual void close() = 0;
  // Whether the connection has presented the secret or the cookie.
  bool known = false;
};

struct ServerShared {
  ServerShared(boost::asio::io_context& c, std::uint16_t port, const ServerConfig& config)
      : context(c), gate(port, config.allowed_origins) {}

  boost::asio::io_context& context;
  Gate gate;
  Assets assets;
  WebServer::Finder finder;
  Channel* page = nullptr;
  Channel* tools = nullptr;
  std::list<std::weak_ptr<Connection>> connections;  // the oldest connection first
  std::size_t sockets = 0;
  // Budgets for all connections together. Connections without the secret have a separate budget, so they can't exhaust
  // the budget of the others.
  Budget requests{300.0, 600.0}, requests_of_strangers{300.0, 600.0};

  // Makes room for another connection: if there are too many, closes the oldest connection without the secret. Returns
  // false if all connections have presented the secret.
  bool make_room();
};
using SharedPtr = std::shared_ptr<ServerShared>;

using Request = boost::beast::http::request<boost::beast::http::empty_body>;

// Reads requests and answers them until either side closes the connection.
void serve_http(SharedPtr shared, boost::asio::ip::tcp::socket socket);

// Takes over a connection whose request asked for a WebSocket of `channel`.
void serve_socket(SharedPtr shared, boost::beast::tcp_stream stream, Request request, Channel& channel);

}  // namespace proxarm::view
