// Judges the stability of passed poses (PassedPoses) in a separate thread, so that the thread that drains a session's
// records doesn't wait for the results. With --pace realtime the draining thread also runs the simulation. The judging
// thread starts when the first place is to be judged.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "controller/report/summary.hpp"
#include "controller/stability/passed_poses.hpp"

namespace proxarm::controller {

class PoseWatch {
 public:
  explicit PoseWatch(PassedPoses poses) : poses_(std::move(poses)) {}
  PoseWatch(const PoseWatch&) = delete;
  PoseWatch& operator=(const PoseWatch&) = delete;
  ~PoseWatch();  // drops the places that aren't judged yet

  // Also searches the smallest stable mass at each place from now on. Call this function before the first pass().
  void find_smallest() { poses_.find_smallest(); }
  void change(const LoopModel& loop) { poses_.change(loop); }
  template <class Joints>
  void pass(double time_s, const models::ToolPose& tool_W, const PassedPoses::Felt& felt, const Joints& joints_rad) {
    if (auto asked = poses_.come_to(time_s, tool_W, felt, joints_rad)) ask(std::move(*asked));
  }
  // Returns the unstable places to report that this function hasn't returned before, in the order in which they were
  // judged.
  [[nodiscard]] std::vector<UnstablePlaces> news();
  // Returns the places judged since the last call. Returns none unless find_smallest() was called.
  [[nodiscard]] std::vector<PassedPoses::Place> places();
  // Waits until all places are judged.
  [[nodiscard]] PosesSummary summary();

 private:
  void ask(PassedPoses::Asked asked);
  void work();

  PassedPoses poses_;
  std::mutex mutex_;  // guards the members below
  std::condition_variable changed_;
  std::deque<PassedPoses::Asked> asked_;
  std::vector<UnstablePlaces> news_;
  std::vector<PassedPoses::Place> found_;  // places that places() hasn't returned yet
  bool busy_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace proxarm::controller
