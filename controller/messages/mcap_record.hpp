// Writes session.mcap of a record: forces and joints in every cycle, contacts in cycles that have any, poses and
// transforms in every tenth cycle, and the scene when something moves. The file is written during the session, outside
// the cycle.
#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <vector>

#include "controller/messages/mcap_writer.hpp"
#include "controller/messages/session_messages.hpp"

namespace proxarm::view {

class McapRecord {
 public:
  // Precondition: `stage` outlives this object. Throws SetupError.
  McapRecord(const std::filesystem::path& file, Stage& stage);

  // Adds a completed cycle: with its distances, and in simulation with the true state, as in the record's signals.
  void add(const controller::CycleRecord& completed) { waiting_.push_back(completed); }
  // Writes the cycles that were added since the last call, and takes the changes of these cycles from the box. Cycles
  // that the box has lost are left out.
  void drain(const controller::BoxReader& box);
  void finish();  // throws SetupError if the file couldn't be written completely

 private:
  void write(const controller::BoxCycle& cycle);
  void write(Topic topic, const Moment& moment);
  void write_contacts(Topic topic, const Moment& moment, bool& told);

  Stage& stage_;
  SessionMessages messages_;
  McapWriter writer_;
  std::array<std::uint16_t, topic_count> channels_{};
  MomentBuilder builder_;
  std::vector<models::Pose> links_, objects_, drawn_;
  std::deque<controller::CycleRecord> waiting_;  // cycles that wait until the box has them completely
  std::uint64_t cycles_ = 0;
  bool told_contacts_ = false, told_arrows_ = false;  // whether the last message listed contacts
  controller::BoxCycle cycle_;
};

}  // namespace proxarm::view
