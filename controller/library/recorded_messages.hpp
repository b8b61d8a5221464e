// Writes session.mcap into a record's folder: the messages of all cycles, with the stage on which they are shown.
#pragma once

#include <filesystem>

#include "controller/messages/mcap_record.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/stage/stage.hpp"

namespace proxarm::controller {

class RecordedMessages {
 public:
  // Creates the file. Throws SetupError.
  RecordedMessages(const std::filesystem::path& folder, const PreparedSession& session);
  // Writes a cycle. Precondition: the record is complete, as SessionOutput::add() returns it.
  void add(const CycleRecord& completed) { record_.add(completed); }
  void drain(const BoxReader& box) { record_.drain(box); }
  void finish() { record_.finish(); }

 private:
  view::Stage stage_;
  view::McapRecord record_;
};

}  // namespace proxarm::controller
