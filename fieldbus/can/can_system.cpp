#include "fieldbus/can/can_system.hpp"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/rtnetlink.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

timespec to_timespec(std::int64_t ns) noexcept {
  return {static_cast<std::time_t>(ns / ns_per_s), static_cast<long>(ns % ns_per_s)};
}

// An RTM_GETLINK request for one interface by name, or for all interfaces.
struct LinkRequest {
  nlmsghdr header{};
  ifinfomsg message{};
  alignas(NLMSG_ALIGNTO) std::array<char, 64> attributes{};
};

LinkRequest link_request(const std::string* name) {
  LinkRequest request;
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = static_cast<std::uint16_t>(NLM_F_REQUEST | (name == nullptr ? NLM_F_DUMP : 0));
  request.header.nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
  request.message.ifi_family = AF_UNSPEC;
  if (name != nullptr) {
    auto* attribute = reinterpret_cast<rtattr*>(request.attributes.data());
    attribute->rta_type = IFLA_IFNAME;
    attribute->rta_len = static_cast<unsigned short>(RTA_LENGTH(name->size() + 1));
    std::memcpy(RTA_DATA(attribute), name->c_str(), name->size() + 1);
    request.header.nlmsg_len += RTA_ALIGN(attribute->rta_len);
  }
  return request;
}

// Calls on_attribute(type, data, bytes) for each attribute in the memory range [attribute, attribute + bytes).
template <class F>
void for_each_attribute(rtattr* attribute, long bytes, F&& on_attribute) {
  while (bytes >= static_cast<long>(sizeof(rtattr)) && attribute->rta_len >= sizeof(rtattr) &&
         static_cast<long>(attribute->rta_len) <= bytes) {
    on_attribute(attribute->rta_type & NLA_TYPE_MASK, static_cast<char*>(RTA_DATA(attribute)),
                 static_cast<long>(RTA_PAYLOAD(attribute)));
    const long step = static_cast<long>(RTA_ALIGN(attribute->rta_len));
    bytes -= step;
    attribute = reinterpret_cast<rtattr*>(reinterpret_cast<char*>(attribute) + step);
  }
}

std::string text_of(const char* data, long bytes) { return {data, strnlen(data, static_cast<std::size_t>(bytes))}; }

struct NamedInterface {
  std::string name;
  CanSystem::Interface interface;
};

NamedInterface decode_link(nlmsghdr* header) {
  const auto* link = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  NamedInterface out;
  out.interface.exists = true;
  out.interface.index = static_cast<unsigned>(link->ifi_index);
  out.interface.hardware_type = link->ifi_type;
  out.interface.up = (link->ifi_flags & IFF_UP) != 0;
  for_each_attribute(IFLA_RTA(link), static_cast<long>(IFLA_PAYLOAD(header)), [&](int type, char* data, long bytes) {
    if (type == IFLA_IFNAME) {
      out.name = text_of(data, bytes);
    } else if (type == IFLA_MTU && bytes >= 4) {
      std::memcpy(&out.interface.mtu, data, 4);
    } else if (type == IFLA_LINKINFO) {
      for_each_attribute(reinterpret_cast<rtattr*>(data), bytes, [&](int nested, char* nested_data, long nested_bytes) {
        if (nested == IFLA_INFO_KIND) out.interface.kind = text_of(nested_data, nested_bytes);
      });
    }
  });
  return out;
}

// Asks the kernel for the interface `name`, or for all interfaces if `name` is nullptr. Calls on_link for each answer.
// False if netlink itself fails.
template <class F>
bool query_links(const std::string* name, F&& on_link) {
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return false;
  const LinkRequest request = link_request(name);
  bool more = ::send(fd, &request, request.header.nlmsg_len, 0) >= 0;
  const bool asked = more;
  alignas(nlmsghdr) static thread_local std::array<char, 65536> buffer;
  while (more) {
    auto bytes = ::recv(fd, buffer.data(), buffer.size(), 0);
    if (bytes <= 0) break;
    for (auto* header = reinterpret_cast<nlmsghdr*>(buffer.data()); NLMSG_OK(header, static_cast<unsigned>(bytes));
         header = NLMSG_NEXT(header, bytes)) {
      if (header->nlmsg_type == RTM_NEWLINK) on_link(decode_link(header));
      if (header->nlmsg_type == NLMSG_DONE || header->nlmsg_type == NLMSG_ERROR || name != nullptr) more = false;
    }
  }
  ::close(fd);
  return asked;
}

}  // namespace

CanSystem& CanSystem::real() noexcept {
  static CanSystem system;
  return system;
}

CanSystem::Interface CanSystem::interface(const std::string& name) {
  Interface found;
  if (name.empty() || name.size() >= IFNAMSIZ) return found;
  query_links(&name, [&](const NamedInterface& link) {
    if (link.name == name) found = link.interface;
  });
  return found;
}

std::string CanSystem::can_interfaces() {
  std::string names;
  query_links(nullptr, [&](const NamedInterface& link) {
    if (link.interface.hardware_type == ARPHRD_CAN) names += (names.empty() ? "" : ", ") + link.name;
  });
  return names;
}

int CanSystem::open_raw_can() noexcept { return ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW); }

int CanSystem::bind_can(int fd, unsigned interface_index) noexcept {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(interface_index);
  return ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

int CanSystem::close(int fd) noexcept { return ::close(fd); }

int CanSystem::set_option(int fd, int level, int option, const void* value, unsigned size) noexcept {
  return ::setsockopt(fd, level, option, value, size);
}

int CanSystem::send_many(int fd, mmsghdr* messages, unsigned count) noexcept {
  return ::sendmmsg(fd, messages, count, MSG_DONTWAIT);
}

int CanSystem::receive_many(int fd, mmsghdr* messages, unsigned count) noexcept {
  return ::recvmmsg(fd, messages, count, MSG_DONTWAIT, nullptr);
}

int CanSystem::poll(pollfd* fds, std::size_t count, std::int64_t timeout_ns) noexcept {
  const timespec timeout = to_timespec(timeout_ns > 0 ? timeout_ns : 0);
  return ::ppoll(fds, count, &timeout, nullptr);
}

std::int64_t CanSystem::clock_ns(clockid_t clock) noexcept {
  timespec now{};
  ::clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * ns_per_s + now.tv_nsec;
}

void CanSystem::sleep_until(std::int64_t monotonic_ns) noexcept {
  const timespec when = to_timespec(monotonic_ns > 0 ? monotonic_ns : 0);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

}  // namespace proxarm::fieldbus
