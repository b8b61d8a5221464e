#include "controller/extras/view/web/gate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controller/extras/view/web/budget.hpp"
#include "controller/extras/view/web/secret.hpp"

namespace proxarm::view {
namespace {

constexpr std::uint16_t port = 40123;

struct Judged : testing::Test {
  Gate gate{port, {"https://tool.example.org"}};
  std::string cookie = gate.set_cookie().substr(0, gate.set_cookie().find(';'));
  std::string with_token = "/?token=" + gate.token();

  // The page's own request for one of its files.
  [[nodiscard]] RequestHead file(const std::string& path = "/main.js") const {
    return {.method = "GET", .target = path, .hosts = {"127.0.0.1:40123"}, .cookies = {cookie}};
  }
  // Its WebSocket.
  [[nodiscard]] RequestHead live() const {
    RequestHead head = file("/live");
    head.origins = {"http://127.0.0.1:40123"};
    head.upgrade = true;
    return head;
  }
  // Another tool's.
  [[nodiscard]] RequestHead tool() const {
    return {.method = "GET", .target = with_token, .hosts = {"127.0.0.1:40123"}, .upgrade = true};
  }
  [[nodiscard]] Answer answer(const RequestHead& head) const { return gate.judge(head).answer; }
};

TEST_F(Judged, TheUrlLeadsInAndTheCookieStays) {
  EXPECT_EQ(gate.url(), "http://127.0.0.1:40123" + with_token);
  const RequestHead first{.method = "GET", .target = with_token, .hosts = {"127.0.0.1:40123"}, .fetch_site = "none"};
  EXPECT_EQ(answer(first), Answer::set_cookie);
  EXPECT_EQ(answer(file()), Answer::serve);
  EXPECT_EQ(gate.judge(file("/")).path, "/index.html");
  EXPECT_EQ(answer(live()), Answer::open_page);
  EXPECT_THAT(gate.set_cookie(), testing::AllOf(testing::HasSubstr("HttpOnly"), testing::HasSubstr("SameSite=Strict"),
                                                testing::Not(testing::HasSubstr(gate.token()))));
}

TEST_F(Judged, SecretsAreOfEachSession) {
  const Gate other(port, {});
  EXPECT_NE(other.token(), gate.token());
  EXPECT_NE(other.set_cookie(), gate.set_cookie());
  EXPECT_EQ(gate.token().size(), 64U);
}

TEST_F(Judged, AForeignHostIsRefused) {
  for (const std::vector<std::string>& hosts : {std::vector<std::string>{"evil.example:40123"},
                                                {"127.0.0.1"},
                                                {"127.0.0.1:40124"},
                                                {"localhost:40123"},
                                                {},
                                                {"127.0.0.1:40123", "127.0.0.1:40123"},
                                                {"127.0.0.1:40123."},
                                                {"127.0.0.1:40123 "}}) {
    for (RequestHead head : {file(), file(with_token), live(), tool()}) {
      head.hosts = hosts;
      EXPECT_EQ(answer(head), Answer::refuse);
    }
  }
}

TEST_F(Judged, AForeignOriginIsRefused) {
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:40123", "http://127.0.0.1",
                             "http://localhost:40123", "http://127.0.0.1:40123/", ""}) {
    for (RequestHead head : {file(), file(with_token), live()}) {
      head.origins = {origin};
      EXPECT_EQ(answer(head), Answer::refuse) << origin;
    }
  }
  RequestHead head = live();
  head.origins.clear();
  EXPECT_EQ(answer(head), Answer::refuse);  // a browser always says it
  head.origins = {"http://127.0.0.1:40123", "http://127.0.0.1:40123"};
  EXPECT_EQ(answer(head), Answer::refuse);
}

TEST_F(Judged, AnAllowedOriginMayHaveAToolsSocketAndNothingElse) {
  RequestHead head = tool();
  EXPECT_EQ(answer(head), Answer::open_tool);  // no browser
  head.origins = {"https://tool.example.org"};
  EXPECT_EQ(answer(head), Answer::open_tool);
  head.origins = {"https://tool.example.com"};
  EXPECT_EQ(answer(head), Answer::refuse);
  head.origins = {"https://tool.example.org"};
  head.target = "/";
  head.cookies = {cookie};  // a cookie isn't enough: it would come by itself
  EXPECT_EQ(answer(head), Answer::refuse);
  for (RequestHead page : {file(), live()}) {
    page.origins = {"https://tool.example.org"};
    EXPECT_EQ(answer(page), Answer::refuse);
  }
}

TEST_F(Judged, AWrongOrMissingSecretIsRefused) {
  std::string nearly = gate.token();
  nearly.back() = nearly.back() == '0' ? '1' : '0';
  for (const std::string& target : {std::string("/"), std::string("/?token="), "/?token=" + nearly,
                                    "/?token=" + gate.token().substr(1), "/?token=" + gate.token() + "0",
                                    "/?toke=" + gate.token(), "/main.js?token=" + gate.token(), std::string("/live")}) {
    RequestHead head = file(target);
    head.cookies.clear();
    EXPECT_EQ(answer(head), Answer::refuse) << target;
    head.upgrade = true;
    EXPECT_EQ(answer(head), Answer::refuse) << target;
  }
  for (const std::string& wrong : {std::string("proxarm_40123="), "proxarm_40123=" + gate.token(), "proxarm_1" + cookie,
                                   cookie + "0", cookie.substr(0, cookie.size() - 1)}) {
    for (RequestHead head : {file(), live()}) {
      head.cookies = {wrong};
      EXPECT_EQ(answer(head), Answer::refuse) << wrong;
    }
  }
}

TEST_F(Judged, OtherCookiesDontHinder) {
  RequestHead head = file();
  head.cookies = {"a=1; " + cookie + "; b=2"};
  EXPECT_EQ(answer(head), Answer::serve);
}

TEST_F(Judged, WhatOtherPagesSendAcrossIsRefused) {
  for (const char* site : {"cross-site", "same-site"}) {
    RequestHead head = file();
    head.fetch_site = site;
    EXPECT_EQ(answer(head), Answer::refuse) << site;  // an image, a script
  }
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "get"}) {
    for (RequestHead head : {file(), file(with_token), live()}) {
      head.method = method;
      EXPECT_EQ(gate.judge(head).status, 405U) << method;
      EXPECT_EQ(answer(head), Answer::refuse);
    }
  }
  RequestHead form = file();
  form.has_body = true;
  EXPECT_EQ(answer(form), Answer::refuse);
}

TEST_F(Judged, ALinkWithTheSecretIsFollowedFromAnywhere) {
  RequestHead head = file(with_token);
  head.cookies.clear();
  head.fetch_site = "cross-site";
  EXPECT_EQ(answer(head), Answer::set_cookie);
}

TEST_F(Judged, StrangeTargetsAreRefused) {
  for (const std::string& target : {std::string(), std::string("*"), std::string("http://127.0.0.1:40123/"),
                                    "/" + std::string(1000, 'a'), std::string("main.js")}) {
    EXPECT_EQ(gate.judge(file(target)).status, 400U) << target;
  }
}

TEST(Origin, IsWhatBrowsersSend) {
  for (const char* good : {"https://app.example.org", "http://127.0.0.1:8080", "http://[::1]:8080"}) {
    EXPECT_TRUE(is_origin(good)) << good;
  }
  for (const char* bad : {"", "*", "app.example.org", "https://", "https://a/b", "https://a b", "https://A.example"}) {
    EXPECT_FALSE(is_origin(bad)) << bad;
  }
}

TEST(Secret, IsComparedAsAWhole) {
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("abc", "abcd"));
  EXPECT_FALSE(same_secret("", "a"));
}

TEST(Budget, LetsAsManyThroughAsItSays) {
  const auto begun = Budget::Clock::now();
  Budget budget(10.0, 5.0);
  int spent = 0;
  for (int ms = 0; ms < 2000; ++ms) spent += budget.spend(begun + std::chrono::milliseconds(ms)) ? 1 : 0;
  EXPECT_NEAR(spent, 25, 1);
}

}  // namespace
}  // namespace proxarm::view
