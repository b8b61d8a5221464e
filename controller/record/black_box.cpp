#include "controller/record/black_box.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

namespace proxarm::controller {
namespace {

// One second more than is promised, since a replay starts at a state, and states are a second apart.
constexpr double kept_s = BlackBox::seconds + 1.0;
// Below 0.25 ms the number of cycles no longer grows, to bound the memory: the box then holds less time.
constexpr double shortest_period_s = 250e-6;

}  // namespace

BlackBox::BlackBox(double period_s, std::size_t frames_per_cycle)
    : cycle_capacity_(static_cast<std::size_t>(std::ceil(kept_s / std::max(period_s, shortest_period_s)))),
      frame_capacity_(cycle_capacity_ * frames_per_cycle),
      cycles_per_state_(
          static_cast<std::uint64_t>(std::max(1.0, std::round(1.0 / std::max(period_s, shortest_period_s))))),
      bytes_(sizeof(Head) + cycle_capacity_ * sizeof(BoxCycle) + frame_capacity_ * sizeof(BoxFrame) +
             state_count * sizeof(State)) {
  static_assert(alignof(BoxCycle) <= 8 && alignof(BoxFrame) <= 8 && alignof(State) <= 8 && sizeof(Head) % 8 == 0);
  void* const memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  // All pages now: a page fault would fall into the cycle. Written, not just there: where the processor keeps no dirty
  // bits (User-Mode Linux, some ARM) the first write to each page of a shared mapping still is a fault. In one go,
  // since one by one they take seconds where each is a process switch (User-Mode Linux); a kernel before 5.14 refuses
  // that.
  (void)madvise(memory, bytes_, MADV_POPULATE_WRITE);
  std::memset(memory, 0, bytes_);
  memory_ = static_cast<std::byte*>(memory);
  head_ = new (memory_) Head;
  cycles_ = reinterpret_cast<BoxCycle*>(memory_ + sizeof(Head));
  frames_ = reinterpret_cast<BoxFrame*>(cycles_ + cycle_capacity_);
  states_ = reinterpret_cast<State*>(frames_ + frame_capacity_);
}

BlackBox::~BlackBox() { munmap(memory_, bytes_); }

BoxCycle& BlackBox::begin(std::int64_t t_k_ns) noexcept {
  BoxCycle& entry = cycles_[head_->cycles.load(std::memory_order_relaxed) % cycle_capacity_];
  entry.t_k_ns = t_k_ns;
  entry.first_frame = head_->frames.load(std::memory_order_relaxed);
  entry.frames = 0;
  entry.input_bytes = 0;
  return entry;
}

void BlackBox::add(const BoxFrame& frame) noexcept {
  const std::uint64_t at = head_->frames.load(std::memory_order_relaxed);
  frames_[at % frame_capacity_] = frame;
  head_->frames.store(at + 1, std::memory_order_release);
}

void BlackBox::finish() noexcept {
  const std::uint64_t at = head_->cycles.load(std::memory_order_relaxed);
  BoxCycle& entry = cycles_[at % cycle_capacity_];
  entry.frames = static_cast<std::uint32_t>(head_->frames.load(std::memory_order_relaxed) - entry.first_frame);
  head_->cycles.store(at + 1, std::memory_order_release);
}

std::span<std::byte> BlackBox::state_room() noexcept {
  if (head_->cycles.load(std::memory_order_relaxed) % cycles_per_state_ != 0) return {};
  return states_[head_->states.load(std::memory_order_relaxed) % state_count].bytes;
}

void BlackBox::finish_state(std::size_t bytes) noexcept {
  const std::uint64_t at = head_->states.load(std::memory_order_relaxed);
  states_[at % state_count].cycle = head_->cycles.load(std::memory_order_relaxed);
  states_[at % state_count].size = bytes;
  head_->states.store(at + 1, std::memory_order_release);
}

// One entry less than there is room for, since the next one may just be written.
std::uint64_t BlackBox::oldest_cycle() const noexcept {
  const std::uint64_t end = cycles();
  std::uint64_t oldest = end > cycle_capacity_ - 1 ? end - (cycle_capacity_ - 1) : 0;
  const std::uint64_t frames = head_->frames.load(std::memory_order_acquire);
  const std::uint64_t oldest_frame = frames > frame_capacity_ ? frames - frame_capacity_ : 0;
  while (oldest < end && cycles_[oldest % cycle_capacity_].first_frame < oldest_frame) ++oldest;
  return oldest;
}

bool BlackBox::read(std::uint64_t cycle, BoxCycle& out, std::vector<BoxFrame>& frames) const {
  if (cycle >= cycles() || cycle < oldest_cycle()) return false;
  out = cycles_[cycle % cycle_capacity_];
  frames.clear();
  for (std::uint32_t i = 0; i < out.frames && i < frame_capacity_; ++i) {
    frames.push_back(frames_[(out.first_frame + i) % frame_capacity_]);
  }
  return cycle >= oldest_cycle();
}

bool BlackBox::oldest_state(std::uint64_t& cycle, std::vector<std::byte>& state) const {
  const std::uint64_t end = head_->states.load(std::memory_order_acquire);
  for (std::uint64_t i = end > state_count ? end - state_count : 0; i < end; ++i) {
    const State& kept = states_[i % state_count];
    if (kept.cycle < oldest_cycle() || kept.cycle >= cycles()) continue;
    cycle = kept.cycle;
    state.assign(kept.bytes.begin(), kept.bytes.begin() + static_cast<std::ptrdiff_t>(kept.size));
    return true;
  }
  return false;
}

std::vector<BoxFrame> BlackBox::unfinished() const {
  std::uint64_t from = 0;
  if (cycles() > 0) {
    const BoxCycle& last = cycles_[(cycles() - 1) % cycle_capacity_];
    from = last.first_frame + last.frames;
  }
  std::vector<BoxFrame> frames;
  const std::uint64_t end = head_->frames.load(std::memory_order_acquire);
  for (std::uint64_t i = std::max(from, end > frame_capacity_ ? end - frame_capacity_ : 0); i < end; ++i) {
    frames.push_back(frames_[i % frame_capacity_]);
  }
  return frames;
}

}  // namespace proxarm::controller
