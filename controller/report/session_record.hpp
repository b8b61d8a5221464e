// Writes a recorded session: a folder with its input, its output and its configuration.
//
//   signals.csv           a row per cycle (signals/signal_columns.hpp). The first row names the columns with units and
//                         frames. A number is the shortest text that reads back to the same double
//   signals.bin           the same rows in binary, instead of signals.csv (signals/signal_table.hpp)
//   columns.json          unit, frame and meaning of each column of signals.csv or signals.bin
//   contacts.csv          a row for each contact of each cycle (signals/contact_columns.hpp)
//   contacts.bin          the same rows in binary, instead of contacts.csv
//   contact_columns.json  unit, frame and meaning of each column of contacts.csv or contacts.bin
//   session.mcap          the same session for other tools (view/messages/mcap_writer.hpp)
//   frames.log            every frame on every bus, in the format of `candump -L`, for canplayer and log2asc
//   frames.log.zst        the same frames packed, instead of frames.log
//   effective.yaml        the session's configuration with all defaults; other configuration files have their own names
//   summary.json          the repeatable figures (repeatable_json())
//   replay                folder for `proxarm replay` (replay_log.hpp)
//   timing.json           the wall clock's figures (timing_json()); overruns and compute time are only here
//
// Two runs with the same input give the same bytes in all files except timing.json. Not for the cycle: the cycle leaves
// its records in a ring, and the reader of the ring calls this class.
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
  // Makes the folder, with its parents, or replaces an earlier session in it. Throws description::SetupError with the
  // key --record if the folder holds anything else, if it can't be written, or if another session writes to it. The
  // folder is locked (flock) as long as the writer lives, or a process that was forked from the writer's. `axis_names`:
  // for the drives' columns, at most max_axes. `with_truth`: adds the columns of the simulation's true state.
  SessionWriter(const std::filesystem::path& folder, const std::vector<std::string>& axis_names, bool with_truth,
                SignalsForm form = SignalsForm::csv);

  void add(const CycleRecord& record, const DerivedSignals& derived = {});
  // `time_ns`: time of the frame's last bit, ≥ 0, on the network's clock. This isn't the records' time, which begins
  // with the first cycle, after bring-up.
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);
  // Writes a text as a file of the record. The names are effective.yaml; cell.yaml, scene.yaml, hand.yaml, sensor.yaml
  // and arm.urdf for these files as they were read; reason.txt for the reason of a black box.
  void write_file(std::string_view name, std::string_view text);
  // Writes summary.json and timing.json, and closes all files. Throws description::SetupError if a file couldn't be
  // written completely, for example on a full disk.
  void finish(const Summary& summary);

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  class Lock {
   public:
    // Tries to lock the folder, without blocking. Returns whether the lock is held.
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
