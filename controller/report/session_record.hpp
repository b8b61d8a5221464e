// A recorded session: a folder that holds what went in, what came out and what it was made with.
//
//   signals.csv      a row per cycle (signals/signal_columns.hpp). The first row names columns with units and frames;
//                    numbers are the shortest that read back to the same double
//   signals.bin      the same in its place, where that is wanted (signals/signal_table.hpp)
//   columns.json     unit, frame and meaning of each of them
//   contacts.csv     a row for each contact of each cycle (signals/contact_columns.hpp), or contacts.bin in its place;
//                    contact_columns.json has what they mean
//   session.mcap     the same session for other tools (messages/mcap_writer.hpp)
//   frames.log       every frame on every bus, as `candump -L` writes them, so canplayer and log2asc read it; packed it
//                    is frames.log.zst
//   effective.yaml   what the session ran with, every default filled in (and other configuration files by their names)
//   summary.json     figures that are the same in two runs with the same input (repeatable_json())
//   replay           what `proxarm replay` needs (replay_log.hpp)
//   timing.json      those of the wall clock (timing_json()); overruns and compute time stand nowhere else
//
// Two runs with the same input give the same bytes in all but timing.json. Not for the cycle: it leaves records in a
// ring, and whoever drains the ring calls this.
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
  // Makes the folder, with parents. One that exists must be empty or hold an earlier session, which is replaced;
  // anything else in it, a folder that can't be written, or one that another session is writing to, throws
  // description::SetupError with key --record. The folder is locked (flock) for as long as the writer, and processes
  // that were forked off meanwhile, live.
  // `axis_names` name the columns of the drives (at most max_axes); `with_truth` adds the columns of the simulation's
  // truth.
  SessionWriter(const std::filesystem::path& folder, const std::vector<std::string>& axis_names, bool with_truth,
                SignalsForm form = SignalsForm::csv);

  void add(const CycleRecord& record, const DerivedSignals& derived = {});
  // Time of the frame's last bit on the network's own clock (which is not the records' time: bring-up comes before the
  // first cycle), 0 or later.
  void add_frame(std::string_view bus, const fieldbus::CanFrame& frame, std::int64_t time_ns);
  // A file of configuration, as text: effective.yaml, or cell, scene, hand, sensor.yaml, arm.urdf as they were read;
  // reason.txt: why there is a black box.
  void write_file(std::string_view name, std::string_view text);
  // summary.json and timing.json; closes all files. Throws description::SetupError where a file couldn't be written
  // whole (a full disk, say).
  void finish(const Summary& summary);

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  // Held on a folder.
  class Lock {
   public:
    // Waits for nobody: whether it is held.
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
  std::optional<SignalTableWriter> table_, contact_table_;  // in the place of signals_ and contacts_
};

}  // namespace proxarm::controller
