// Writes a recorded session: a folder with its input, its output and its configuration.
//
//   signals.csv      a row per cycle (signals/signal_columns.hpp). The first row names columns with units and frames;
//                    numbers are the shortest text that reads back to the same double
//   signals.bin      the same in binary, instead of signals.csv (signals/signal_table.hpp)
//   columns.json     unit, frame and meaning of each column
//   contacts.csv     a row for each contact of each cycle (signals/contact_columns.hpp), or contacts.bin instead;
//                    contact_columns.json has the columns' meanings
//   session.mcap     the same session for other tools (messages/mcap_writer.hpp)
//   frames.log       every frame on every bus, in the format of `candump -L`, for canplayer and log2asc; packed:
//                    frames.log.zst
//   effective.yaml   the session's configuration with all defaults (other configuration files under their names)
//   summary.json     the repeatable figures (repeatable_json())
//   replay           what `proxarm replay` needs (replay_log.hpp)
//   timing.json      the wall clock's figures (timing_json()); only here are overruns and compute time
//
// Two runs with the same input give the same bytes in all files but timing.json. Not for the cycle: the cycle leaves
// records in a ring, and its reader calls this class.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/record/cycle_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/signals/signal_columns.hpp"
#include "controller/signals/signal_table.hpp"
#include "controller/signals/signals_form.hpp"
#include "fieldbus/can/can_frame.hpp"

namespace proxarm::controller {

class SessionWriter {
 public:
  // Makes the folder, with parents, or replaces an earlier session in it. Throws description::SetupError with key
  // --record if the folder holds anything else, can't be written, or another session writes to it. The folder is locked
  // (flock) while the writer or a process forked meanwhile lives. `axis_names`: for the drives' columns, at most
  // max_axes. `with_truth`: adds the columns of the simulation's true state.
  SessionWriter(const std::filesystem::path& folder, const std::vector<std::string>& axis_names, bool with_truth,
                SignalsForm form = SignalsForm::csv);

  void add(const CycleRecord& record, const DerivedSignals& derived = {});
  // `time_ns`: of the frame's last bit, ≥ 0, on the network's clock. The records' time differs: bring-up precedes the
  // first cycle.
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);
  // Writes a configuration file's text: effective.yaml, or cell, scene, hand, sensor.yaml and arm.urdf as they were
  // read; reason.txt says why there is a black box.
  void write_file(std::string_view name, std::string_view text);
  // Writes summary.json and timing.json; closes all files. Throws description::SetupError if a file couldn't be written
  // completely, for example on a full disk.
  void finish(const Summary& summary);

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  class Lock {
   public:
    // Doesn't block. Returns whether the lock is held.
    bool take(const std::filesystem::path& folder) noexcept;
    Lock() = default;
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    ~Lock();

   private:
    int descriptor_ = -1;
  };
  struct File {
    std::ofstream stream;
    std::string buffer;
    std::string name;
    bool packed = false;
  };
  void open(File& file, const char* name);
  void flush(File& file);
  void close(File& file);
  void open(std::optional<SignalTableWriter>& table, const char* name, const std::vector<SignalColumn>& columns);
  void close(std::optional<SignalTableWriter>& table, const char* name) const;
  void add_contact(const CycleRecord& record, std::size_t index);
  [[noreturn]] void fail(const std::string& name, const std::string& found) const;

  std::filesystem::path folder_;
  Lock lock_;
  std::size_t axes_;
  bool with_truth_;
  SignalsForm form_;
  File signals_, contacts_, frames_;
  std::optional<SignalTableWriter> table_, contact_table_;  // instead of signals_ and contacts_
};

}  // namespace proxarm::controller
