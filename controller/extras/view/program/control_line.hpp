// Lets the page send lines to a session's control socket, as `proxarm set` does.
#pragma once

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace proxarm::command_line {

class ControlLine {
 public:
  using Answered = std::function<void(const std::string& answer)>;

  // `socket` is the path of the control socket; empty: the page may ask nothing. Precondition: `server` outlives this
  // object.
  ControlLine(std::filesystem::path socket, boost::asio::io_context& server);
  ControlLine(const ControlLine&) = delete;
  ControlLine& operator=(const ControlLine&) = delete;
  ~ControlLine();

  [[nodiscard]] bool open() const noexcept { return !socket_.empty(); }
  // Sends a line to the session and calls `answered` with the answer, "ok: …" or "refused: …", in the server's thread.
  // Lines are sent one after the other in a separate thread, because a session may take time to answer. While eight
  // lines wait, further lines are refused.
  void ask(std::string line, Answered answered);

 private:
  std::filesystem::path socket_;
  boost::asio::io_context& server_;
  boost::asio::io_context asking_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::size_t waiting_ = 0;  // used by the server's thread only
  std::thread thread_;
};

}  // namespace proxarm::command_line
