#include "models/base/network_address.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>

namespace proxarm::description {

bool is_loopback(const std::string& host) noexcept {
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == 127;
}

}  // namespace proxarm::description
