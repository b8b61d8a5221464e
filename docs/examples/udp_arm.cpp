// An arm whose own controller takes joint positions over UDP, in the place of the cell's drives.
// docs/how_to/own_interface.md has the datagrams and what both sides guarantee.
//
//   udp_arm PORT [RATE_HZ [SECONDS]]
//
// The arm's controller is a process of this machine (127.0.0.1). The session is a simulated one: hand and force sensor
// are at a simulated arm that goes where the controller says that its joints are.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "controller/library/session.hpp"
#include "fieldbus/cia402/cia402_units.hpp"

namespace fieldbus = proxarm::fieldbus;
using fieldbus::DriveGoal;
using fieldbus::DriveState;
using Clock = std::chrono::steady_clock;

// ---- The datagrams: little-endian, 64 bytes each

constexpr std::size_t joints = 6;
using Joints = std::array<double, joints>;  // rad

enum class Wish : std::uint32_t { off = 0, follow = 1, stop = 2 };
enum class ArmState : std::uint32_t { off = 0, follows = 1, stops = 2, fault = 3 };

// To the controller. The controller's answer has the same fields: its own word, the number of the setpoint that it
// answers, its state, and where its joints are.
struct Message {
  std::uint32_t word = 0;    // "PXA1" to the controller, "PXS1" from it
  std::uint32_t number = 0;  // rises by one with each setpoint
  std::uint32_t wish = 0;    // Wish or ArmState
  std::uint32_t period_us = 0;
  Joints q_rad{};
};
static_assert(sizeof(Message) == 64 && std::endian::native == std::endian::little);

constexpr std::uint32_t setpoint_word = 0x31415850, state_word = 0x31535850;  // "PXA1", "PXS1"

bool is_state(const Message& message, ssize_t bytes) {
  return bytes == sizeof message && message.word == state_word && message.wish <= 3 &&
         std::all_of(message.q_rad.begin(), message.q_rad.end(), [](double q) { return std::isfinite(q); });
}

// ---- The connection: one datagram a cycle in each direction, for all joints

// Owns the descriptor, so that it is closed even if a constructor throws after socket().
class UdpSocket {
 public:
  UdpSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {}
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  ~UdpSocket() {
    if (fd_ >= 0) close(fd_);
  }
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

class ArmLink {
 public:
  ArmLink(int port, double period_s) : period_s_(period_s) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // Once the socket is connected, the kernel drops datagrams of other senders.
    if (socket_.fd() < 0 || connect(socket_.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      throw proxarm::SetupError({.message = "no UDP socket"});
    }
    for (int attempt = 0; attempt < 100 && !answer_; ++attempt) {
      send(Wish::off, {});
      await(std::chrono::milliseconds(20));
    }
    if (!answer_) throw proxarm::SetupError({.message = "the arm's controller", .found = "no answer for two seconds"});
  }
  ArmLink(const ArmLink&) = delete;
  ArmLink& operator=(const ArmLink&) = delete;
  ~ArmLink() {
    if (answer_) send(Wish::off, answer_->q_rad);
  }

  // Once a cycle, from the first joint's drive: sends what all joints were set to in the last one, and takes the
  // answer. The session's time is virtual, and waits here: for the clock of the machine, then for an answer that is
  // late on a busy machine. Without an answer it goes on, and waits no more until one comes. A real loop never waits.
  void exchange(std::int64_t now_ns) noexcept {
    if (!begun_) begun_ = Clock::now() - std::chrono::nanoseconds(now_ns);
    std::this_thread::sleep_until(*begun_ + std::chrono::nanoseconds(now_ns));
    const bool waits = missed_ == 0;
    answer_is_new_ = false;
    send(wish_, target_rad);
    const Clock::time_point sent = Clock::now();
    await(waits ? std::chrono::milliseconds(100) : std::chrono::milliseconds(0));
    missed_ = answer_is_new_ ? 0 : missed_ + 1;
    ++exchanges_;
    if (!answer_is_new_) return;
    const double took_us = 1e6 * std::chrono::duration<double>(Clock::now() - sent).count();
    longest_us_ = std::max(longest_us_, took_us);
    took_us_ += took_us;
    // Time that was spent waiting isn't caught up.
    begun_ = std::max(*begun_, Clock::now() - std::chrono::nanoseconds(now_ns) - std::chrono::milliseconds(1));
  }

  // The session asks for one thing, of all joints.
  void request(DriveGoal goal) noexcept {
    wish_ = goal == DriveGoal::operation_enabled ? Wish::follow
            : goal == DriveGoal::quick_stop      ? Wish::stop
                                                 : Wish::off;
  }
  [[nodiscard]] const Message& answer() const noexcept { return *answer_; }
  [[nodiscard]] ArmState state() const noexcept { return static_cast<ArmState>(answer_->wish); }
  [[nodiscard]] std::uint32_t missed() const noexcept { return missed_; }
  [[nodiscard]] std::string figures() const {
    char text[120];
    std::snprintf(text, sizeof text, "%u exchanges, answered after %.0f us on average, %.0f us at most", exchanges_,
                  took_us_ / std::max(exchanges_, 1U), longest_us_);
    return text;
  }

  Joints target_rad{};

 private:
  void send(Wish wish, const Joints& q_rad) noexcept {
    const Message message{setpoint_word, ++number_, static_cast<std::uint32_t>(wish),
                          static_cast<std::uint32_t>(std::lround(1e6 * period_s_)), q_rad};
    for (int attempt = 0; attempt < 2; ++attempt) {  // a refusal of the last one is told by the next call
      if (::send(socket_.fd(), &message, sizeof message, MSG_NOSIGNAL) >= 0) return;
    }
  }

  // Takes answers until that to the latest setpoint has come, or the time is over.
  void await(Clock::duration patience) noexcept {
    const Clock::time_point until = Clock::now() + patience;
    do {
      Message message;
      for (ssize_t bytes = 0; (bytes = recv(socket_.fd(), &message, sizeof message, MSG_TRUNC)) >= 0;) {
        if (!is_state(message, bytes) || message.number != number_) continue;
        answer_ = message;
        answer_is_new_ = true;
        return;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(50));
    } while (Clock::now() < until);
  }

  UdpSocket socket_;
  double period_s_;
  std::uint32_t number_ = 0, missed_ = 0, exchanges_ = 0;
  Wish wish_ = Wish::off;
  std::optional<Message> answer_;
  bool answer_is_new_ = false;
  std::optional<Clock::time_point> begun_;
  double took_us_ = 0.0, longest_us_ = 0.0;
};

// ---- A joint's drive

class UdpDrive final : public fieldbus::CyclicDrive {
 public:
  UdpDrive(ArmLink& link, proxarm::sim::Plant& arm, std::size_t axis,
           const proxarm::description::DriveDescription& description, double start_rad, double period_s)
      : link_(link), arm_(arm), axis_(axis), description_(description), scale_(description) {
    arm_.servo(axis_).set_interpolation_period_ns(std::llround(1e9 * period_s));
    actual_rad_ = link_.target_rad[axis_] = link_.answer().q_rad[axis_];
    // The simulated arm stands where the cell says. Another arm, or one that stands elsewhere, isn't this cell's.
    if (std::abs(actual_rad_ - start_rad) > 0.001) {
      throw proxarm::SetupError({.key = "start_rad",
                                 .found = description.joint + " at " + std::to_string(actual_rad_) + " rad",
                                 .expected = std::to_string(start_rad) + " rad, as the cell says"});
    }
  }

  void on_sync(std::int64_t now_ns) noexcept override {
    if (axis_ == 0) link_.exchange(now_ns);
    if (link_.missed() > 0) return;
    actual_rad_ = link_.answer().q_rad[axis_];
    judge_state();
    // Until the arm follows, its setpoint is where it is: so the first one that counts is no jump.
    if (!following()) link_.target_rad[axis_] = actual_rad_;
    // The simulated arm, with its hand and its force sensor, goes with the controller's joints.
    if (goal_ == DriveGoal::operation_enabled && !arm_.servo(axis_).powered()) arm_.enable(axis_, now_ns);
    const auto counts = scale_.counts(actual_rad_);
    if (counts && arm_.servo(axis_).powered()) arm_.servo(axis_).set_target(*counts, now_ns);
  }

  void request(DriveGoal goal) noexcept override {
    if (goal != goal_) has_followed_ = false;
    link_.request(goal_ = goal);
  }
  bool set_target_rad(double angle_rad) noexcept override {
    if (!following() || !scale_.counts(angle_rad)) return false;
    link_.target_rad[axis_] = angle_rad;
    return true;
  }

  // No frame of a CAN bus comes or goes.
  bool on_frame(const fieldbus::CanFrame&, std::int64_t) noexcept override { return false; }
  bool encode_rpdo(fieldbus::CanFrame&) noexcept override { return false; }

  [[nodiscard]] bool fresh() const noexcept override { return link_.missed() == 0; }
  // More than three in a row are the fault drive_silent, and the session ends.
  [[nodiscard]] std::uint32_t cycles_without_tpdo() const noexcept override { return link_.missed(); }
  [[nodiscard]] bool following() const noexcept override {
    return goal_ == DriveGoal::operation_enabled && link_.state() == ArmState::follows;
  }
  [[nodiscard]] DriveState state() const noexcept override {
    constexpr DriveState states[] = {DriveState::switch_on_disabled, DriveState::operation_enabled,
                                     DriveState::quick_stop_active, DriveState::fault};
    return states[static_cast<std::size_t>(link_.state())];
  }
  [[nodiscard]] std::int32_t actual_counts() const noexcept override { return scale_.counts(actual_rad_).value_or(0); }
  [[nodiscard]] double actual_rad() const noexcept override { return actual_rad_; }
  [[nodiscard]] std::int32_t target_counts() const noexcept override { return scale_.counts(target_rad()).value_or(0); }
  [[nodiscard]] double target_rad() const noexcept override { return link_.target_rad[axis_]; }
  [[nodiscard]] fieldbus::DriveFault fault() const noexcept override { return fault_; }
  void forget_fault() noexcept override { fault_ = fieldbus::DriveFault::none; }
  [[nodiscard]] std::string describe() const override { return "the arm's controller on UDP, " + link_.figures(); }
  [[nodiscard]] const proxarm::description::DriveDescription& description() const noexcept override {
    return description_;
  }
  void archive(fieldbus::StateArchive& state) noexcept override { state(goal_, fault_, has_followed_, actual_rad_); }

 private:
  // An arm that stops by itself, as by its watchdog, is a fault: else the session would wait for it, and it could move
  // again by itself.
  void judge_state() noexcept {
    if (following()) has_followed_ = true;
    if (goal_ != DriveGoal::operation_enabled || fault_ != fieldbus::DriveFault::none) return;
    if (link_.state() == ArmState::fault) {
      fault_ = fieldbus::DriveFault::state_fault;
    } else if (has_followed_ && !following()) {
      fault_ = fieldbus::DriveFault::left_operation;
    }
  }

  ArmLink& link_;
  proxarm::sim::Plant& arm_;
  std::size_t axis_;
  proxarm::description::DriveDescription description_;
  fieldbus::CountScale scale_;
  DriveGoal goal_ = DriveGoal::none;
  fieldbus::DriveFault fault_ = fieldbus::DriveFault::none;
  bool has_followed_ = false;  // since the goal is operation
  double actual_rad_ = 0.0;
};

// Returns the number that is the whole word, from `lowest` to `highest`.
double number_of(const char* word, const char* name, double lowest, double highest) {
  char* end = nullptr;
  const double number = std::strtod(word, &end);
  if (end != word && *end == '\0' && number >= lowest && number <= highest) return number;
  char expected[60];
  std::snprintf(expected, sizeof expected, "a number from %g to %g", lowest, highest);
  throw proxarm::SetupError({.key = name, .found = word, .expected = expected});
}

int main(int count, char** words) try {
  if (count < 2) {
    std::fprintf(stderr, "udp_arm PORT [RATE_HZ [SECONDS]]: the port of the arm's controller on 127.0.0.1\n");
    return 2;
  }
  const int port = static_cast<int>(number_of(words[1], "PORT", 1, 65'535));
  const double rate_Hz = count > 2 ? number_of(words[2], "RATE_HZ", 100, 1000) : 250.0;
  const double seconds = count > 3 ? number_of(words[3], "SECONDS", 0.1, 3600) : 6.0;
  // Heavier than the default cell's 4 kg: a cycle and the network are between setpoint and joint.
  proxarm::Session session({{"timestep", 1.0 / rate_Hz}, {"mass", 20.0}, {"damping", 20.0}, {"duration", seconds}});
  const proxarm::description::Cell& cell = session.prepared().cell;
  ArmLink link(port, 1.0 / rate_Hz);
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    session.set_drive(cell.drives[i].joint, [&, start_rad = cell.start_rad[i]](
                                                proxarm::controller::FarEnd& far_end, std::size_t axis,
                                                const proxarm::description::DriveDescription& description) {
      return std::make_unique<UdpDrive>(link, far_end.cell.plant(), axis, description, start_rad, 1.0 / rate_Hz);
    });
  }
  const proxarm::Summary summary = session.run();
  std::printf("%s%s\n", proxarm::summary_text(summary).c_str(), link.figures().c_str());
  return summary.faults.empty() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
