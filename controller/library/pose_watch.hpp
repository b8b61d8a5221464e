// PassedPoses in a thread of its own: whoever drains a session's records doesn't wait for it, which with --pace
// realtime is the simulation itself. The thread begins with the first place.
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
  ~PoseWatch();  // what isn't judged by then isn't

  // Before the first place.
  void find_smallest() { poses_.find_smallest(); }
  void change(const LoopModel& loop) { poses_.change(loop); }
  template <class Joints>
  void pass(double time_s, const models::ToolPose& tool_W, const PassedPoses::Felt& felt, const Joints& joints_rad) {
    if (auto asked = poses_.come_to(time_s, tool_W, felt, joints_rad)) ask(std::move(*asked));
  }
  // What should be told by now and wasn't yet, in its order.
  [[nodiscard]] std::vector<UnstablePlaces> news();
  // Places judged since it was asked last, where the smallest stable mass is looked for.
  [[nodiscard]] std::vector<PassedPoses::Place> places();
  // Waits until all is judged.
  [[nodiscard]] PosesSummary summary();

 private:
  void ask(PassedPoses::Asked asked);
  void work();

  PassedPoses poses_;
  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<PassedPoses::Asked> asked_;
  std::vector<UnstablePlaces> news_;
  std::vector<PassedPoses::Place> found_;  // and not told yet
  bool busy_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace proxarm::controller
