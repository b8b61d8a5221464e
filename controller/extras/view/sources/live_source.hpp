// Reads a running session from the shared memory of the session's black box, while the cycle writes there. The cycle
// isn't involved.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/signals/handle_spectrum.hpp"
#include "controller/stage/present_settings.hpp"
#include "controller/stage/stage.hpp"

namespace proxarm::view {

class LiveSource {
 public:
  // Precondition: `stage` outlives this object. Throws std::runtime_error if the descriptor isn't of a black box.
  LiveSource(int descriptor, Stage& stage);

  // Reads all cycles since the last call; in simulation, only cycles whose true pose is written. Returns false if there
  // was no such cycle.
  bool advance();
  // Returns the moment of the cycles that were read. Precondition: advance() has returned true since the last take().
  Moment take();
  [[nodiscard]] std::string encode(const Moment& moment);

  // Returns the session's settings after all cycles that were read.
  [[nodiscard]] const PresentSettings& settings() const noexcept { return settings_; }
  // Returns true once after each change of the settings.
  bool have_settings_changed() noexcept { return std::exchange(settings_changed_, false); }

  // Returns the handle's vibration in the last second; empty before a second is complete. In simulation it is that of
  // the true tool.
  [[nodiscard]] std::vector<controller::HandleSpectrum::Band> spectrum() const { return spectrum_.bands(); }

  // Returns the fields of the moments of the last 20 s, one moment after the other, for pages that connect later.
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
  controller::HandleSpectrum spectrum_;
  std::vector<models::Pose> links_, objects_;
  std::optional<Room> room_;
  double next_room_s_ = 0.0;  // when room_ is computed again
  std::vector<double> history_;
};

}  // namespace proxarm::view
