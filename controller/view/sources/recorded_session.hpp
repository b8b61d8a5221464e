// A session that was recorded, or a black box: any of its cycles, when something happened in it, and the frames of the
// buses at that moment.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/record/replay_log.hpp"
#include "controller/view/sources/signals_file.hpp"
#include "controller/view/stage/stage.hpp"

namespace proxarm::view {

// A place in a record that is worth a look.
struct RecordedEvent {
  enum class Kind : std::uint8_t { contact, limit, phase, fault };
  Kind kind = Kind::contact;
  std::size_t at = 0;  // index of the cycle
  double time_s = 0.0;
  std::string text;
};

class RecordedSession {
 public:
  // `stage` is of the record's own files, and must outlive it. Throws SetupError.
  RecordedSession(const std::filesystem::path& folder, Stage& stage);

  [[nodiscard]] std::size_t size() const noexcept { return signals_.size(); }
  [[nodiscard]] const std::vector<RecordedEvent>& events() const noexcept { return events_; }
  // Where to open it: at the fault, or else at the first contact, or at the beginning.
  [[nodiscard]] std::size_t opening() const noexcept { return opening_; }
  [[nodiscard]] double time_s(std::size_t index) const;
  // What the black box or the summary says of the fault; empty: there was none.
  [[nodiscard]] const std::string& fault() const noexcept { return fault_; }
  // The fault stands in moments from this cycle on.
  [[nodiscard]] bool is_faulted(std::size_t index) const noexcept { return !fault_.empty() && index >= fault_at_; }

  // Precondition of all: index < size().
  [[nodiscard]] Moment moment(std::size_t index) const;
  // The wire's message of it.
  [[nodiscard]] std::string encode(std::size_t index) const;
  // Fields of at most `rows` moments from one cycle to another, with the peaks between them.
  [[nodiscard]] std::vector<double> window(std::size_t from, std::size_t to, std::size_t rows) const;
  // What was on the buses in that cycle; empty where the record's replay doesn't have it.
  std::vector<controller::BoxFrame> frames(std::size_t index);
  [[nodiscard]] const controller::ReplayHead& head() const noexcept { return log_.head(); }

 private:
  void read_fault(const std::filesystem::path& folder);
  void find_events();
  void index_frames();
  void follow_driven();

  Stage& stage_;
  controller::ReplayReader log_;
  SignalsFile signals_;
  std::uint64_t first_cycle_ = 0;               // number of the first row's
  std::vector<std::int64_t> rendered_ns_;       // before each cycle, from the record's beginning
  std::vector<std::streamoff> positions_;       // of each cycle of the log, from its first on
  std::vector<std::array<float, 3>> driven_m_;  // of each cycle and object, where any object is driven
  std::vector<RecordedEvent> events_;
  std::size_t opening_ = 0, fault_at_ = 0;
  std::uint64_t fault_cycle_ = 0;
  std::string fault_;
};

}  // namespace proxarm::view
