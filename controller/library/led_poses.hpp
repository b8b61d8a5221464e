// Judges whether the loop is stable in the poses that a session is led through; at the start only the start pose was
// judged. Works on the session's records, in a separate thread (pose_watch.hpp). Precondition: admittance type.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/library/pose_watch.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/signals/derived_signals.hpp"

namespace proxarm::controller {

class LedPoses {
 public:
  // Precondition: all arguments outlive this object.
  LedPoses(const PreparedSession& session, const RunOptions& options, const SignalDeriver& deriver);

  // Takes every record, in order.
  void add(const CycleRecord& record);
  // Whether most samples of the last quarter of a second were late: the loop is judged with their age then.
  [[nodiscard]] bool samples_late() const noexcept { return samples_late_; }

  [[nodiscard]] std::vector<UnstablePlaces> news() { return watch_.news(); }
  [[nodiscard]] std::vector<PassedPoses::Place> places() { return watch_.places(); }
  [[nodiscard]] PosesSummary summary() { return watch_.summary(); }

 private:
  void follow_timestep(const CycleRecord& record);
  void follow_lateness(const CycleRecord& record);
  void pass(const CycleRecord& record);
  [[nodiscard]] LoopModel judged_loop() const;

  const PreparedSession& session_;
  const RunOptions& options_;
  const SignalDeriver& deriver_;
  PoseWatch watch_;
  LoopModel loop_;  // of the present timestep, with samples in time
  std::int64_t period_ns_ = 0;
  double late_share_ = 0.0;  // recent share of late samples
  bool samples_late_ = false;
  double user_damping_Ns_per_m_ = 0.0;  // without the damping that passivity adds
};

}  // namespace proxarm::controller
