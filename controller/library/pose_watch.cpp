#include "controller/library/pose_watch.hpp"

#include <utility>

namespace proxarm::controller {

PoseWatch::~PoseWatch() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void PoseWatch::ask(PassedPoses::Asked asked) {
  {
    const std::lock_guard lock(mutex_);
    asked_.push_back(std::move(asked));
  }
  changed_.notify_all();
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
}

void PoseWatch::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ends_ || !asked_.empty(); });
    if (ends_) return;
    const PassedPoses::Asked asked = std::move(asked_.front());
    asked_.pop_front();
    busy_ = true;
    const std::size_t found_before = poses_.places().size();
    lock.unlock();
    const std::optional<UnstablePlaces> told = poses_.judge(asked);
    lock.lock();
    busy_ = false;
    if (told) news_.push_back(*told);
    if (poses_.places().size() > found_before) found_.push_back(poses_.places().back());
    changed_.notify_all();
  }
}

std::vector<UnstablePlaces> PoseWatch::news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

std::vector<PassedPoses::Place> PoseWatch::places() {
  const std::lock_guard lock(mutex_);
  return std::exchange(found_, {});
}

PosesSummary PoseWatch::summary() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return asked_.empty() && !busy_; });
  return {.judged = poses_.judged(), .unstable = poses_.unstable(), .places = poses_.places()};
}

}  // namespace proxarm::controller
