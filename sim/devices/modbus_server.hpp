// Serves simulated Modbus devices on a real line: a TCP port of the loopback interface, or a pseudo-terminal for RTU.
// One thread serves one master.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "models/description/cell.hpp"
#include "sim/devices/modbus_device.hpp"

namespace proxarm::sim {

class ModbusServer {
 public:
  // Opens the line and serves it until destruction. For TCP, `line.host` must be a loopback address; port 0 means any
  // free port. For a serial line, creates a pseudo-terminal; if `line.device` isn't empty, it becomes a symbolic link
  // to the pseudo-terminal. Throws SetupError. The devices must outlive the server.
  ModbusServer(const description::ModbusLineDescription& line, std::vector<ModbusUnit*> devices);
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;
  ~ModbusServer();

  // The port of a TCP line.
  [[nodiscard]] int port() const noexcept { return port_; }
  // The master's end of an RTU line, /dev/pts/N.
  [[nodiscard]] const std::string& device() const noexcept { return terminal_; }

 private:
  void open_tcp(const description::ModbusLineDescription& line);
  void open_terminal(const description::ModbusLineDescription& line);
  void serve_tcp() noexcept;
  void serve_terminal() noexcept;
  [[nodiscard]] bool serve_connection(int socket) noexcept;

  std::vector<ModbusUnit*> devices_;
  int listener_ = -1, terminal_fd_ = -1, port_ = 0;
  std::string terminal_, link_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace proxarm::sim
