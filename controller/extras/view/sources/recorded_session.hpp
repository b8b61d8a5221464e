// Reads a recorded session or a black box: cycles, events, and the frames on the buses in each cycle.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/view/sources/contacts_file.hpp"
#include "controller/extras/view/sources/signals_file.hpp"
#include "controller/record/replay_log.hpp"
#include "controller/signals/handle_spectrum.hpp"
#include "controller/stage/stage.hpp"

namespace proxarm::view {

struct RecordedEvent {
  enum class Kind : std::uint8_t { contact, limit, phase, fault };
  Kind kind = Kind::contact;
  std::size_t at = 0;  // index of the cycle
  double time_s = 0.0;
  std::string text;
};

class RecordedSession {
 public:
  // Precondition: `stage` is made from the record's own files and outlives this object. Throws SetupError.
  RecordedSession(const std::filesystem::path& folder, Stage& stage);

  [[nodiscard]] std::size_t size() const noexcept { return signals_.size(); }
  [[nodiscard]] const std::vector<RecordedEvent>& events() const noexcept { return events_; }
  // Returns the cycle at which the record is opened: the fault; else a contact that has lasted 0.1 s; else the end of
  // the longest contact; else the beginning.
  [[nodiscard]] std::size_t opening() const noexcept { return opening_; }
  // May be called by any thread.
  [[nodiscard]] double time_s(std::size_t index) const noexcept;
  // Returns the fault that the black box or the summary reports; empty if there was no fault.
  [[nodiscard]] const std::string& fault() const noexcept { return fault_; }
  // Returns whether the moment of this cycle shows the fault.
  [[nodiscard]] bool is_faulted(std::size_t index) const noexcept { return !fault_.empty() && index >= fault_at_; }

  // Precondition of the functions below: index < size().
  [[nodiscard]] Moment moment(std::size_t index) const;
  [[nodiscard]] std::string encode(std::size_t index) const;
  // Returns the handle's vibration in the second that ends with this cycle; empty if rendering hasn't lasted for a
  // second then.
  [[nodiscard]] std::vector<controller::HandleSpectrum::Band> spectrum(std::size_t index) const;
  // Returns whether the record has the tool's true place in this cycle.
  [[nodiscard]] bool has_truth(std::size_t index) const;
  // Returns the fields of at most about `rows` moments from one cycle to another, with the peaks between the moments.
  [[nodiscard]] std::vector<double> window(std::size_t from, std::size_t to, std::size_t rows) const;
  // Returns the frames on the buses in this cycle; empty if the record's replay doesn't contain the cycle.
  std::vector<controller::BoxFrame> frames(std::size_t index);
  [[nodiscard]] const controller::ReplayHead& head() const noexcept { return log_.head(); }

 private:
  void read_fault(const std::filesystem::path& folder);
  void find_events();
  void index_frames();
  void follow_driven();
  [[nodiscard]] Blow blow_before(std::size_t index) const;

  Stage& stage_;
  controller::ReplayReader log_;
  SignalsFile signals_;
  ContactsFile contacts_;
  std::uint64_t first_cycle_ = 0;      // number of the cycle in the first row
  std::vector<std::int64_t> time_ns_;  // time of each cycle
  // For each cycle, the index of the first cycle of its touch; the largest value: no touch.
  std::vector<std::uint32_t> touch_begins_;
  // For each cycle, the time that was rendered before it, since the record's beginning.
  std::vector<std::int64_t> rendered_ns_;
  // Position of each cycle in the log, from the log's first cycle on.
  std::vector<controller::ReplayPlace> positions_;
  // Displacement of each object in each cycle; empty if no object is driven.
  std::vector<std::array<float, 3>> driven_m_;
  std::vector<RecordedEvent> events_;
  std::size_t opening_ = 0, fault_at_ = 0;
  std::uint64_t fault_cycle_ = 0;
  std::string fault_;
};

}  // namespace proxarm::view
