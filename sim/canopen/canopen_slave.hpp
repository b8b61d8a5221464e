// A simulated CANopen device (CiA 301): NMT state machine, SDO server, PDOs, SYNC, EMCY, and heartbeat as producer and
// consumer.
//
// A CanopenApplication, such as a drive, adds the device's function. The code was written from the standard and shares
// no code with the master in fieldbus, so each side tests the other.
//
// Frames (identifier: data):
//   000: command, node            NMT: 01 start, 02 stop, 80 pre-operational, 81 reset node, 82 reset communication
//   080: (empty)                  SYNC (its identifier is set in 1005h)
//   080 + node: code u16, error register u8, 5 bytes that the maker defines   EMCY
//   580 + node                    SDO answers
//   600 + node                    SDO requests
//   700 + node, remote request    node guarding; while 1017h is 0, the answer is the state with a toggling bit 7
//   700 + node: state             boot-up 00; heartbeat 04 stopped, 05 operational, 7F pre-operational
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/bus/device_port.hpp"
#include "sim/canopen/object_dictionary.hpp"
#include "sim/canopen/sdo_server.hpp"
#include "sim/canopen/slave_pdo.hpp"
#include "sim/canopen/slave_quirks.hpp"
#include "sim/canopen/stack_behaviour.hpp"

namespace proxarm::sim {

enum class NmtState : std::uint8_t { initialising = 0x00, stopped = 0x04, operational = 0x05, pre_operational = 0x7F };

// EMCY error codes that are used here (CiA 301, table 26; CiA 402-2 for drives).
namespace emcy {
constexpr std::uint16_t no_error = 0x0000;
constexpr std::uint16_t communication = 0x8100;
constexpr std::uint16_t heartbeat_lost = 0x8130;
constexpr std::uint16_t pdo_too_short = 0x8210;
constexpr std::uint16_t pdo_too_long = 0x8220;
constexpr std::uint16_t sync_length = 0x8240;
constexpr std::uint16_t rpdo_timeout = 0x8250;
constexpr std::uint16_t following_error = 0x8611;
constexpr std::uint16_t sync_controller = 0x8700;
}  // namespace emcy

// Bits of the error register, 1001h.
namespace error_register {
constexpr std::uint8_t generic = 0x01;
constexpr std::uint8_t communication = 0x10;
constexpr std::uint8_t profile_specific = 0x20;
}  // namespace error_register

// The function of a device. CanopenSlave calls it.
class CanopenApplication {
 public:
  virtual ~CanopenApplication() = default;

  // Is called at SYNC, after synchronous receive PDOs were written to the dictionary and before transmit PDOs are read
  // from it.
  virtual void on_sync(std::int64_t time_ns) = 0;
  // Is called when the NMT state has changed, by a command, a reset or the reaction to an error.
  virtual void on_nmt_state(NmtState from, NmtState to, std::int64_t time_ns) = 0;
  // Is called when a heartbeat is lost (8130h) or a receive PDO is overdue (8250h): after the EMCY, and before the
  // reaction that 1029h requires.
  virtual void on_communication_lost(std::uint16_t code, std::int64_t time_ns) = 0;
  // Is called when the whole device was reset (not only its communication). The dictionary then has its default values.
  virtual void on_reset(std::int64_t time_ns) = 0;
};

struct CanopenSlaveConfig {
  std::uint8_t node = 1;
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0, product = 0, revision = 0, serial = 0;  // 1018h
  std::string device_name;
  StackBehaviour stack = StackBehaviour::strict;
  bool fd = false;                            // the device's PDOs are CAN FD frames at the data bitrate
  std::int64_t boot_time_ns = 20'000'000;     // time from power on or reset to the boot-up frame
  std::int64_t sdo_answer_time_ns = 100'000;  // time from a request to its answer
  std::int64_t pdo_answer_time_ns = 20'000;   // time from SYNC until the transmit PDO is ready
};

class CanopenSlave final : public BusDevice {
 public:
  CanopenSlave(const CanopenSlaveConfig& config, CanopenApplication& application, DevicePort& port);

  void power_on(std::int64_t time_ns) noexcept override;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept override;
  void on_time(std::int64_t time_ns) noexcept override;

  [[nodiscard]] ObjectDictionary& dictionary() noexcept { return dictionary_; }
  [[nodiscard]] const ObjectDictionary& dictionary() const noexcept { return dictionary_; }
  [[nodiscard]] SlavePdo& receive_pdo(int number) { return receive_.at(number - 1)->pdo; }
  [[nodiscard]] SlavePdo& transmit_pdo(int number) { return transmit_.at(number - 1)->pdo; }
  [[nodiscard]] NmtState state() const noexcept { return state_; }
  [[nodiscard]] const CanopenSlaveConfig& config() const noexcept { return config_; }

  // raise_error() notes an error: if the error is new, it is sent as EMCY, stored in 1003h and shown in 1001h; if it is
  // already present, the call does nothing. clear_error() notes the end of an error; when the last error has ended,
  // EMCY 0000h is sent.
  void raise_error(std::uint16_t code, std::uint8_t register_bits, std::int64_t time_ns) noexcept;
  void clear_error(std::uint16_t code, std::int64_t time_ns) noexcept;
  [[nodiscard]] bool has_error(std::uint16_t code) const noexcept;
  // Handles a fault reset: clears the communication errors that a latching stack has kept, except those whose cause
  // persists.
  void acknowledge(std::int64_t time_ns) noexcept;

  [[nodiscard]] SlaveQuirks& quirks() noexcept { return quirks_; }
  // say_boot_up() sends a boot-up frame without a reset. say_warning() sends an EMCY without effect (error register 0).
  void say_boot_up(std::int64_t time_ns) noexcept { send_state(NmtState::initialising, time_ns); }
  void say_warning(std::uint16_t code, std::int64_t time_ns) noexcept;

 private:
  static constexpr int pdos = 4;
  static constexpr int consumers = 4;
  static constexpr std::int64_t never = INT64_MIN;

  struct Receive {
    Receive(ObjectDictionary& dictionary, int number, std::uint8_t node, bool fd)
        : pdo(dictionary, SlavePdo::Direction::receive, number, node, number == 1, fd) {}
    SlavePdo pdo;
    std::array<std::uint8_t, 64> data{};  // data that wait for SYNC
    bool waiting = false;
    std::int64_t last_ns = never;  // the event timer watches from the first received PDO on
    bool overdue = false;
  };
  struct Transmit {
    Transmit(ObjectDictionary& dictionary, int number, std::uint8_t node, bool fd)
        : pdo(dictionary, SlavePdo::Direction::transmit, number, node, number == 1, fd) {}
    SlavePdo pdo;
    std::array<std::uint8_t, 64> last{};
    std::int64_t last_ns = never;
    int syncs = 0;  // number of SYNCs since the last transmission
  };
  struct Consumer {
    std::uint8_t node = 0;
    std::int64_t limit_ns = 0;
    std::int64_t last_ns = never;  // the heartbeat is watched from the first one on
    bool lost = false;
  };
  struct Error {
    std::uint16_t code = 0;
    std::uint8_t register_bits = 0;
  };

  void add_communication_objects();
  void enter(NmtState to, std::int64_t time_ns);
  void start_over(bool whole_device, std::int64_t time_ns);
  void on_nmt_command(const fieldbus::CanFrame& frame, std::int64_t time_ns);
  void on_sync(const fieldbus::CanFrame& frame, std::int64_t time_ns);
  void on_sdo(const fieldbus::CanFrame& frame, std::int64_t time_ns);
  // True if the device receives a PDO with this identifier.
  [[nodiscard]] bool is_pdo(std::uint32_t id) const noexcept;
  void on_receive_pdo(Receive& receive, const fieldbus::CanFrame& frame, std::int64_t time_ns);
  void on_heartbeat(std::uint8_t node, const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept;
  void check_heartbeats(std::int64_t time_ns);
  void on_guard_request(std::int64_t time_ns) noexcept;
  void check_life_guarding(std::int64_t time_ns);
  void check_receive_pdos(std::int64_t time_ns, bool synchronous, bool others);
  void check_sync(std::int64_t time_ns);
  [[nodiscard]] bool latches() const noexcept { return config_.stack == StackBehaviour::latching; }
  [[nodiscard]] bool refuses_start() const noexcept;
  [[nodiscard]] bool insists() const noexcept { return config_.stack == StackBehaviour::insisting; }
  // True if no watched heartbeat is lost.
  [[nodiscard]] bool hears_all() const noexcept;
  void transmit_events(std::int64_t time_ns) noexcept;
  void transmit_on_sync(std::int64_t time_ns) noexcept;
  void transmit(Transmit& transmit, const std::array<std::uint8_t, 64>& data, std::int64_t time_ns) noexcept;
  void configure_consumers() noexcept;
  [[nodiscard]] SdoAbort check_consumer(std::uint8_t subindex, std::int64_t value) const noexcept;
  void error_behaviour(std::int64_t time_ns);
  void send_emergency(std::uint16_t code, std::int64_t time_ns) noexcept;
  void answer_sdo(SdoServer::Message message, std::int64_t time_ns) noexcept;
  void send_state(NmtState state, std::int64_t time_ns) noexcept;
  [[nodiscard]] bool talks() const noexcept {
    return state_ == NmtState::pre_operational || state_ == NmtState::operational;
  }

  CanopenSlaveConfig config_;
  CanopenApplication& application_;
  DevicePort& port_;
  ObjectDictionary dictionary_;
  SdoServer sdo_{dictionary_};
  ObjectEntry *sync_id_ = nullptr, *sync_window_ = nullptr;  // 1005h, 1007h
  std::vector<std::unique_ptr<Receive>> receive_;
  std::vector<std::unique_ptr<Transmit>> transmit_;
  std::array<Consumer, consumers> consumers_{};
  std::vector<Error> errors_;

  NmtState state_ = NmtState::initialising;
  std::int64_t boot_ns_ = never;   // end of the state initialising
  std::int64_t heartbeat_ns_ = 0;  // time of the next heartbeat
  std::int64_t heartbeat_period_ns_ = 0;
  std::int64_t last_sync_ns_ = never;
  std::int64_t last_sdo_ns_ = 0;
  std::int64_t last_guard_ns_ = never;  // node guarding is watched from the first request on
  bool life_lost_ = false;
  SlaveQuirks quirks_;
  std::uint32_t syncs_ = 0;  // number of SYNCs since power on
  // Toggle bit of the next answer to node guarding or, with toggles_heartbeat, of the next heartbeat.
  bool toggle_ = false;
};

}  // namespace proxarm::sim
