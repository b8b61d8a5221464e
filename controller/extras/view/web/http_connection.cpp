#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <utility>

#include "controller/extras/view/web/server_state.hpp"

namespace proxarm::view {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

std::vector<std::string> all_of(const Request& request, http::field name) {
  std::vector<std::string> values;
  const auto [first, last] = request.equal_range(name);
  for (auto field = first; field != last; ++field) values.emplace_back(field->value());
  return values;
}

RequestHead head_of(const http::request_parser<http::empty_body>& parser) {
  const Request& request = parser.get();
  RequestHead head;
  head.method = std::string(request.method_string());
  head.target = std::string(request.target());
  head.hosts = all_of(request, http::field::host);
  head.origins = all_of(request, http::field::origin);
  head.cookies = all_of(request, http::field::cookie);
  head.fetch_site = std::string(request["Sec-Fetch-Site"]);
  head.upgrade = beast::websocket::is_upgrade(request);
  head.has_body = parser.chunked() || parser.content_length_remaining().value_or(0) > 0;
  return head;
}

// Sets the headers of each answer. No other page may embed our page, and our page embeds nothing from elsewhere.
template <typename Body>
void protect(http::response<Body>& response) {
  response.set(http::field::server, "proxarm");
  response.set("Content-Security-Policy",
               "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  response.set("X-Frame-Options", "DENY");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set(http::field::cache_control, "no-store");
}

class HttpConnection final : public Connection, public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(SharedPtr shared, boost::asio::ip::tcp::socket socket)
      : shared_(std::move(shared)), stream_(std::move(socket)) {}

  void close() override {
    error_code ignored;
    stream_.socket().close(ignored);
  }

  void read(std::chrono::seconds within) {
    parser_.emplace();
    parser_->header_limit(longest_head);
    stream_.expires_after(within);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](const error_code& error, std::size_t) {
                              if (error == http::error::header_limit)
                                return self->refuse(431, "the request is too long");
                              if (!error) return self->answer();
                              self->close();
                            });
  }

 private:
  using Text = http::response<http::string_body>;

  void answer() {
    const RequestHead head = head_of(*parser_);
    const Verdict verdict = shared_->gate.judge(head);
    const bool stranger = verdict.answer == Answer::refuse;
    Budget& budget = stranger ? shared_->requests_of_strangers : shared_->requests;
    if (!budget.spend()) return refuse(429, "too many requests");
    known = known || !stranger;
    switch (verdict.answer) {
      case Answer::refuse:
        return refuse(verdict.status, verdict.reason);
      case Answer::set_cookie:
        return welcome(head.fetch_site == "cross-site");
      case Answer::open_page:
        return open(*shared_->page);
      case Answer::open_tool:
        if (shared_->tools == nullptr) return refuse(404, "there is nothing at this address");
        return open(*shared_->tools);
      case Answer::serve:
        return serve(verdict.path);
    }
  }

  void open(Channel& channel) {
    if (shared_->sockets >= most_viewers) return refuse(503, "as many as can be shown it look already");
    stream_.expires_never();
    serve_socket(shared_, std::move(stream_), parser_->release(), channel);
  }

  // Answers a request with the secret. If another page leads here, such as the page that opens the browser, the browser
  // wouldn't send the new cookie with a redirect. So such a request gets the page itself.
  void welcome(bool from_elsewhere) {
    if (from_elsewhere) return serve("/index.html", true);
    Text response{http::status::see_other, parser_->get().version()};
    response.set(http::field::location, "/");
    response.set(http::field::set_cookie, shared_->gate.set_cookie());
    send(std::move(response), true);
  }

  void refuse(unsigned status, const char* reason) {
    Text response{static_cast<http::status>(status), 11};
    response.set(http::field::content_type, "text/plain; charset=utf-8");
    response.body() = std::string("proxarm: ") + reason + "\n";
    send(std::move(response), false);
  }

  void serve(const std::string& path, bool with_cookie = false) {
    AssetPtr asset;
    if (const auto found = shared_->assets.find(path); found != shared_->assets.end()) {
      asset = found->second;
    } else if (shared_->finder) {
      asset = shared_->finder(path);
    }
    if (!asset) return refuse(404, "there is nothing at this address");
    Text response{http::status::ok, parser_->get().version()};
    response.set(http::field::content_type, asset->type);
    if (with_cookie) response.set(http::field::set_cookie, shared_->gate.set_cookie());
    const bool packs = parser_->get()[http::field::accept_encoding].find("gzip") != beast::string_view::npos;
    if (packs && !asset->gzip.empty()) response.set(http::field::content_encoding, "gzip");
    response.body() = packs && !asset->gzip.empty() ? asset->gzip : asset->body;
    send(std::move(response), parser_->get().keep_alive());
  }

  void send(Text response, bool keep) {
    protect(response);
    response.keep_alive(keep);
    response.prepare_payload();
    const auto whole = std::make_shared<Text>(std::move(response));
    if (parser_->get().method() == http::verb::head) whole->body().clear();  // the header Content-Length stays
    stream_.expires_after(patience);
    http::async_write(stream_, *whole, [self = shared_from_this(), whole, keep](const error_code& error, std::size_t) {
      if (error || !keep) return self->end();
      self->read(idle_time);
    });
  }

  void end() {
    error_code ignored;
    stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    close();
  }

  SharedPtr shared_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{longest_head + 4096};
  std::optional<http::request_parser<http::empty_body>> parser_;
};

}  // namespace

bool ServerShared::make_room() {
  std::erase_if(connections, [](const auto& one) { return one.expired(); });
  if (connections.size() < most_connections) return true;
  for (auto one = connections.begin(); one != connections.end(); ++one) {
    const std::shared_ptr<Connection> connection = one->lock();
    if (!connection || connection->known) continue;
    connection->close();
    connections.erase(one);
    return true;
  }
  return false;
}

void serve_http(SharedPtr shared, boost::asio::ip::tcp::socket socket) {
  const auto connection = std::make_shared<HttpConnection>(shared, std::move(socket));
  shared->connections.push_back(connection);
  connection->read(patience);
}

}  // namespace proxarm::view
