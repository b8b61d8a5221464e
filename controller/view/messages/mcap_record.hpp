// Writes session.mcap of a record: forces, contacts and joints of every cycle, poses and transforms of every tenth, and
// the scene when something in it moves. It is taken from the black box while the session runs, outside of the cycle.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "controller/view/messages/mcap_writer.hpp"
#include "controller/view/messages/session_messages.hpp"

namespace proxarm::view {

class McapRecord {
 public:
  // Precondition: `stage` outlives this object. Throws SetupError.
  McapRecord(const std::filesystem::path& file, Stage& stage);

  // Writes the cycles that have been added since the last call.
  void drain(const controller::BoxReader& box);
  void finish();  // throws SetupError

 private:
  void add(const controller::BoxCycle& cycle);
  void add(Topic topic, const Moment& moment);

  Stage& stage_;
  SessionMessages messages_;
  McapWriter writer_;
  std::array<std::uint16_t, topic_count> channels_{};
  MomentBuilder builder_;
  std::vector<models::Pose> links_, objects_, drawn_;
  std::uint64_t next_ = 0, cycles_ = 0;
  controller::BoxCycle cycle_;
};

}  // namespace proxarm::view
