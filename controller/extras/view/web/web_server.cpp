#include "controller/extras/view/web/web_server.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <utility>

#include "controller/extras/view/web/server_state.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::view {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

tcp::acceptor listen(boost::asio::io_context& context, std::uint16_t port) {
  tcp::acceptor acceptor(context);
  const tcp::endpoint endpoint(boost::asio::ip::address_v4::loopback(), port);
  error_code error;
  acceptor.open(endpoint.protocol(), error);
  acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(boost::asio::socket_base::max_listen_connections, error);
  if (!error) return acceptor;
  throw description::SetupError({.key = "--view-port",
                                 .found = std::to_string(port) + ", where nothing can listen: " + error.message(),
                                 .expected = "a port that is free",
                                 .advice = "leave --view-port away: then any free one is taken"});
}

}  // namespace

struct WebServer::State : std::enable_shared_from_this<WebServer::State> {
  State(boost::asio::io_context& context, const ServerConfig& config)
      : acceptor(listen(context, config.port)),
        retry(context),
        shared(std::make_shared<ServerShared>(context, acceptor.local_endpoint().port(), config)) {}

  tcp::acceptor acceptor;
  boost::asio::steady_timer retry;
  SharedPtr shared;

  void accept() {
    acceptor.async_accept([self = shared_from_this()](const error_code& error, tcp::socket socket) {
      if (error == boost::asio::error::operation_aborted) return;
      if (error) return self->accept_later();
      if (self->shared->make_room()) serve_http(self->shared, std::move(socket));
      self->accept();
    });
  }
  // Called after a failed accept, which usually lacks file descriptors.
  void accept_later() {
    retry.expires_after(std::chrono::milliseconds(50));
    retry.async_wait([self = shared_from_this()](const error_code& error) {
      if (!error) self->accept();
    });
  }
};

WebServer::WebServer(boost::asio::io_context& context, const ServerConfig& config, Assets assets, Finder finder,
                     Channel& page, Channel* tools)
    : state_(std::make_shared<State>(context, config)) {
  state_->shared->assets = std::move(assets);
  state_->shared->finder = std::move(finder);
  state_->shared->page = &page;
  state_->shared->tools = tools;
  state_->accept();
}

WebServer::~WebServer() {
  try {
    stop();
  } catch (...) {  // out of memory while closing connections; the connections' sockets close with them
  }
}

std::string WebServer::url() const { return state_->shared->gate.url(); }

std::uint16_t WebServer::port() const { return state_->acceptor.local_endpoint().port(); }

void WebServer::stop() {
  error_code ignored;
  state_->acceptor.close(ignored);
  state_->retry.cancel();
  for (const auto& one : state_->shared->connections) {
    if (const auto connection = one.lock()) connection->close();
  }
}

}  // namespace proxarm::view
