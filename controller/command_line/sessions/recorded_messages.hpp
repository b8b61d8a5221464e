// Writes session.mcap into a record's folder: the messages of all cycles, with the stage on which they are shown.
#pragma once

#include <filesystem>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/view/messages/mcap_record.hpp"
#include "controller/view/stage/stage.hpp"

namespace proxarm::command_line {

class RecordedMessages {
 public:
  // Creates the file. Throws SetupError.
  RecordedMessages(const std::filesystem::path& folder, const PreparedSession& session);
  // Writes a cycle. `completed` is a record that SessionOutput::add() has returned.
  void add(const controller::CycleRecord& completed) { record_.add(completed); }
  void drain(const controller::BoxReader& box) { record_.drain(box); }
  void finish() { record_.finish(); }

 private:
  view::Stage stage_;
  view::McapRecord record_;
};

}  // namespace proxarm::command_line
