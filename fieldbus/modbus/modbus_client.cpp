#include "fieldbus/modbus/modbus_client.hpp"

#include <modbus/modbus.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "models/base/network_address.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::ModbusLineDescription;
using description::SetupError;

struct Free {
  void operator()(modbus_t* context) const noexcept {
    modbus_close(context);
    modbus_free(context);
  }
};
using Context = std::unique_ptr<modbus_t, Free>;

class LibmodbusClient final : public ModbusClient {
 public:
  LibmodbusClient(Context context, const ModbusLineDescription& line, double response_timeout_s)
      : context_(std::move(context)),
        serial_(line.serial()),
        echo_(line.echo),
        timeout_ms_(std::max(1, static_cast<int>(std::ceil(1e3 * response_timeout_s)))) {}

 private:
  ModbusResult transact(const ModbusMessage& request, ModbusMessage& answer) noexcept override {
    if (!connected_ && !reconnect()) return ModbusResult::closed;
    if (serial_) modbus_flush(context_.get());  // drops a late answer to an earlier request
    modbus_set_slave(context_.get(), request.bytes[0]);
    if (modbus_send_raw_request(context_.get(), request.bytes.data(), static_cast<int>(request.size)) < 0) {
      return give_up();
    }
    if (echo_ && !swallow_echo(request)) return give_up();
    std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> bytes{};
    const int received = modbus_receive_confirmation(context_.get(), bytes.data());
    if (received < 0) return give_up();
    // In RTU mode, libmodbus returns 0 if another unit answered.
    if (received == 0) return give_up(ModbusResult::wrong_unit);
    const int first = modbus_get_header_length(context_.get()) - 1, last = received - (serial_ ? 2 : 0);
    if (last - first < 1 || last - first > static_cast<int>(modbus_most_bytes)) {
      return give_up(ModbusResult::malformed);
    }
    answer.size = static_cast<std::size_t>(last - first);
    std::copy(bytes.begin() + first, bytes.begin() + last, answer.bytes.begin());
    return ModbusResult::ok;
  }

  // Reads back the request and its checksum, which the adapter echoes before the answer. If a byte differs from the one
  // sent, there was a collision on the line.
  bool swallow_echo(const ModbusMessage& request) noexcept {
    constexpr std::size_t checksum_bytes = 2;
    for (std::size_t i = 0; i < request.size + checksum_bytes; ++i) {
      pollfd waiting{.fd = modbus_get_socket(context_.get()), .events = POLLIN, .revents = 0};
      std::uint8_t byte = 0;
      const bool came = poll(&waiting, 1, timeout_ms_) > 0 && ::read(waiting.fd, &byte, 1) == 1;
      if (came && (i >= request.size || byte == request.bytes[i])) continue;
      errno = came ? EMBBADDATA : ETIMEDOUT;
      return false;
    }
    return true;
  }

  ModbusResult give_up() noexcept {
    const int error = errno;
    if (error == ETIMEDOUT || error == EAGAIN) return give_up(ModbusResult::timeout);
    if (error == EMBBADSLAVE) return give_up(ModbusResult::wrong_unit);
    if (error >= MODBUS_ENOBASE) return give_up(ModbusResult::malformed);
    return give_up(ModbusResult::closed);
  }

  // Discards late bytes and the rest of a bad answer, so that they aren't taken for the next answer. Returns `result`.
  ModbusResult give_up(ModbusResult result) noexcept {
    if (serial_) {
      modbus_flush(context_.get());
    } else {
      modbus_close(context_.get());
      connected_ = false;
    }
    return result;
  }

  bool reconnect() noexcept {
    connected_ = modbus_connect(context_.get()) == 0;
    return connected_;
  }

  Context context_;
  bool serial_, echo_;
  int timeout_ms_;
  bool connected_ = true;
};

void set_timeouts(modbus_t& context, double timeout_s) {
  const auto us = static_cast<std::uint32_t>(std::lround(1e6 * timeout_s));
  modbus_set_response_timeout(&context, us / 1'000'000, us % 1'000'000);
  modbus_set_byte_timeout(&context, us / 1'000'000, us % 1'000'000);
}

void require_on_this_machine(const ModbusLineDescription& line) {
  if (is_on_this_machine(line)) return;
  throw SetupError({.bus = line.name,
                    .message = "this Modbus peer isn't a process of this machine: a real axis would move",
                    .found = line.serial() ? line.device : line.host,
                    .expected = line.serial() ? "a pseudo-terminal, /dev/pts/N" : "a loopback address, 127.x.x.x"});
}

}  // namespace

ModbusResult ModbusClient::exchange(const ModbusMessage& request, std::span<std::uint16_t> values) noexcept {
  ModbusMessage answer;
  const ModbusResult result = transact(request, answer);
  if (result != ModbusResult::ok) return result;
  int code = 0;
  const ModbusResult decoded = decode_answer(request.span(), answer.span(), values, code);
  if (decoded == ModbusResult::exception) exception_ = code;
  return decoded;
}

ModbusResult ModbusClient::read(std::uint8_t unit, std::uint16_t at, std::span<std::uint16_t> values) noexcept {
  return exchange(encode_read(unit, at, values.size()), values);
}

ModbusResult ModbusClient::write(std::uint8_t unit, std::uint16_t at, std::span<const std::uint16_t> values) noexcept {
  return exchange(encode_write(unit, at, values), {});
}

ModbusResult ModbusClient::read_write(std::uint8_t unit, std::uint16_t read_at, std::span<std::uint16_t> read_values,
                                      std::uint16_t at, std::span<const std::uint16_t> values) noexcept {
  return exchange(encode_read_write(unit, read_at, read_values.size(), at, values), read_values);
}

bool is_on_this_machine(const ModbusLineDescription& line) {
  if (!line.serial()) return description::is_loopback(line.host);
  std::error_code error;
  const std::filesystem::path device = std::filesystem::weakly_canonical(line.device, error);
  return !error && device.string().rfind("/dev/pts/", 0) == 0;
}

std::string peer_text(const ModbusLineDescription& line) {
  return line.serial() ? line.device : line.host + ", port " + std::to_string(line.port);
}

std::unique_ptr<ModbusClient> open_modbus(const ModbusLineDescription& line, double response_timeout_s,
                                          ModbusPeers peers) {
  if (peers == ModbusPeers::on_this_machine) require_on_this_machine(line);
  const char parity = line.parity == "none" ? 'N' : line.parity == "odd" ? 'O' : 'E';
  Context context(line.serial() ? modbus_new_rtu(line.device.c_str(), line.baud, parity, 8, line.stop_bits)
                                : modbus_new_tcp(line.host.c_str(), line.port));
  const auto fail = [&](int error) {
    return SetupError({.bus = line.name,
                       .message = "the Modbus line can't be opened",
                       .found = peer_text(line) + ": " + std::strerror(error),
                       .advice = "is the drive on, and its address in the cell file the drive's?"});
  };
  if (!context) throw fail(errno);
  set_timeouts(*context, std::max(response_timeout_s, 0.2));  // the longer timeout is for connecting
  if (modbus_connect(context.get()) != 0) throw fail(errno);
  set_timeouts(*context, response_timeout_s);
  return std::make_unique<LibmodbusClient>(std::move(context), line, response_timeout_s);
}

}  // namespace proxarm::fieldbus
