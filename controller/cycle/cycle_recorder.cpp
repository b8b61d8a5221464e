#include "controller/cycle/cycle_recorder.hpp"

namespace proxarm::controller {

// The box's entry was used by an old cycle. Clears the entry's requests, since a replay mustn't repeat the requests of
// the old cycle.
void CycleRecorder::begin_entry(std::int64_t t_k_ns) noexcept {
  record_ = {};
  entry_ = &box_->begin(t_k_ns);
  entry_->change = {};
  entry_->command = {};
  entry_->timestep = {};
}

void CycleRecorder::finish() noexcept {
  records_.push(record_);
  entry_->record = record_;
  box_->finish();
}

}  // namespace proxarm::controller
