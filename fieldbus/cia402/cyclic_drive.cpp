#include "fieldbus/cia402/cyclic_drive.hpp"

namespace proxarm::fieldbus {

const char* to_string(DriveFault fault) noexcept {
  switch (fault) {
    case DriveFault::none:
      return "no fault";
    case DriveFault::state_fault:
      return "the drive reports a fault";
    case DriveFault::left_operation:
      return "the drive left operation enabled by itself";
    case DriveFault::emergency:
      return "the drive sent an emergency message";
    case DriveFault::heartbeat_lost:
      return "the drive's heartbeat is lost";
    case DriveFault::restarted:
      return "the drive was restarted and has lost its configuration";
    case DriveFault::not_operational:
      return "the drive was taken out of operational by another NMT command or by its own error behaviour";
    case DriveFault::pdo_short:
      return "the drive sent a TPDO shorter than its mapping";
    case DriveFault::not_remote:
      return "the drive is under local control";
    case DriveFault::mode_changed:
      return "the drive changed its mode of operation by itself (6061h)";
    case DriveFault::two_nodes:
      return "two drives answer with this node number: two TPDOs came at each SYNC";
    case DriveFault::target_out_of_range:
      return "a target did not fit the drive's 32-bit counts";
    case DriveFault::modbus_timeout:
      return "the drive gave no complete Modbus answer in time";
    case DriveFault::modbus_exception:
      return "the drive refused a Modbus request with an exception";
    case DriveFault::modbus_closed:
      return "the Modbus connection was closed";
    case DriveFault::modbus_wrong_unit:
      return "a Modbus answer came from another unit";
    case DriveFault::modbus_malformed:
      return "a Modbus answer did not fit its request (half an answer, another function, or a bad checksum)";
  }
  return "unknown fault";
}

}  // namespace proxarm::fieldbus
