// Runs PassedPoses in a separate thread, so that the thread that drains a session's records doesn't wait; with --pace
// realtime that thread is the simulation. The thread starts with the first place.
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
  ~PoseWatch();  // drops places that aren't judged yet

  // Call it before the first place.
  void find_smallest() { poses_.find_smallest(); }
  void change(const LoopModel& loop) { poses_.change(loop); }
  template <class Joints>
  void pass(double time_s, const models::ToolPose& tool_W, const PassedPoses::Felt& felt, const Joints& joints_rad) {
    if (auto asked = poses_.come_to(time_s, tool_W, felt, joints_rad)) ask(std::move(*asked));
  }
  // Returns the results that are to be reported and weren't yet, in order.
  [[nodiscard]] std::vector<UnstablePlaces> news();
  // Returns the places judged since the last call, if the smallest stable mass is searched.
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
  std::vector<PassedPoses::Place> found_;  // not returned yet
  bool busy_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace proxarm::controller
