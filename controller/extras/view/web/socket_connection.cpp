#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <sstream>
#include <utility>

#include "controller/extras/view/web/server_state.hpp"

namespace proxarm::view {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr std::size_t most_waiting = 256;      // largest number of messages that wait for a reader
constexpr int send_buffer_bytes = 256 * 1024;  // size of the kernel's buffer: how far a reader may lag unnoticed

std::vector<std::string> offered_protocols(const Request& request) {
  std::vector<std::string> offered;
  std::istringstream words{std::string(request[http::field::sec_websocket_protocol])};
  for (std::string word; std::getline(words, word, ',');) {
    const std::size_t from = word.find_first_not_of(' ');
    if (from == std::string::npos) continue;
    offered.push_back(word.substr(from, word.find_last_not_of(' ') - from + 1));
  }
  return offered;
}

class SocketConnection final : public Connection, public Socket, public std::enable_shared_from_this<SocketConnection> {
 public:
  SocketConnection(SharedPtr shared, beast::tcp_stream stream, Channel& channel)
      : shared_(std::move(shared)), channel_(channel), stream_(std::move(stream)), timer_(shared_->context) {
    known = true;
    ++shared_->sockets;
  }
  ~SocketConnection() override { --shared_->sockets; }

  void accept(const Request& request) {
    const std::vector<std::string> offered = offered_protocols(request);
    protocol_ = channel_.choose(offered);
    error_code ignored;
    stream_.next_layer().socket().set_option(boost::asio::socket_base::send_buffer_size(send_buffer_bytes), ignored);
    stream_.next_layer().socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
    stream_.read_message_max(longest_message);
    stream_.auto_fragment(false);
    stream_.set_option(websocket::stream_base::timeout{patience, std::chrono::seconds(30), true});
    stream_.set_option(websocket::stream_base::decorator([protocol = protocol_](websocket::response_type& response) {
      response.set(http::field::server, "proxarm");
      if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
    }));
    stream_.async_accept(request, [self = shared_from_this()](const error_code& error) {
      if (error) return;
      self->open_ = true;
      self->channel_.opened(self);
      self->read();
    });
  }

  void show(Bytes moment) override {
    if (!open_) return;
    moment_ = std::move(moment);
    write();
  }
  void say(Bytes message, bool binary) override {
    if (!open_) return;
    if (waiting_.size() >= most_waiting) return drop();
    waiting_.emplace_back(std::move(message), binary);
    write();
  }
  void drop() override { close(); }
  [[nodiscard]] bool idle() const noexcept override { return !writing_ && waiting_.empty() && !moment_; }
  void close() override {
    error_code ignored;
    timer_.cancel();
    stream_.next_layer().socket().close(ignored);
    if (!std::exchange(open_, false)) return;
    // The call is posted, so that it doesn't run within the channel's own calls.
    boost::asio::post(shared_->context, [self = shared_from_this()] { self->channel_.closed(self); });
  }
  [[nodiscard]] const std::string& protocol() const noexcept override { return protocol_; }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (error || !self->open_ || !self->messages_.spend()) return self->close();
      const std::string message = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->channel_.received(self, message, self->stream_.got_binary());
      if (self->open_) self->read();
    });
  }

  // Sends what waits: messages of say() before moments of show().
  void write() {
    if (writing_ || !open_ || (waiting_.empty() && !moment_)) return;
    Bytes message;
    bool binary = true;
    if (!waiting_.empty()) {
      std::tie(message, binary) = std::move(waiting_.front());
      waiting_.pop_front();
    } else {
      message = std::exchange(moment_, nullptr);
    }
    writing_ = true;
    timer_.expires_after(patience);
    timer_.async_wait([self = shared_from_this()](const error_code& error) {
      if (!error) self->close();
    });
    stream_.binary(binary);
    stream_.async_write(boost::asio::buffer(*message),
                        [self = shared_from_this(), message](const error_code& error, std::size_t) {
                          self->writing_ = false;
                          self->timer_.cancel();
                          if (error) return self->close();
                          self->write();
                        });
  }

  SharedPtr shared_;
  Channel& channel_;
  websocket::stream<beast::tcp_stream> stream_;
  boost::asio::steady_timer timer_;  // timeout of the present write
  beast::flat_buffer buffer_;
  std::string protocol_;
  std::deque<std::pair<Bytes, bool>> waiting_;
  Bytes moment_;
  Budget messages_{200.0, 400.0};
  bool open_ = false, writing_ = false;
};

}  // namespace

void serve_socket(SharedPtr shared, beast::tcp_stream stream, Request request, Channel& channel) {
  const auto connection = std::make_shared<SocketConnection>(shared, std::move(stream), channel);
  shared->connections.push_back(connection);
  connection->accept(request);
}

}  // namespace proxarm::view
