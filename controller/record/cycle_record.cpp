#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

const char* contact_phase_name(ContactPhase phase) noexcept {
  switch (phase) {
    case ContactPhase::free:
      return "free";
    case ContactPhase::stick:
      return "stick";
    case ContactPhase::slip:
      return "slip";
  }
  return "?";
}

}  // namespace proxarm::controller
