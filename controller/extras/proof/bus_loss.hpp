// Tests how each drive reacts when the controller dies. While the arm stands with its drives enabled, sending stops,
// and the drives' reactions are observed. The steps are:
//
//   waiting, enabling, taring   as in any session, under the same supervision
//   standing                    for 0.3 s, under the same supervision
//   silent                      for a second: no SYNC, setpoint, heartbeat or SDO; frames are only received. This step
//                               begins right after a heartbeat, which is the worst time
//   farewell                    SYNC, heartbeat and controlwords again, until all drives are off, or for half a second
//
// If a drive switches off, its brake holds the axis, or the axis sinks, as when a controller dies in a session.
// run_cycle() never allocates, locks, throws or prints.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "controller/cycle/bus_image.hpp"
#include "controller/cycle/cycle_recorder.hpp"
#include "controller/cycle/fault_monitor.hpp"
#include "controller/cycle/timestep_change.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "controller/supervision/supervisor.hpp"
#include "fieldbus/cia402/silence_watch.hpp"

namespace proxarm::proof {

// The reaction of one drive on CAN.
struct OwnStop {
  std::string joint;
  double reacts_s = -1.0;  // time since the controller's last frame; negative: the drive didn't react
  double off_s = -1.0;     // when the drive's statusword reported that the drive is off; negative: never
  std::string signs;       // the drive's reactions, in words
  bool off_at_last = false;
};

class BusLossSession {
 public:
  // Precondition: the drives are configured to send the objects that silence_watch.hpp observes.
  BusLossSession(controller::CycleParts parts, const controller::SessionSettings& settings,
                 const description::Cell& cell);
  BusLossSession(const BusLossSession&) = delete;
  BusLossSession& operator=(const BusLossSession&) = delete;

  void run_cycle(std::int64_t t_k_ns) noexcept;
  [[nodiscard]] bool done() const noexcept { return step_ == Step::done; }
  // Whether nothing is being sent. A late cycle then doesn't matter.
  [[nodiscard]] bool silent() const noexcept { return step_ == Step::silent; }
  // Asks each drive by SDO that hasn't reported that it is off. This is needed for drives that send no TPDOs after the
  // silence: their stack holds an error, so they refuse NMT start. Blocks; not for the cycle. Precondition: done().
  void ask_the_others();
  void shut_down() noexcept { bus_.shut_down(controller::ns_of(settings_.period_s)); }
  void request_stop() noexcept { stop_.store(true); }  // any thread
  // Whether the person is asked to release and press the enabling switch.
  [[nodiscard]] bool asks_for_press() const noexcept { return asks_for_press_.load(); }

  // ---- after the last cycle
  // Returns the drives' reactions; empty if the session ended before the silence.
  [[nodiscard]] std::vector<OwnStop> own_stops() const;
  [[nodiscard]] const controller::FaultReport& fault() const noexcept {
    return supervisor_.faulted() ? supervisor_.report() : supervisor_.held_for();
  }

 private:
  enum class Step : std::uint8_t { waiting, enabling, taring, standing, silent, farewell, done };
  class NoListener final : public controller::FrameListener {
   public:
    bool on_frame(std::size_t /*bus*/, const fieldbus::CanFrame& /*frame*/) noexcept override { return false; }
  };

  void heed(std::int64_t t_k_ns) noexcept;
  void act(std::int64_t t_k_ns) noexcept;
  void wait_for_drives(std::int64_t t_k_ns) noexcept;
  void listen(std::int64_t until_ns) noexcept;
  void go_to(Step step, std::int64_t t_k_ns) noexcept;
  void send_nmt(fieldbus::NmtCommand command) noexcept;

  controller::CycleParts parts_;
  controller::SessionSettings settings_;
  std::uint64_t cycle_ = 0;
  controller::Supervisor supervisor_;
  controller::Alarm alarm_;
  controller::CycleRecorder recorder_;
  controller::BusImage bus_;
  controller::Measurement measurement_;
  controller::FaultMonitor faults_;
  NoListener listener_;
  controller::Setpoints setpoints_;
  std::vector<fieldbus::SilenceWatch> watches_;
  std::vector<fieldbus::DriveState> last_states_;  // states of the drives on CAN, set by ask_the_others()
  Step step_ = Step::waiting;
  std::int64_t since_ns_ = 0, last_word_ns_ = -1;
  bool heartbeat_was_last_ = false;  // whether the last cycle sent a heartbeat
  std::int64_t silence_ns_ = -1;     // time of the last cycle before the silence
  std::atomic<bool> stop_{false}, asks_for_press_{false};
};

}  // namespace proxarm::proof
