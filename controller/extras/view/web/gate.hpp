// Decides from each request's head alone who may see the page and who may connect to it.
//
// Every program and user of this machine, and every web page that is open in its browsers, can reach a port on
// 127.0.0.1. Left: what a web page from elsewhere can do. Right: what stops it here.
//   it gives its own host name the address 127.0.0.1 (DNS rebinding)        Host must be 127.0.0.1 with the port
//   it sends forms, images, scripts or WebSockets here                      Origin and Sec-Fetch-Site must be ours;
//                                                                           only GET and HEAD, no bodies
//   it guesses the URL, as another program may, too                         the URL has a secret of 256 bits; after the
//                                                                           first load, a cookie has another secret
// An allowed origin (--allow-origin) may open a WebSocket with one of the protocols for other tools. It needs the
// secret in the URL. The page, the page's files and the page's WebSocket are only for our own origin.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::view {

// The head of a request. Headers that may occur only once are lists, so that a second occurrence is noticed.
struct RequestHead {
  std::string method{}, target{};
  std::vector<std::string> hosts{}, origins{}, cookies{};
  std::string fetch_site{};  // Sec-Fetch-Site; empty: the browser didn't send this header
  bool upgrade = false;      // whether the request asks for a WebSocket
  bool has_body = false;
};

enum class Answer : std::uint8_t {
  serve,       // serve the file at `path`
  set_cookie,  // set the cookie, and redirect to the page without the secret in its URL
  open_page,   // open a WebSocket of the page
  open_tool,   // open a WebSocket of another tool
  refuse,
};

struct Verdict {
  Answer answer = Answer::refuse;
  unsigned status = 403;    // HTTP status of a refusal
  const char* reason = "";  // text of a refusal
  std::string path;
};

class Gate {
 public:
  // Generates the secrets.
  Gate(std::uint16_t port, std::vector<std::string> allowed_origins);

  [[nodiscard]] Verdict judge(const RequestHead& head) const;
  // Returns http://127.0.0.1:PORT/?token=…
  [[nodiscard]] std::string url() const;
  // Returns the value of the header Set-Cookie.
  [[nodiscard]] std::string set_cookie() const;
  [[nodiscard]] const std::string& token() const noexcept { return token_; }

 private:
  [[nodiscard]] bool is_known(const RequestHead& head) const;
  [[nodiscard]] Verdict judge_socket(const RequestHead& head, const std::string& path, bool with_token) const;

  std::string host_, origin_, token_, cookie_name_, cookie_;
  std::vector<std::string> allowed_;
};

// Returns whether `text` is an origin as browsers send it: scheme://host, and the port unless it is the scheme's
// default.
bool is_origin(std::string_view text) noexcept;

}  // namespace proxarm::view
