#include "sim/devices/modbus_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "models/base/network_address.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::sim {
namespace {

using description::ModbusLineDescription;
using Bytes = std::vector<std::uint8_t>;

constexpr int look_up_ms = 20;  // how often the threads check whether they must end
// Length of the header (transaction, protocol, length); unit and PDU follow.
constexpr std::size_t mbap_bytes = 6;

description::SetupError problem(const ModbusLineDescription& line, const std::string& what) {
  return description::SetupError({.bus = line.name, .message = what, .found = std::strerror(errno)});
}

bool readable(int fd) noexcept {
  pollfd waiting{.fd = fd, .events = POLLIN, .revents = 0};
  return poll(&waiting, 1, look_up_ms) > 0;
}

// Returns the CRC-16/MODBUS: x¹⁶ + x¹⁵ + x² + 1, reflected, start value FFFFh. It is sent low byte first.
std::uint16_t crc16(const Bytes& bytes) noexcept {
  boost::crc_optimal<16, 0x8005, 0xFFFF, 0, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

// Returns the number of bytes of a serial request with its checksum; 0 if the bytes received so far don't tell it yet.
std::size_t rtu_request_size(const Bytes& bytes) noexcept {
  if (bytes.size() < 2) return 0;
  if (bytes[1] == 16) return bytes.size() < 7 ? 0 : 9U + bytes[6];
  if (bytes[1] == 23) return bytes.size() < 11 ? 0 : 13U + bytes[10];
  return 8;
}

}  // namespace

ModbusServer::ModbusServer(const ModbusLineDescription& line, std::vector<ModbusUnit*> devices)
    : devices_(std::move(devices)) {
  if (line.serial()) {
    open_terminal(line);
    thread_ = std::thread([this] { serve_terminal(); });
  } else {
    open_tcp(line);
    thread_ = std::thread([this] { serve_tcp(); });
  }
}

ModbusServer::~ModbusServer() {
  stop_.store(true);
  if (thread_.joinable()) thread_.join();
  if (listener_ >= 0) close(listener_);
  if (terminal_fd_ >= 0) close(terminal_fd_);
  std::error_code ignored;
  if (!link_.empty()) std::filesystem::remove(link_, ignored);
}

// ---- TCP ------------------------------------------------------------------------------------------------------------

void ModbusServer::open_tcp(const ModbusLineDescription& line) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(line.port));
  if (inet_pton(AF_INET, line.host.c_str(), &address.sin_addr) != 1 || !description::is_loopback(line.host)) {
    throw description::SetupError(
        {.bus = line.name, .key = "host", .found = line.host, .expected = "a loopback address, 127.x.x.x"});
  }
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  socklen_t size = sizeof address;
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), size) != 0 || listen(listener_, 4) != 0 ||
      getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const auto error = problem(line, "port " + std::to_string(line.port) + " can't be opened");
    close(listener_);
    throw error;
  }
  port_ = ntohs(address.sin_port);
}

void ModbusServer::serve_tcp() noexcept {
  while (!stop_.load()) {
    if (!readable(listener_)) continue;
    const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    while (!stop_.load() && serve_connection(connection)) continue;
    close(connection);
  }
}

// Serves one request. False at the end of the connection.
bool ModbusServer::serve_connection(int connection) noexcept {
  if (!readable(connection)) {
    for (const ModbusUnit* device : devices_) {
      if (device->fault() == ModbusFault::closed) return false;
    }
    return true;
  }
  std::array<std::uint8_t, mbap_bytes> header{};
  if (recv(connection, header.data(), header.size(), MSG_WAITALL) != static_cast<ssize_t>(header.size())) return false;
  Bytes request(static_cast<std::size_t>(header[4] << 8 | header[5]));
  if (request.size() < 2 || request.size() > 254) return false;
  if (recv(connection, request.data(), request.size(), MSG_WAITALL) != static_cast<ssize_t>(request.size()))
    return false;
  for (ModbusUnit* device : devices_) {
    if (device->unit() != request[0]) continue;
    if (device->fault() == ModbusFault::closed) return false;
    const Bytes answer = device->serve(request);
    if (answer.empty()) return true;
    usleep(1000U * static_cast<unsigned>(device->late_ms()));
    Bytes reply(header.begin(), header.end());
    // An answer that is cut in half announces its full length.
    const std::size_t announced = device->fault() == ModbusFault::half ? 2 * answer.size() : answer.size();
    reply[4] = static_cast<std::uint8_t>(announced >> 8);
    reply[5] = static_cast<std::uint8_t>(announced);
    reply.insert(reply.end(), answer.begin(), answer.end());
    return send(connection, reply.data(), reply.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(reply.size());
  }
  return true;
}

// ---- RTU ------------------------------------------------------------------------------------------------------------

void ModbusServer::open_terminal(const ModbusLineDescription& line) {
  terminal_fd_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  std::array<char, 64> name{};
  termios settings{};
  if (terminal_fd_ < 0 || grantpt(terminal_fd_) != 0 || unlockpt(terminal_fd_) != 0 ||
      ptsname_r(terminal_fd_, name.data(), name.size()) != 0 || tcgetattr(terminal_fd_, &settings) != 0) {
    throw problem(line, "no pseudo-terminal can be made");
  }
  cfmakeraw(&settings);
  tcsetattr(terminal_fd_, TCSANOW, &settings);
  terminal_ = name.data();
  if (line.device.empty()) return;
  std::error_code error;
  if (std::filesystem::is_symlink(line.device, error)) std::filesystem::remove(line.device, error);
  std::filesystem::create_symlink(terminal_, line.device, error);
  if (error) {
    errno = error.value();
    throw problem(line, line.device + " can't be made a link to " + terminal_);
  }
  link_ = line.device;
}

void ModbusServer::serve_terminal() noexcept {
  Bytes received;
  while (!stop_.load()) {
    // A pause ends an incomplete request. The bytes after the pause begin another request.
    if (!readable(terminal_fd_)) {
      received.clear();
      continue;
    }
    std::array<std::uint8_t, 256> chunk{};
    const ssize_t count = read(terminal_fd_, chunk.data(), chunk.size());
    if (count <= 0) {  // the master's end isn't open
      usleep(1000 * look_up_ms);
      continue;
    }
    received.insert(received.end(), chunk.begin(), chunk.begin() + count);
    const std::size_t size = rtu_request_size(received);
    if (size == 0 || received.size() < size) continue;
    Bytes request(received.begin(), received.begin() + static_cast<std::ptrdiff_t>(size));
    received.clear();
    if (crc16(request) != 0) continue;  // the CRC over a message with its checksum must be 0
    for (ModbusUnit* device : devices_) {
      if (device->unit() != request[0]) continue;
      if (device->fault() == ModbusFault::echo && write(terminal_fd_, request.data(), size) < 0) break;
      request.resize(size - 2);
      Bytes answer = device->serve(request);
      if (answer.empty()) break;
      usleep(1000U * static_cast<unsigned>(device->late_ms()));
      const std::uint16_t crc = crc16(answer);
      answer.push_back(static_cast<std::uint8_t>(crc));
      answer.push_back(static_cast<std::uint8_t>(crc >> 8));
      if (device->fault() == ModbusFault::half) answer.resize(answer.size() / 2);
      if (write(terminal_fd_, answer.data(), answer.size()) < 0) break;
    }
  }
}

}  // namespace proxarm::sim
