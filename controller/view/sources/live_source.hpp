// A session that runs, read from the memory of its black box while its cycle writes: the cycle does nothing for it.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/view/stage/present_settings.hpp"
#include "controller/view/stage/stage.hpp"

namespace proxarm::view {

class LiveSource {
 public:
  // `stage` must outlive it. Throws std::runtime_error for a descriptor of something else.
  LiveSource(int descriptor, Stage& stage);

  // Takes all cycles that have come since the last call. False: there was none.
  bool advance();
  // What the last ones were like. Precondition: advance() was true since the last call.
  Moment take();
  // The wire's message of this moment.
  [[nodiscard]] std::string encode(const Moment& moment);

  // What the session is set to, after all cycles that were taken; true once since it was asked last: it has changed.
  [[nodiscard]] const PresentSettings& settings() const noexcept { return settings_; }
  bool have_settings_changed() noexcept { return std::exchange(settings_changed_, false); }

  // Fields of the last 20 s of moments, one after the other, for those who come later.
  [[nodiscard]] const std::vector<double>& history() const noexcept { return history_; }

 private:
  void remember(const Moment& moment);

  controller::MappedBox box_;
  Stage& stage_;
  MomentBuilder builder_;
  PresentSettings settings_;
  bool settings_changed_ = false;
  std::uint64_t next_ = 0;
  controller::BoxCycle cycle_;
  std::vector<models::Pose> links_, objects_;
  std::vector<double> history_;
};

}  // namespace proxarm::view
