#include "controller/command_line/control_socket.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <istream>
#include <optional>
#include <thread>
#include <utility>  // before Asio 1.74, which forgets it

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>

#include "models/description/setup_error.hpp"
#include "models/description/text.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using boost::asio::local::stream_protocol;
using boost::system::error_code;
using description::SetupError;

constexpr std::size_t longest_line = 256;
constexpr auto patience = std::chrono::seconds(2);  // with somebody who connects and says nothing

[[noreturn]] void refuse(const fs::path& path, const std::string& found, const std::string& expected) {
  throw SetupError({.file = path.string(), .key = "--control", .found = found, .expected = expected});
}

void require_own_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    refuse(folder, std::strerror(errno), "a folder that can be made");
  }
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) refuse(folder, "no folder", "a folder");
  if (status.st_uid != geteuid()) refuse(folder, "a folder of another user", "one of your own");
  if ((status.st_mode & 077) != 0) refuse(folder, "a folder that others may enter", "mode 0700");
}

// Of a session that has died; one that lives answers.
void remove_stale(const fs::path& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return;
  if (!S_ISSOCK(status.st_mode)) refuse(path, "something that is no socket", "a path that is free");
  boost::asio::io_context context;
  stream_protocol::socket socket(context);
  error_code error;
  socket.connect(stream_protocol::endpoint(path.string()), error);
  if (!error) refuse(path, "the socket of another session", "a path that is free");
  unlink(path.c_str());
}

stream_protocol::endpoint endpoint_of(const fs::path& path) {
  if (path.string().size() > 100) refuse(path, "a path of more than 100 bytes", "a shorter one");
  return stream_protocol::endpoint(path.string());
}

bool is_owner(stream_protocol::socket& socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
         (peer.uid == geteuid() || peer.uid == 0);
}

}  // namespace

// One connection at a time; the next waits until this one is through or its time is over.
struct ControlSocket::State {
  fs::path path;
  std::function<std::string(const std::string&)> handle;
  boost::asio::io_context context;
  stream_protocol::acceptor acceptor{context};
  std::optional<stream_protocol::socket> peer;
  boost::asio::steady_timer timer{context};
  boost::asio::streambuf line{longest_line};
  std::string answer;
  std::thread thread;

  void accept() {
    peer.emplace(context);
    acceptor.async_accept(*peer, [this](const error_code& error) {
      if (error) return;
      if (is_owner(*peer)) return listen();
      accept();
    });
  }
  void listen() {
    timer.expires_after(patience);
    timer.async_wait([this](const error_code& error) {
      error_code ignored;
      if (!error) peer->close(ignored);
    });
    line.consume(line.size());
    boost::asio::async_read_until(*peer, line, '\n', [this](const error_code& error, std::size_t) {
      if (error) return done();
      reply();
    });
  }
  void reply() {
    std::istream in(&line);
    std::string text;
    std::getline(in, text);
    try {
      answer = "ok: " + handle(text) + "\n";
    } catch (const SetupError& error) {
      answer = std::string("refused: ") + error.what() + "\n";
    }
    boost::asio::async_write(*peer, boost::asio::buffer(answer), [this](const error_code&, std::size_t) { done(); });
  }
  void done() {
    timer.cancel();
    accept();
  }
};

ControlSocket::ControlSocket(const fs::path& path, std::function<std::string(const std::string& line)> handle)
    : state_(std::make_unique<State>()) {
  state_->path = fs::absolute(path);
  state_->handle = std::move(handle);
  require_control_path(state_->path);
  const stream_protocol::endpoint endpoint = endpoint_of(state_->path);
  error_code error;
  state_->acceptor.open(endpoint.protocol());
  state_->acceptor.bind(endpoint, error);
  if (error) refuse(path, error.message(), "a path where a socket can be made");
  chmod(state_->path.c_str(), 0600);  // nobody else could come here before: the folder is ours alone
  state_->acceptor.listen();
  state_->accept();
  state_->thread = std::thread([this] { state_->context.run(); });
}

ControlSocket::~ControlSocket() {
  state_->context.stop();
  state_->thread.join();
  unlink(state_->path.c_str());
}

void require_control_path(const fs::path& path) {
  const fs::path absolute = fs::absolute(path);
  (void)endpoint_of(absolute);
  require_own_folder(absolute.parent_path());
  remove_stale(absolute);
}

std::string ask_control_socket(const fs::path& path, const std::string& line) {
  if (line.size() + 1 > longest_line || line.find('\n') != std::string::npos) {
    throw SetupError({.found = description::in_quotes(line.substr(0, 40)), .expected = "NAME=VALUE"});
  }
  boost::asio::io_context context;
  stream_protocol::socket socket(context);
  error_code error;
  socket.connect(endpoint_of(fs::absolute(path)), error);
  if (error) {
    const bool nobody = error == boost::asio::error::connection_refused;
    const bool nothing = error == boost::system::errc::no_such_file_or_directory;
    throw SetupError({.file = path.string(),
                      .key = "--control",
                      .found = nothing  ? "no such socket"
                               : nobody ? "a socket whose session has ended"
                                        : error.message(),
                      .expected = "a session that listens there",
                      .advice = "start it with `proxarm run --control " + path.string() + "`"});
  }
  boost::asio::write(socket, boost::asio::buffer(line + "\n"), error);
  boost::asio::streambuf answer;
  boost::asio::read_until(socket, answer, '\n', error);
  std::istream in(&answer);
  std::string text;
  if (!std::getline(in, text)) {
    throw SetupError({.file = path.string(), .key = "--control", .found = "no answer", .expected = "one"});
  }
  return text;
}

fs::path default_control_path() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime != '\0') return fs::path(runtime) / "proxarm" / "control";
  return fs::path("/tmp") / ("proxarm-" + std::to_string(geteuid())) / "control";
}

}  // namespace proxarm::command_line
