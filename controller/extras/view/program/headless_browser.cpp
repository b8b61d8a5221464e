#include "controller/extras/view/program/headless_browser.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <openssl/evp.h>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "controller/command_line/entry/child_process.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::SetupError;
using nlohmann::json;

constexpr int answer_within_ms = 60'000;
constexpr auto patience = std::chrono::seconds(60);

// Finds a Chromium on the PATH by its usual names.
fs::path find_browser() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin");
  std::vector<fs::path> all;
  for (std::string folder; std::getline(folders, folder, ':');) all.emplace_back(folder);
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    for (const fs::path& folder : all) {
      if (access((folder / name).c_str(), X_OK) == 0) return folder / name;
    }
  }
  throw SetupError({.key = "--snapshot",
                    .found = "no chromium on the PATH",
                    .expected = "one, which draws the picture",
                    .advice = "apt-get install chromium"});
}

fs::path make_profile() {
  std::string name = (fs::temp_directory_path() / "proxarm-picture-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    throw SetupError({.file = name, .message = std::string("no folder can be made: ") + std::strerror(errno)});
  }
  return name;
}

std::string decoded(const std::string& base64) {
  std::string bytes(base64.size() / 4 * 3, '\0');
  const int size =
      EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                      reinterpret_cast<const unsigned char*>(base64.data()), static_cast<int>(base64.size()));
  std::size_t padding = 0;
  while (padding < base64.size() && base64[base64.size() - 1 - padding] == '=') ++padding;
  bytes.resize(size > 0 ? static_cast<std::size_t>(size) - padding : 0);
  return bytes;
}

}  // namespace

HeadlessBrowser::HeadlessBrowser(PictureSize size, bool dark) {
  const fs::path program = find_browser();
  profile_ = make_profile();
  start(program);
  attach(size, dark);
}

// With --remote-debugging-pipe the browser reads from descriptor 3 and writes to descriptor 4.
void HeadlessBrowser::start(const fs::path& program) {
  std::vector<std::string> words{program.string(),
                                 "--headless=new",
                                 "--remote-debugging-pipe",
                                 "--hide-scrollbars",
                                 "--no-first-run",
                                 "--disable-background-networking",
                                 "--disable-component-update",
                                 "--disable-sync",
                                 "--disable-quic",
                                 "--disable-dev-shm-usage",
                                 "--use-gl=angle",
                                 "--use-angle=swiftshader-webgl",
                                 "--enable-unsafe-swiftshader",
                                 "--user-data-dir=" + profile_.string(),
                                 "about:blank"};
  if (geteuid() == 0) words.insert(words.begin() + 1, "--no-sandbox");  // the browser's sandbox doesn't work for root
  std::array<int, 2> to{}, from{};
  if (pipe2(to.data(), O_CLOEXEC) != 0 || pipe2(from.data(), O_CLOEXEC) != 0) {
    throw SetupError({.message = std::string("no pipe to the browser: ") + std::strerror(errno)});
  }
  const ChildProcess child = start_child(std::move(words), {to[0], from[1]}, ErrorStream::dropped);
  child_ = child.id;
  for (const int end : {to[0], from[1]}) close(end);
  to_ = to[1];
  from_ = from[0];
  // If the browser ends at once, writing to its pipe raises SIGPIPE, which would end this program. With SIGPIPE ignored
  // the write fails, and the failure is reported as an error.
  (void)std::signal(SIGPIPE, SIG_IGN);
  if (child.error != 0) throw SetupError({.file = program.string(), .message = std::strerror(child.error)});
}

void HeadlessBrowser::attach(PictureSize size, bool dark) {
  const json targets = command("Target.getTargets", json::object());
  std::string page;
  for (const json& target : targets.at("targetInfos")) {
    if (target.at("type") == "page") page = target.at("targetId").get<std::string>();
  }
  if (page.empty()) page = command("Target.createTarget", {{"url", "about:blank"}}).at("targetId").get<std::string>();
  session_ =
      command("Target.attachToTarget", {{"targetId", page}, {"flatten", true}}).at("sessionId").get<std::string>();
  command("Emulation.setDeviceMetricsOverride",
          {{"width", size.width}, {"height", size.height}, {"deviceScaleFactor", 1}, {"mobile", size.width < 600}});
  command("Emulation.setEmulatedMedia",
          {{"features", {{{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}}}}});
}

HeadlessBrowser::~HeadlessBrowser() {
  if (child_ > 0) {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  for (const int end : {to_, from_}) {
    if (end >= 0) close(end);
  }
  std::error_code ignored;
  fs::remove_all(profile_, ignored);
}

// Reads one message. Messages end with a zero byte.
std::string HeadlessBrowser::read_message() {
  while (true) {
    if (const std::size_t end = buffer_.find('\0'); end != std::string::npos) {
      std::string message = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return message;
    }
    pollfd ready{from_, POLLIN, 0};
    const int polled = poll(&ready, 1, answer_within_ms);
    if (polled < 0 && errno == EINTR) continue;
    std::array<char, 65536> more{};
    const ssize_t got = polled > 0 ? read(from_, more.data(), more.size()) : 0;
    if (got <= 0) {
      throw SetupError(
          {.key = "--snapshot", .found = "a browser that doesn't answer", .expected = "a Chromium that runs"});
    }
    buffer_.append(more.data(), static_cast<std::size_t>(got));
  }
}

json HeadlessBrowser::command(const std::string& method, const json& parameters) {
  json asked{{"id", ++last_id_}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) asked["sessionId"] = session_;
  const std::string text = asked.dump() + '\0';
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(to_, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw SetupError({.key = "--snapshot", .found = "a browser that has ended"});
    done += static_cast<std::size_t>(written);
  }
  while (true) {
    const json answer = json::parse(read_message(), nullptr, false);
    if (!answer.is_object() || answer.value("id", 0) != last_id_) continue;  // an event, not the answer
    if (answer.contains("error")) {
      throw SetupError({.message = "the browser refuses " + method + ": " + answer["error"].value("message", "")});
    }
    return answer.value("result", json::object());
  }
}

void HeadlessBrowser::open(const std::string& url) { command("Page.navigate", {{"url", url}}); }

void HeadlessBrowser::run(const std::string& script) { command("Runtime.evaluate", {{"expression", script}}); }

void HeadlessBrowser::wait_for(const std::string& condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < end) {
    const json answer = command("Runtime.evaluate", {{"expression", "Boolean(" + condition + ")"}});
    if (answer.contains("result") && answer["result"].value("value", false)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  throw SetupError(
      {.key = "--snapshot", .found = "a page that doesn't draw", .expected = "one that does: is WebGL there?"});
}

void HeadlessBrowser::save_picture(const fs::path& file) {
  const std::string png = decoded(command("Page.captureScreenshot", {{"format", "png"}}).at("data").get<std::string>());
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << png;
  out.close();
  if (!out || png.empty()) {
    throw SetupError(
        {.file = file.string(), .key = "--out", .found = "a file that can't be written", .expected = "one that can"});
  }
}

}  // namespace proxarm::command_line
