#include "controller/record/black_box.hpp"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

namespace proxarm::controller {
namespace {

// One second more than the box promises, since a replay starts at a state, and states are a second apart.
constexpr double kept_s = BlackBox::seconds + 1.0;
// Below a period of 0.25 ms, the box keeps the same number of cycles, which bounds its memory, and covers less time.
constexpr double shortest_period_s = 250e-6;

}  // namespace

void BoxReader::lay_out(Head* head) noexcept {
  static_assert(alignof(BoxCycle) <= 8 && alignof(BoxFrame) <= 8 && alignof(BoxTruth) <= 8 && alignof(State) <= 8 &&
                sizeof(Head) % 8 == 0);
  head_ = head;
  cycles_ = reinterpret_cast<BoxCycle*>(reinterpret_cast<std::byte*>(head) + sizeof(Head));
  truths_ = reinterpret_cast<BoxTruth*>(cycles_ + head->cycle_capacity);
  frames_ = reinterpret_cast<BoxFrame*>(truths_ + head->cycle_capacity);
  states_ = reinterpret_cast<State*>(frames_ + head->frame_capacity);
}

BlackBox::BlackBox(double period_s, std::size_t frames_per_cycle, Memory kind)
    : cycles_per_state_(
          static_cast<std::uint64_t>(std::max(1.0, std::round(1.0 / std::max(period_s, shortest_period_s))))) {
  const auto cycles = static_cast<std::size_t>(std::ceil(kept_s / std::max(period_s, shortest_period_s)));
  const std::size_t frames = cycles * frames_per_cycle;
  bytes_ = bytes_for(cycles, frames);
  int flags = MAP_SHARED | MAP_ANONYMOUS;
  if (kind == Memory::by_descriptor) {
    flags = MAP_SHARED;
    descriptor_ = memfd_create("proxarm-black-box", MFD_CLOEXEC);
    if (descriptor_ < 0 || ftruncate(descriptor_, static_cast<off_t>(bytes_)) != 0) throw std::bad_alloc();
  }
  void* const memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, flags, descriptor_, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  // Populates all pages now, since the cycle may not have page faults. From kernel 5.14 on, madvise() does this in one
  // call: page by page it would take seconds on User-Mode Linux. memset() then writes all pages: on processors without
  // dirty bits (User-Mode Linux, some ARM), the first write to a page is a fault even after a read.
  (void)madvise(memory, bytes_, MADV_POPULATE_WRITE);
  std::memset(memory, 0, bytes_);
  Head* const head = new (memory) Head;
  head->layout = layout_of_this_program();
  head->cycle_capacity = cycles;
  head->frame_capacity = frames;
  lay_out(head);
}

BlackBox::~BlackBox() {
  munmap(head_, bytes_);
  if (descriptor_ >= 0) close(descriptor_);
}

MappedBox::MappedBox(int descriptor) {
  struct stat status {};
  if (fstat(descriptor, &status) != 0 || status.st_size < static_cast<off_t>(sizeof(Head))) {
    throw std::runtime_error("the session's memory isn't there");
  }
  bytes_ = static_cast<std::size_t>(status.st_size);
  memory_ = mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, descriptor, 0);
  if (memory_ == MAP_FAILED) throw std::runtime_error("the session's memory can't be mapped");
  Head* const head = static_cast<Head*>(memory_);
  if (head->layout != layout_of_this_program() || bytes_for(head->cycle_capacity, head->frame_capacity) != bytes_) {
    munmap(memory_, bytes_);
    throw std::runtime_error("the session's memory was laid out by another build of proxarm");
  }
  lay_out(head);
}

MappedBox::~MappedBox() { munmap(memory_, bytes_); }

BoxCycle& BlackBox::begin(std::int64_t t_k_ns) noexcept {
  BoxCycle& entry = cycles_[head_->cycles.load(std::memory_order_relaxed) % head_->cycle_capacity];
  entry.t_k_ns = t_k_ns;
  entry.first_frame = head_->frames.load(std::memory_order_relaxed);
  entry.frames = 0;
  entry.input_bytes = 0;
  return entry;
}

void BlackBox::add(const BoxFrame& frame) noexcept {
  const std::uint64_t at = head_->frames.load(std::memory_order_relaxed);
  frames_[at % head_->frame_capacity] = frame;
  head_->frames.store(at + 1, std::memory_order_release);
}

void BlackBox::finish() noexcept {
  const std::uint64_t at = head_->cycles.load(std::memory_order_relaxed);
  BoxCycle& entry = cycles_[at % head_->cycle_capacity];
  entry.frames = static_cast<std::uint32_t>(head_->frames.load(std::memory_order_relaxed) - entry.first_frame);
  head_->cycles.store(at + 1, std::memory_order_release);
}

void BlackBox::add_truth(const Triple& tool_m, const std::array<double, 4>& tool_q) noexcept {
  const std::uint64_t end = head_->cycles.load(std::memory_order_relaxed);
  if (end == 0) return;
  truths_[(end - 1) % head_->cycle_capacity] = {end - 1, tool_m, tool_q};
  head_->truths.store(end, std::memory_order_release);
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

// Counts one entry fewer than the capacity, since the cycle may be writing the next entry.
std::uint64_t BoxReader::oldest_cycle() const noexcept {
  const std::uint64_t end = cycles();
  std::uint64_t oldest = end > head_->cycle_capacity - 1 ? end - (head_->cycle_capacity - 1) : 0;
  const std::uint64_t frames = head_->frames.load(std::memory_order_acquire);
  const std::uint64_t oldest_frame = frames > head_->frame_capacity ? frames - head_->frame_capacity : 0;
  while (oldest < end && cycles_[oldest % head_->cycle_capacity].first_frame < oldest_frame) ++oldest;
  return oldest;
}

bool BoxReader::read(std::uint64_t cycle, BoxCycle& out) const noexcept {
  if (cycle >= cycles() || cycle < oldest_cycle()) return false;
  out = cycles_[cycle % head_->cycle_capacity];
  return cycle >= oldest_cycle();
}

bool BoxReader::truth(std::uint64_t cycle, BoxTruth& out) const noexcept {
  if (cycle >= truths() || cycle < oldest_cycle()) return false;
  out = truths_[cycle % head_->cycle_capacity];
  return out.cycle == cycle && cycle >= oldest_cycle();
}

bool BoxReader::read(std::uint64_t cycle, BoxCycle& out, std::vector<BoxFrame>& frames) const {
  if (!read(cycle, out)) return false;
  frames.clear();
  for (std::uint32_t i = 0; i < out.frames && i < head_->frame_capacity; ++i) {
    frames.push_back(frames_[(out.first_frame + i) % head_->frame_capacity]);
  }
  return cycle >= oldest_cycle();
}

bool BoxReader::oldest_state(std::uint64_t& cycle, std::vector<std::byte>& state) const {
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

std::vector<BoxFrame> BoxReader::unfinished() const {
  std::uint64_t from = 0;
  if (cycles() > 0) {
    const BoxCycle& last = cycles_[(cycles() - 1) % head_->cycle_capacity];
    from = last.first_frame + last.frames;
  }
  std::vector<BoxFrame> frames;
  const std::uint64_t end = head_->frames.load(std::memory_order_acquire);
  for (std::uint64_t i = std::max(from, end > head_->frame_capacity ? end - head_->frame_capacity : 0); i < end; ++i) {
    frames.push_back(frames_[i % head_->frame_capacity]);
  }
  return frames;
}

}  // namespace proxarm::controller
