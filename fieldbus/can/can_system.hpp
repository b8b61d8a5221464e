// The system calls of SocketCanNetwork, one virtual function for each call. Tests override the functions to simulate
// ENOBUFS, EAFNOSUPPORT or a lost interface. Behaviour, return value and errno of each function are those of its system
// call.
#pragma once

#include <poll.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>

namespace proxarm::fieldbus {

class CanSystem {
 public:
  // `kind` is the driver's link kind ("vcan", "can"), or empty if the driver reports no kind.
  struct Interface {
    bool exists = false;
    unsigned index = 0;
    unsigned hardware_type = 0;  // ARPHRD_CAN for a CAN interface
    bool up = false;
    unsigned mtu = 0;  // CAN_MTU or CANFD_MTU
    std::string kind{};
  };

  CanSystem() = default;
  CanSystem(const CanSystem&) = delete;
  CanSystem& operator=(const CanSystem&) = delete;
  virtual ~CanSystem() = default;
  // Returns the implementation that makes real system calls. It has no state.
  static CanSystem& real() noexcept;

  // Asks for the interface by rtnetlink, which works even if the kernel has no CAN.
  [[nodiscard]] virtual Interface interface(const std::string& name);
  // Returns the names of all CAN interfaces, such as "vcan0, can1"; empty if there are none.
  [[nodiscard]] virtual std::string can_interfaces();

  virtual int open_raw_can() noexcept;  // socket(PF_CAN, SOCK_RAW | nonblocking, CAN_RAW)
  virtual int bind_can(int fd, unsigned interface_index) noexcept;
  virtual int close(int fd) noexcept;
  virtual int set_option(int fd, int level, int option, const void* value, unsigned size) noexcept;
  virtual int send_many(int fd, mmsghdr* messages, unsigned count) noexcept;     // sendmmsg(MSG_DONTWAIT)
  virtual int receive_many(int fd, mmsghdr* messages, unsigned count) noexcept;  // recvmmsg(MSG_DONTWAIT)
  virtual int poll(pollfd* fds, std::size_t count, std::int64_t timeout_ns) noexcept;
  virtual std::int64_t clock_ns(clockid_t clock) noexcept;
  virtual void sleep_until(std::int64_t monotonic_ns) noexcept;
};

}  // namespace proxarm::fieldbus
