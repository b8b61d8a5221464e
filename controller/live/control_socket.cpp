#include "controller/live/control_socket.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <istream>
#include <optional>
#include <thread>
#include <utility>  // before Asio 1.74, which doesn't include it

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;
using boost::asio::local::stream_protocol;
using boost::system::error_code;
using description::SetupError;

constexpr std::size_t longest_line = 1024;
constexpr std::size_t most_connections = 16;                     // a person has one or two
constexpr auto patience = std::chrono::seconds(2);               // with a client that connects and sends nothing
constexpr auto retry_after = std::chrono::milliseconds(10);      // time from a failed accept() to the next one
constexpr auto time_for_a_line = std::chrono::milliseconds(50);  // that a client has if descriptors are scarce
// How long a client waits for an answer. A running session answers orders and a status within some milliseconds.
// Changes may take longer, because they are checked first.
constexpr int answer_within_ms = 5000, status_within_ms = 1000;

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

// Removes the socket of a session that has died. Throws SetupError if a running session answers there.
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

namespace {

// A client's connection, which takes one line and gets one answer.
struct Connection {
  explicit Connection(boost::asio::io_context& context) : socket(context), timer(context) {}

  stream_protocol::socket socket;
  boost::asio::steady_timer timer;
  boost::asio::streambuf line{longest_line};
  std::string answer;
  std::atomic<bool> closed{false};  // read by the thread that judges changes
  std::chrono::steady_clock::time_point since = std::chrono::steady_clock::now();
};
using Client = std::shared_ptr<Connection>;

// Returns the answer of a handler. An exception becomes an answer, because an exception that leaves the thread would
// end the process while the arm moves.
template <typename Handle>
std::string answer_of(const Handle& handle) {
  try {
    return std::string(agreed) + handle() + "\n";
  } catch (const std::exception& error) {
    return std::string("refused: ") + error.what() + "\n";
  }
}

// Reserved file descriptors, which are released for use when the process has no others left.
class Reserve {
 public:
  Reserve() {
    kept_.fill(-1);
    keep();
  }
  Reserve(const Reserve&) = delete;
  Reserve& operator=(const Reserve&) = delete;
  ~Reserve() { give(); }

  // Reserves again as many of the released descriptors as possible.
  void keep() noexcept {
    for (int& kept : kept_) {
      if (kept < 0) kept = open("/dev/null", O_RDONLY | O_CLOEXEC);
    }
  }
  // Releases all reserved descriptors. Returns false if none was reserved.
  bool give() noexcept {
    bool given = false;
    for (int& kept : kept_) {
      if (kept < 0) continue;
      close(std::exchange(kept, -1));
      given = true;
    }
    return given;
  }

 private:
  std::array<int, 4> kept_{};
};

// The lock that the session listening at `path` holds. The lock file is never removed: if it were, two sessions could
// each lock a file of that name.
class PathLock {
 public:
  explicit PathLock(const fs::path& path)
      : descriptor_(open((path.string() + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600)) {
    if (descriptor_ >= 0 && flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
    const int why = errno;
    if (descriptor_ >= 0) close(descriptor_);
    refuse(path, why == EWOULDBLOCK ? "the socket of another session" : std::strerror(why), "a path that is free");
  }
  PathLock(const PathLock&) = delete;
  PathLock& operator=(const PathLock&) = delete;
  ~PathLock() { close(descriptor_); }

 private:
  int descriptor_;
};

// Locks the path for this process. A stale socket is removed only after the path is locked; before, the socket could
// belong to a session that is just starting.
std::unique_ptr<PathLock> claim(const fs::path& path) {
  (void)endpoint_of(path);
  require_own_folder(path.parent_path());
  auto lock = std::make_unique<PathLock>(path);
  remove_stale(path);
  return lock;
}

}  // namespace

// All functions except judge() run in the thread of `context`.
struct ControlSocket::State {
  State(const fs::path& at, ControlHandlers h) : path(at), handlers(std::move(h)), lock(claim(at)) {}

  fs::path path;
  ControlHandlers handlers;
  std::unique_ptr<PathLock> lock;
  boost::asio::io_context context{1}, judging{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work = boost::asio::make_work_guard(judging);
  stream_protocol::acceptor acceptor{context};
  boost::asio::steady_timer retry{context};
  Reserve reserve;
  std::deque<Client> clients;  // the oldest first
  std::thread thread, judging_thread;

  void accept() {
    const Client client = std::make_shared<Connection>(context);
    acceptor.async_accept(client->socket, [this, client](const error_code& error) {
      if (error == boost::asio::error::operation_aborted) return;
      if (error) return accept_later();
      client->since = std::chrono::steady_clock::now();
      clients.push_back(client);
      if (clients.size() > most_connections) end(clients.front());
      if (is_owner(client->socket)) {
        listen(client);
      } else {
        end(client);
      }
      accept();
    });
  }
  // Calls accept() again later, with more file descriptors: the reserved ones, or that of the oldest client. accept()
  // takes a descriptor before it knows whether a client waits, so it may fail although nobody waits. Therefore the
  // oldest client's connection is closed only if that client had time to send its line.
  void accept_later() {
    const auto latest = std::chrono::steady_clock::now() - time_for_a_line;
    if (!reserve.give() && !clients.empty() && clients.front()->since < latest) end(clients.front());
    retry.expires_after(retry_after);
    retry.async_wait([this](const error_code& error) {
      if (!error) accept();
    });
  }
  void listen(const Client& client) {
    client->timer.expires_after(patience);
    client->timer.async_wait([this, client](const error_code& error) {
      if (!error) end(client);
    });
    boost::asio::async_read_until(client->socket, client->line, '\n',
                                  [this, client](const error_code& error, std::size_t) {
                                    if (error) return end(client);
                                    take(client);
                                  });
  }
  void take(const Client& client) {
    std::istream in(&client->line);
    std::string text;
    std::getline(in, text);
    bool is_order = true;
    std::string answer = answer_of([&] {
      const std::optional<std::string> done = handlers.order(text);
      is_order = done.has_value();
      return done.value_or("");
    });
    if (is_order) return reply(client, std::move(answer));
    boost::asio::post(judging, [this, client, text] { judge(client, text); });
  }
  void judge(const Client& client, const std::string& text) {
    if (client->closed.load()) return;  // the client couldn't learn the result
    std::string answer = answer_of([&] { return handlers.change(text); });
    boost::asio::post(context, [this, client, answer = std::move(answer)] { reply(client, answer); });
  }
  void reply(const Client& client, std::string answer) {
    client->answer = std::move(answer);
    boost::asio::async_write(client->socket, boost::asio::buffer(client->answer),
                             [this, client](const error_code&, std::size_t) { end(client); });
  }
  void end(Client client) {  // by value, because the argument may be an element of `clients`, which erase() changes
    error_code ignored;
    client->closed.store(true);
    client->timer.cancel();
    client->socket.close(ignored);
    std::erase(clients, client);
    reserve.keep();
  }
};

ControlSocket::ControlSocket(const fs::path& path, ControlHandlers handlers)
    : state_(std::make_unique<State>(fs::absolute(path), std::move(handlers))) {
  const stream_protocol::endpoint endpoint = endpoint_of(state_->path);
  error_code error;
  state_->acceptor.open(endpoint.protocol(), error);
  if (!error) state_->acceptor.bind(endpoint, error);
  if (error) refuse(path, error.message(), "a path where a socket can be made");
  // Before this call the socket was safe, too, because only this user may enter the folder.
  chmod(state_->path.c_str(), 0600);
  state_->acceptor.listen();
  state_->accept();
  state_->judging_thread = std::thread([this] { state_->judging.run(); });
  state_->thread = std::thread([this] { state_->context.run(); });
}

ControlSocket::~ControlSocket() {
  state_->judging.stop();
  state_->judging_thread.join();
  state_->context.stop();
  state_->thread.join();
  unlink(state_->path.c_str());
}

void require_control_path(const fs::path& path) { (void)claim(fs::absolute(path)); }

namespace {

SetupError no_answer(const fs::path& path, int within_ms) {
  const std::string waited = within_ms == 0 ? "" : " within " + std::to_string(within_ms / 1000) + " s";
  return SetupError({.file = path.string(),
                     .key = "--control",
                     .found = "no answer" + waited,
                     .expected = "one",
                     .advice =
                         "is the session suspended (Ctrl-Z, a debugger), or flooded by others? Its drives stop by "
                         "themselves while it stands"});
}

}  // namespace

std::string ask_control_socket(const fs::path& path, const std::string& line) {
  if (line.size() + 1 > longest_line || line.find('\n') != std::string::npos) {
    throw SetupError({.found = description::in_quotes(line.substr(0, 40)), .expected = "NAME=VALUE"});
  }
  boost::asio::io_context context;
  stream_protocol::socket socket(context);
  error_code error;
  socket.open();
  // A suspended session accepts no client. Once its queue is full, a blocking connect() would wait for ever.
  socket.non_blocking(true);
  socket.connect(endpoint_of(fs::absolute(path)), error);
  if (error == boost::asio::error::would_block || error == boost::asio::error::try_again) throw no_answer(path, 0);
  if (error) {
    const bool nobody = error == boost::asio::error::connection_refused;
    const bool nothing = error == boost::system::errc::no_such_file_or_directory;
    throw SetupError({.file = path.string(),
                      .key = "--control",
                      .found = nothing  ? "no such socket"
                               : nobody ? "a socket whose session has ended"
                                        : error.message(),
                      .expected = "a session that listens there",
                      .advice = "start it with `proxarm run --control " +
                                (path == default_control_path() ? "default" : path.string()) +
                                "`, with --pace realtime if it is simulated: else it is over in a moment"});
  }
  socket.non_blocking(false);
  boost::asio::write(socket, boost::asio::buffer(line + "\n"), error);
  const int within_ms = line.starts_with("status") ? status_within_ms : answer_within_ms;
  pollfd answered{socket.native_handle(), POLLIN, 0};
  boost::asio::streambuf answer;
  if (poll(&answered, 1, within_ms) == 1) boost::asio::read_until(socket, answer, '\n', error);
  std::istream in(&answer);
  std::string text;
  if (!std::getline(in, text)) throw no_answer(path, within_ms);
  return text;
}

fs::path default_control_path() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && *runtime != '\0') return fs::path(runtime) / "proxarm" / "control";
  return fs::path("/tmp") / ("proxarm-" + std::to_string(geteuid())) / "control";
}

}  // namespace proxarm::controller
