// Judges addresses of the network.
#pragma once

#include <string>

namespace proxarm::description {

// Whether a numeric IPv4 address is one of this machine's own loopback addresses, 127.x.x.x.
[[nodiscard]] bool is_loopback(const std::string& host) noexcept;

}  // namespace proxarm::description
