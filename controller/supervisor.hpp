// Which phase a session is in, and what moves it on: one table.
//
//   idle ──begin──▶ enabling ──enabled──▶ taring ──tared──▶ rendering ──stop──▶ stopping ──at_rest──▶ disabling
//   ──disabled──▶ done
//                      │                     │                  │                    ▲                    ▲
//                      └────────fault────────┴──────────────────┴────────────────────┘                    │
//                     (nothing moves yet before rendering: a fault there goes straight to disabling) ─────┘
//
// A fault is latched: the first one is kept and reported, and no event leads back to rendering.
#pragma once

#include <cstdint>

#include "controller/fault.hpp"
#include "fieldbus/state_archive.hpp"

namespace proxarm::controller {

enum class Phase : std::uint8_t {
  idle,       // drives configured, nothing sent but SYNC and heartbeat
  enabling,   // the CiA 402 state machines are led to operation enabled; targets follow the actual positions
  taring,     // targets stand still; the sensor's bias is averaged
  rendering,  // the proxy moves, the arm follows
  stopping,   // every joint decelerates at its own limit along its last direction
  disabling,  // targets stand still; the drives are led to switched off
  done,
};

enum class Event : std::uint8_t { begin, enabled, tared, stop, at_rest, disabled, fault };

const char* phase_name(Phase phase) noexcept;

class Supervisor {
 public:
  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  [[nodiscard]] bool faulted() const noexcept { return report_.fault != Fault::none; }
  [[nodiscard]] const FaultReport& report() const noexcept { return report_; }

  // Moves on where the table has a row for it; any other event is ignored in this phase.
  void handle(Event event) noexcept;
  // Latches the first fault and handles Event::fault.
  void raise(const FaultReport& report) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    state(phase_, report_.fault, report_.where, report_.cycle, report_.value, report_.limit);
  }

 private:
  Phase phase_ = Phase::idle;
  FaultReport report_;
};

}  // namespace proxarm::controller
