#include "controller/extras/view/program/control_line.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "controller/live/control_socket.hpp"

namespace proxarm::command_line {
namespace {

constexpr std::size_t most_waiting = 8;
constexpr std::size_t longest_line = 256;

bool is_line(const std::string& text) {
  return !text.empty() && text.size() <= longest_line &&
         std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; });
}

std::string answer_to(const std::filesystem::path& socket, const std::string& line) {
  try {
    return controller::ask_control_socket(socket, line);
  } catch (const std::exception& error) {
    return std::string("refused: ") + error.what();
  }
}

}  // namespace

ControlLine::ControlLine(std::filesystem::path socket, boost::asio::io_context& server)
    : socket_(std::move(socket)), server_(server), work_(boost::asio::make_work_guard(asking_)) {
  if (open()) thread_ = std::thread([this] { asking_.run(); });
}

ControlLine::~ControlLine() {
  asking_.stop();
  if (thread_.joinable()) thread_.join();
}

void ControlLine::ask(std::string line, Answered answered) {
  if (!open()) return answered("refused: this page may only look; start the session with --view-control");
  if (!is_line(line)) return answered("refused: that is no line that a session takes");
  if (waiting_ >= most_waiting) return answered("refused: too many at once");
  ++waiting_;
  boost::asio::post(asking_, [this, line = std::move(line), answered = std::move(answered)] {
    boost::asio::post(server_, [this, answered, answer = answer_to(socket_, line)] {
      --waiting_;
      answered(answer);
    });
  });
}

}  // namespace proxarm::command_line
