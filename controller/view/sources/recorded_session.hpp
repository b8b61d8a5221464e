// Reads a recorded session or a black box: cycles, events, and the frames on the buses in each cycle.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/record/replay_log.hpp"
#include "controller/signals/handle_spectrum.hpp"
#include "controller/view/sources/contacts_file.hpp"
#include "controller/view/sources/signals_file.hpp"
#include "controller/view/stage/stage.hpp"

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
  // The cycle at which the record opens: the fault, else a contact that has lasted 0.1 s, else the end of the longest
  // contact, else the beginning.
  [[nodiscard]] std::size_t opening() const noexcept { return opening_; }
  // For any thread.
  [[nodiscard]] double time_s(std::size_t index) const noexcept;
  // The fault as the black box or the summary reports it; empty if there was none.
  [[nodiscard]] const std::string& fault() const noexcept { return fault_; }
  // Whether moments of this cycle show the fault.
  [[nodiscard]] bool is_faulted(std::size_t index) const noexcept { return !fault_.empty() && index >= fault_at_; }

  // Precondition of all: index < size().
  [[nodiscard]] Moment moment(std::size_t index) const;
  [[nodiscard]] std::string encode(std::size_t index) const;
  // The handle's vibration in the second that ends with this cycle; empty if there is no such second.
  [[nodiscard]] std::vector<controller::HandleSpectrum::Band> spectrum(std::size_t index) const;
  // Whether the record has the tool's true place.
  [[nodiscard]] bool has_truth(std::size_t index) const;
  // The fields of at most `rows` moments between two cycles, with the peaks between them.
  [[nodiscard]] std::vector<double> window(std::size_t from, std::size_t to, std::size_t rows) const;
  // The frames on the buses in that cycle; empty if the record's replay doesn't contain the cycle.
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
  std::uint64_t first_cycle_ = 0;            // number of the first row's cycle
  std::vector<std::int64_t> time_ns_;        // of each cycle
  std::vector<std::uint32_t> touch_begins_;  // of each cycle, the first cycle of its touch; the largest value: no touch
  std::vector<std::int64_t> rendered_ns_;    // time rendered before each cycle, since the record's beginning
  std::vector<controller::ReplayPlace> positions_;  // of each cycle in the log, from the log's first one on
  std::vector<std::array<float, 3>> driven_m_;      // of each cycle and object; empty if no object is driven
  std::vector<RecordedEvent> events_;
  std::size_t opening_ = 0, fault_at_ = 0;
  std::uint64_t fault_cycle_ = 0;
  std::string fault_;
};

}  // namespace proxarm::view
