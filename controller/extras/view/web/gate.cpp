#include "controller/extras/view/web/gate.hpp"

#include <algorithm>

#include "controller/extras/view/web/secret.hpp"

namespace proxarm::view {
namespace {

constexpr std::size_t longest_target = 512;

Verdict refusal(unsigned status, const char* reason) { return {Answer::refuse, status, reason, ""}; }

// Returns the value of `name` in a query such as "a=1&token=2"; empty if the query has no such name.
std::string_view query_value(std::string_view query, std::string_view name) {
  while (!query.empty()) {
    const std::string_view part = query.substr(0, query.find('&'));
    if (part.size() > name.size() && part.substr(0, name.size()) == name && part[name.size()] == '=') {
      return part.substr(name.size() + 1);
    }
    query.remove_prefix(std::min(part.size() + 1, query.size()));
  }
  return {};
}

// Returns the value of `name` in a Cookie header such as "a=1; b=2"; empty if the header has no such name.
std::string_view cookie_value(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    std::string_view part = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(part.size() + 1, header.size()));
    while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
    if (part.size() > name.size() && part.substr(0, name.size()) == name && part[name.size()] == '=') {
      return part.substr(name.size() + 1);
    }
  }
  return {};
}

}  // namespace

Gate::Gate(std::uint16_t port, std::vector<std::string> allowed_origins)
    : host_("127.0.0.1:" + std::to_string(port)),
      origin_("http://" + host_),
      token_(random_secret()),
      // Cookies ignore the port, so the port is part of the cookie's name.
      cookie_name_("proxarm_" + std::to_string(port)),
      cookie_(random_secret()),
      allowed_(std::move(allowed_origins)) {}

std::string Gate::url() const { return origin_ + "/?token=" + token_; }

std::string Gate::set_cookie() const { return cookie_name_ + "=" + cookie_ + "; Path=/; HttpOnly; SameSite=Strict"; }

bool Gate::is_known(const RequestHead& head) const {
  return head.cookies.size() == 1 && same_secret(cookie_value(head.cookies[0], cookie_name_), cookie_);
}

Verdict Gate::judge(const RequestHead& head) const {
  if (head.target.size() > longest_target || head.target.empty() || head.target[0] != '/') {
    return refusal(400, "this isn't the address of a page here");
  }
  if (head.hosts.size() != 1 || head.hosts[0] != host_) return refusal(403, "the request names another host");
  if (head.method != "GET" && head.method != "HEAD") return refusal(405, "only GET and HEAD are answered");
  if (head.has_body) return refusal(400, "a request with a body isn't answered");
  if (head.origins.size() > 1) return refusal(400, "a request with two origins isn't answered");
  const std::size_t question = head.target.find('?');
  const std::string path = head.target.substr(0, question);
  const std::string_view query =
      question == std::string::npos ? std::string_view() : std::string_view(head.target).substr(question + 1);
  const std::string_view token = query_value(query, "token");
  const bool with_token = same_secret(token, token_);
  if (head.upgrade) return judge_socket(head, path, with_token);

  if (!head.origins.empty() && head.origins[0] != origin_) return refusal(403, "the request is of another origin");
  if (!head.fetch_site.empty() && head.fetch_site != "same-origin" && head.fetch_site != "none") {
    // A request from another page may only open the whole URL with the secret, as a link in a terminal does.
    if (!(path == "/" && with_token)) return refusal(403, "the request comes from another page");
  }
  if (path == "/" && !token.empty()) {
    if (!with_token) return refusal(403, "the token is wrong: it is another one in each session");
    return {Answer::set_cookie, 303, "", "/"};
  }
  if (!is_known(head)) return refusal(403, "open the address that proxarm printed, with its token");
  return {Answer::serve, 200, "", path == "/" ? "/index.html" : path};
}

// Judges a request for a WebSocket. Browsers always send the origin of a WebSocket. Other programs may send no origin,
// but must know the secret.
Verdict Gate::judge_socket(const RequestHead& head, const std::string& path, bool with_token) const {
  if (head.method != "GET") return refusal(405, "only GET is answered");
  const bool own = head.origins.size() == 1 && head.origins[0] == origin_;
  if (path == "/live") {
    if (!own) return refusal(403, "the request is of another origin");
    if (!is_known(head)) return refusal(403, "open the address that proxarm printed, with its token");
    return {Answer::open_page, 101, "", path};
  }
  if (path != "/") return refusal(404, "there is nothing at this address");
  const bool allowed =
      head.origins.empty() || own || std::find(allowed_.begin(), allowed_.end(), head.origins[0]) != allowed_.end();
  if (!allowed) return refusal(403, "the request is of another origin; proxarm's --allow-origin allows one");
  if (!with_token) return refusal(403, "the token is wrong or missing: it stands in the address that proxarm printed");
  return {Answer::open_tool, 101, "", path};
}

bool is_origin(std::string_view text) noexcept {
  const std::size_t scheme = text.find("://");
  if (scheme == 0 || scheme == std::string_view::npos) return false;
  const std::string_view rest = text.substr(scheme + 3);
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == ':' || c == '[' || c == ']';
  };
  return !rest.empty() && std::all_of(rest.begin(), rest.end(), fits) &&
         std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(scheme),
                     [](char c) { return (c >= 'a' && c <= 'z') || c == '-' || c == '+'; });
}

}  // namespace proxarm::view
