// The system calls of SocketCanNetwork, one virtual function each. Tests override them to return ENOBUFS, EAFNOSUPPORT
// or a lost interface. Semantics, results and errno are those of the calls.
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
  // `kind` is the driver's link kind ("vcan", "can"), empty if it has none.
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
  // The real system calls; stateless.
  static CanSystem& real() noexcept;

  [[nodiscard]] virtual Interface interface(const std::string& name);  // by rtnetlink; works without CAN in the kernel
  [[nodiscard]] virtual std::string can_interfaces();                  // names, "vcan0, can1"; empty: none

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
