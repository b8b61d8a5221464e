#include "fieldbus/can/socket_can_network.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/if_arp.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>

#include "fieldbus/can/can_timing.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

// How long a measured difference between the clocks is used. CLOCK_REALTIME is slewed by at most 500 ppm, which is 5 µs
// in 10 ms.
constexpr std::int64_t difference_kept_ns = 10'000'000;
constexpr std::size_t batch_size = 32;  // frames per recvmmsg or sendmmsg

[[noreturn]] void refuse_kernel(const std::string& interface, int error) {
  if (error == EAFNOSUPPORT) {
    throw SetupError({.bus = interface,
                      .message = "this kernel has no CAN (address family AF_CAN is not supported)",
                      .advice = "load the module (modprobe can), or run on a kernel that has it"});
  }
  if (error == EPROTONOSUPPORT) {
    throw SetupError({.bus = interface,
                      .message = "this kernel's CAN has no raw sockets (CAN_RAW is not supported)",
                      .advice = "load the module (modprobe can-raw), or run on a kernel that has it"});
  }
  throw SetupError({.bus = interface, .message = std::string("cannot open a CAN socket: ") + std::strerror(error)});
}

CanSystem::Interface checked_interface(const std::string& name, CanSystem& system) {
  const CanSystem::Interface interface = system.interface(name);
  if (!interface.exists) {
    const std::string others = system.can_interfaces();
    throw SetupError({.bus = name,
                      .message = "there is no such network interface; CAN interfaces here: " +
                                 (others.empty() ? std::string("none") : others),
                      .advice = "for a virtual one: ip link add dev " + name + " type vcan && ip link set up " + name});
  }
  if (interface.hardware_type != ARPHRD_CAN) {
    const std::string others = system.can_interfaces();
    throw SetupError({.bus = name,
                      .message = "is a network interface but not a CAN one; CAN interfaces here: " +
                                 (others.empty() ? std::string("none") : others)});
  }
  if (!interface.up) {
    const bool is_virtual = interface.kind == "vcan" || interface.kind == "vxcan";
    throw SetupError({.bus = name,
                      .message = "the interface is down",
                      .advice = "ip link set up " + name + (is_virtual ? "" : " type can bitrate 1000000")});
  }
  return interface;
}

SendResult send_result(int error) noexcept {
  switch (error) {
    case ENOBUFS:
    case EAGAIN:
      return SendResult::queue_full;
    case ENETDOWN:
    case ENODEV:
    case ENXIO:
      return SendResult::down;
    default:
      return SendResult::refused;
  }
}

// Encodes the frame for the kernel. Returns how many bytes of `out` are to be passed to the kernel.
std::size_t encode(const CanFrame& frame, canfd_frame& out) noexcept {
  out.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0u) | (frame.remote ? CAN_RTR_FLAG : 0u);
  out.len = frame.length;
  out.flags = frame.fd && frame.bit_rate_switch ? CANFD_BRS : 0;
  const std::size_t data_bytes = frame.fd ? 64 : 8;
  if (frame.remote) {
    std::memset(out.data, 0, data_bytes);
  } else {
    std::memcpy(out.data, frame.data.data(), data_bytes);
  }
  return frame.fd ? CANFD_MTU : CAN_MTU;
}

CanFrame decode(const canfd_frame& raw, bool fd) noexcept {
  CanFrame out;
  out.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  out.remote = !fd && (raw.can_id & CAN_RTR_FLAG) != 0;
  out.id = raw.can_id & (out.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.fd = fd;
  out.bit_rate_switch = fd && (raw.flags & CANFD_BRS) != 0;
  out.length = std::min<std::uint8_t>(raw.len, fd ? 64 : 8);
  if (!out.remote) std::memcpy(out.data.data(), raw.data, out.length);
  return out;
}

}  // namespace

// Converts the kernel's time stamps to CLOCK_MONOTONIC. Without vDSO, each reading of a clock is a system call. To save
// calls, all buses share one reading of CLOCK_MONOTONIC, and a measured difference between the clocks is used for 10
// ms.
class SocketCanNetwork::Clocks {
 public:
  explicit Clocks(CanSystem& system) : system_(system) {}

  // Precondition: the caller has just received a batch.
  void read() noexcept {
    now_ns_ = system_.clock_ns(CLOCK_MONOTONIC);
    if (now_ns_ < read_again_ns_) return;
    offset_ns_ = now_ns_ - system_.clock_ns(CLOCK_REALTIME);
    read_again_ns_ = now_ns_ + difference_kept_ns;
  }
  [[nodiscard]] std::int64_t now_ns() const noexcept { return now_ns_; }  // time of the last call of read()
  // `stamp_ns` is 0 for a frame without a time stamp; the time of the last read() is then returned.
  [[nodiscard]] std::int64_t monotonic_ns(std::int64_t stamp_ns) const noexcept {
    return stamp_ns > 0 ? std::min(stamp_ns + offset_ns_, now_ns_) : now_ns_;
  }

 private:
  CanSystem& system_;
  std::int64_t now_ns_ = 0, offset_ns_ = 0, read_again_ns_ = std::numeric_limits<std::int64_t>::min();
};

class SocketCanNetwork::Bus final : public CanBus {
 public:
  Bus(std::string name, const CanSystem::Interface& interface, const SocketCanOptions& options, CanSystem& system,
      Clocks& clocks);
  ~Bus() override { system_.close(fd_); }

  SendResult send(const CanFrame& frame) noexcept override {
    SendResult result = SendResult::refused;
    send_all({&frame, 1}, 0, &result);
    return result;
  }
  void send_all(std::span<const CanFrame> frames, std::int64_t now_ns, SendResult* results) noexcept override;
  bool receive(TimedFrame& out) noexcept override;
  [[nodiscard]] const BusStatus& status() const noexcept override { return status_; }
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] bool fd_capable() const noexcept { return fd_capable_; }
  [[nodiscard]] bool has_frame() const noexcept { return next_ < count_; }
  // Notes that the socket is empty. Precondition: the kernel has just reported that no frame is waiting.
  void known_empty() noexcept { drained_ = !has_frame(); }
  // Reads a batch from the socket. Precondition: no decoded frame is left. The frames keep the kernel's time stamps
  // until date() is called. False if no frames, or only error frames, were waiting.
  bool fill() noexcept;
  void date() noexcept;

 private:
  struct Message {
    canfd_frame frame;
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> control;
  };

  void set_option(int level, int option, const void* value, unsigned size, const char* what);
  [[nodiscard]] bool can_send(const CanFrame& frame) const noexcept;
  void hand_over(std::size_t count, SendResult* results) noexcept;
  void prepare(std::size_t i) noexcept;
  [[nodiscard]] std::int64_t read_control(std::size_t i) noexcept;
  void read_error_frame(const canfd_frame& frame) noexcept;

  std::string name_;
  CanSystem& system_;
  Clocks& clocks_;
  int fd_;
  bool fd_capable_;
  BusStatus status_;
  std::array<mmsghdr, batch_size> out_headers_{};
  std::array<iovec, batch_size> out_vectors_{};
  std::array<canfd_frame, batch_size> out_frames_{};
  std::array<std::size_t, batch_size> out_places_{};  // position of each frame in the caller's list
  std::array<mmsghdr, batch_size> headers_{};
  std::array<iovec, batch_size> vectors_{};
  std::array<Message, batch_size> messages_{};
  // Decoded frames; frames in [next_, count_) are still to be returned by receive().
  std::array<TimedFrame, batch_size> frames_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  bool drained_ = false;  // the last batch emptied the socket, so the next receive() makes no system call
  std::uint32_t dropped_ = 0;
  std::int64_t last_time_ns_ = 0;
};

SocketCanNetwork::Bus::Bus(std::string name, const CanSystem::Interface& interface, const SocketCanOptions& options,
                           CanSystem& system, Clocks& clocks)
    : name_(std::move(name)),
      system_(system),
      clocks_(clocks),
      fd_(system.open_raw_can()),
      fd_capable_(interface.mtu >= CANFD_MTU) {
  if (fd_ < 0) refuse_kernel(name_, errno);
  try {
    const int on = 1;
    const can_err_mask_t errors = CAN_ERR_MASK;
    if (fd_capable_) set_option(SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on, "CAN_RAW_FD_FRAMES");
    set_option(SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors, "CAN_RAW_ERR_FILTER");
    set_option(SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on, "SO_RXQ_OVFL");
    set_option(SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on, "SO_TIMESTAMPNS");
    const int bytes = options.receive_buffer_bytes;
    if (system_.set_option(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0) {  // needs CAP_NET_ADMIN
      set_option(SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes, "SO_RCVBUF");
    }
    if (options.closed) set_option(SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0, "CAN_RAW_FILTER");
    if (system_.bind_can(fd_, interface.index) != 0) {
      throw SetupError({.bus = name_, .message = std::string("cannot bind to the interface: ") + std::strerror(errno)});
    }
  } catch (...) {
    system_.close(fd_);
    throw;
  }
  for (std::size_t i = 0; i < batch_size; ++i) {
    out_vectors_[i].iov_base = &out_frames_[i];
    out_headers_[i].msg_hdr.msg_iov = &out_vectors_[i];
    out_headers_[i].msg_hdr.msg_iovlen = 1;
    prepare(i);
  }
}

void SocketCanNetwork::Bus::set_option(int level, int option, const void* value, unsigned size, const char* what) {
  if (system_.set_option(fd_, level, option, value, size) == 0) return;
  throw SetupError({.bus = name_, .message = std::string("the kernel refuses ") + what + ": " + std::strerror(errno)});
}

bool SocketCanNetwork::Bus::can_send(const CanFrame& frame) const noexcept {
  return !frame.error && frame.id <= (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK) &&
         is_valid_length(frame.length, frame.fd) && !(frame.fd && (frame.remote || !fd_capable_));
}

void SocketCanNetwork::Bus::send_all(std::span<const CanFrame> frames, std::int64_t, SendResult* results) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    results[i] = status_.state == BusState::bus_off ? SendResult::bus_off : SendResult::refused;
    if (status_.state != BusState::bus_off && can_send(frames[i])) {
      out_vectors_[count].iov_len = encode(frames[i], out_frames_[count]);
      out_places_[count++] = i;
    }
    if (count == batch_size || i + 1 == frames.size()) {
      hand_over(count, results);
      count = 0;
    }
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ++(results[i] == SendResult::sent ? status_.frames_sent : status_.send_failures);
  }
}

// Passes the encoded frames to the kernel. sendmmsg() stops at the first frame that the kernel refuses. It gives the
// reason only if that frame was the first of the call. So the refused frame and the frames after it are passed in
// another call.
void SocketCanNetwork::Bus::hand_over(std::size_t count, SendResult* results) noexcept {
  std::size_t done = 0;
  while (done < count) {
    const int sent = system_.send_many(fd_, &out_headers_[done], static_cast<unsigned>(count - done));
    if (sent < 0 && errno == EINTR) continue;
    for (int i = 0; i < sent; ++i) results[out_places_[done++]] = SendResult::sent;
    if (sent > 0 && status_.state == BusState::down) status_.state = BusState::error_active;
    if (sent > 0) continue;
    const SendResult failed = send_result(sent < 0 ? errno : EINVAL);
    if (failed == SendResult::down) status_.state = BusState::down;
    results[out_places_[done++]] = failed;
  }
}

bool SocketCanNetwork::Bus::receive(TimedFrame& out) noexcept {
  if (!has_frame()) {
    const bool known_empty = drained_;
    drained_ = false;
    if (known_empty || !fill()) return false;
    clocks_.read();
    date();
  }
  out = frames_[next_++];
  ++status_.frames_received;
  return true;
}

// Resets message i for recvmmsg(), because the kernel has overwritten its lengths.
void SocketCanNetwork::Bus::prepare(std::size_t i) noexcept {
  vectors_[i] = {&messages_[i].frame, sizeof(canfd_frame)};
  headers_[i].msg_hdr = {};
  headers_[i].msg_hdr.msg_iov = &vectors_[i];
  headers_[i].msg_hdr.msg_iovlen = 1;
  headers_[i].msg_hdr.msg_control = messages_[i].control.data();
  headers_[i].msg_hdr.msg_controllen = messages_[i].control.size();
}

bool SocketCanNetwork::Bus::fill() noexcept {
  next_ = count_ = 0;
  const int got = system_.receive_many(fd_, headers_.data(), batch_size);
  if (got < 0 && (errno == ENETDOWN || errno == ENODEV || errno == ENXIO)) status_.state = BusState::down;
  if (got <= 0) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
    const std::int64_t stamp_ns = read_control(i);
    const unsigned bytes = headers_[i].msg_len;
    prepare(i);
    if (bytes != CAN_MTU && bytes != CANFD_MTU) continue;
    if ((messages_[i].frame.can_id & CAN_ERR_FLAG) != 0) {
      read_error_frame(messages_[i].frame);
      continue;
    }
    frames_[count_++] = {decode(messages_[i].frame, bytes == CANFD_MTU), stamp_ns};
  }
  if (count_ > 0 && status_.state == BusState::down) status_.state = BusState::error_active;
  drained_ = count_ > 0 && static_cast<std::size_t>(got) < batch_size;
  return count_ > 0;
}

void SocketCanNetwork::Bus::date() noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    last_time_ns_ = std::max(last_time_ns_, clocks_.monotonic_ns(frames_[i].time_ns));
    frames_[i].time_ns = last_time_ns_;
  }
}

// Reads the control data of message i. Returns the time stamp (CLOCK_REALTIME), or 0 if the message has no stamp.
std::int64_t SocketCanNetwork::Bus::read_control(std::size_t i) noexcept {
  std::int64_t stamp_ns = 0;
  msghdr& header = headers_[i].msg_hdr;
  for (cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr; control = CMSG_NXTHDR(&header, control)) {
    if (control->cmsg_level != SOL_SOCKET) continue;
    if (control->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(control), sizeof stamp);
      stamp_ns = std::int64_t{stamp.tv_sec} * 1'000'000'000 + stamp.tv_nsec;
    } else if (control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(control), sizeof dropped);
      // Unsigned difference, because the kernel's 32-bit counter may wrap.
      status_.receive_overflows += dropped - dropped_;
      dropped_ = dropped;
    }
  }
  return stamp_ns;
}

void SocketCanNetwork::Bus::read_error_frame(const canfd_frame& frame) noexcept {
  ++status_.error_frames;
  if ((frame.can_id & CAN_ERR_CRTL) != 0) {
    const std::uint8_t detail = frame.data[1];
    if ((detail & CAN_ERR_CRTL_RX_OVERFLOW) != 0) ++status_.receive_overflows;
    if ((detail & CAN_ERR_CRTL_ACTIVE) != 0) status_.state = BusState::error_active;
    if ((detail & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) status_.state = BusState::error_warning;
    if ((detail & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) status_.state = BusState::error_passive;
  }
  if ((frame.can_id & CAN_ERR_RESTARTED) != 0) status_.state = BusState::error_active;
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) status_.state = BusState::bus_off;
}

SocketCanNetwork::SocketCanNetwork(const std::vector<std::string>& interfaces, const SocketCanOptions& options,
                                   CanSystem& system)
    : system_(system), clocks_(std::make_unique<Clocks>(system)) {
  if (interfaces.empty()) return;  // a cell without CAN buses needs no CAN in the kernel
  // Check the kernel before the interfaces: without CAN in the kernel no interface can exist, and the message must say
  // so.
  const int probe = system_.open_raw_can();
  if (probe < 0) refuse_kernel(interfaces.front(), errno);
  system_.close(probe);
  for (const std::string& name : interfaces) {
    const auto known = std::find_if(buses_.begin(), buses_.end(), [&](const auto& bus) { return bus->name() == name; });
    bus_of_.push_back(static_cast<std::size_t>(known - buses_.begin()));
    if (known != buses_.end()) continue;
    buses_.push_back(std::make_unique<Bus>(name, checked_interface(name, system_), options, system_, *clocks_));
    poll_.push_back({buses_.back()->fd(), POLLIN, 0});
    filled_.push_back(false);
  }
}

SocketCanNetwork::~SocketCanNetwork() = default;

CanBus& SocketCanNetwork::bus(std::size_t index) noexcept { return *buses_[index]; }

bool SocketCanNetwork::carries_fd(std::size_t bus) const noexcept { return buses_[bus]->fd_capable(); }

void SocketCanNetwork::set_filters(std::size_t bus, const std::vector<CanFilter>& filters) {
  std::vector<can_filter> raw;
  for (const CanFilter& filter : filters) {
    const std::uint32_t format = filter.extended ? CAN_EFF_FLAG : 0u;
    const std::uint32_t bits = filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK;
    raw.push_back({(filter.id & bits) | format, (filter.mask & bits) | CAN_EFF_FLAG});
  }
  const auto size = static_cast<unsigned>(raw.size() * sizeof(can_filter));
  if (system_.set_option(buses_[bus]->fd(), SOL_CAN_RAW, CAN_RAW_FILTER, raw.data(), size) != 0) {
    throw SetupError(
        {.bus = buses_[bus]->name(),
         .message = "the kernel refuses " + std::to_string(raw.size()) + " receive filters: " + std::strerror(errno)});
  }
}

bool SocketCanNetwork::wait_for_frame(std::int64_t deadline_ns) noexcept {
  for (const auto& bus : buses_) {
    if (bus->has_frame()) return true;
  }
  for (;;) {
    const std::int64_t begun_ns = now_ns(), rest_ns = deadline_ns - begun_ns;
    const int ready = system_.poll(poll_.data(), poll_.size(), rest_ns);
    bool any = false;
    if (ready > 0) {
      for (std::size_t i = 0; i < poll_.size(); ++i) {
        if (poll_[i].revents != 0) {
          filled_[i] = buses_[i]->fill();
          any = any || filled_[i];
        } else {
          buses_[i]->known_empty();
          filled_[i] = false;
        }
      }
      if (any) {
        clocks_->read();
        waited_ns_ += clocks_->now_ns() - begun_ns;
        for (std::size_t i = 0; i < poll_.size(); ++i) {
          if (filled_[i]) buses_[i]->date();
        }
        return true;
      }
      // Only error frames were waiting, or an interface went down (poll() reports that once): keep waiting.
    }
    if (rest_ns > 0 && ready != 0) continue;
    // poll() never returns before its timeout, so the deadline has passed.
    if (ready == 0) {
      waited_ns_ += std::max<std::int64_t>(rest_ns, 0);
      for (const auto& bus : buses_) bus->known_empty();
    }
    return false;
  }
}

bool is_virtual_can(const std::string& interface, CanSystem& system) {
  const CanSystem::Interface found = system.interface(interface);
  return found.exists && found.hardware_type == ARPHRD_CAN && (found.kind == "vcan" || found.kind == "vxcan");
}

}  // namespace proxarm::fieldbus
