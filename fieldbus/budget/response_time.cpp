#include "fieldbus/budget/response_time.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t no_bound = std::numeric_limits<std::int64_t>::max();
constexpr int cycles_back = 2;  // how many cycles earlier the examined busy periods may begin

std::int64_t floor_divide(std::int64_t a, std::int64_t b) noexcept {
  const std::int64_t quotient = a / b;
  return quotient * b > a ? quotient - 1 : quotient;
}

// A frame that can be in the busy period of frame m.
struct Competitor {
  std::size_t frame = 0;
  bool ahead = false;  // from m's sender: it delays m only if it was queued before m
  // The frame is caused by m or queued behind m, so its instance in m's cycle doesn't delay m.
  bool not_this_cycle = false;
  // The frame can stand in its sender's queue behind a frame with lower priority than `weakest`.
  bool held_back = false;
  // Jitter of the frame's release, or of the time when it reaches the head of its queue if held_back.
  std::int64_t jitter_ns = 0;
};

struct Level {
  // Lowest priority of m and of the frames that can precede m; frames below it count as "lower priority".
  std::uint64_t weakest = 0;
  std::vector<Competitor> competitors;
};

class Analysis {
 public:
  Analysis(const PlannedBus& bus, const std::vector<int>& triggers, std::int64_t period_ns)
      : frames_(bus.frames), triggers_(triggers), period_ns_(period_ns), windows_(frames_.size()) {
    const BitRates rates{bus.bitrate, bus.data_bitrate};
    for (const PlannedFrame& frame : frames_) {
      worst_ns_.push_back(wire_time_ns(worst_wire_bits(frame.shape), rates));
      least_ns_.push_back(wire_time_ns(minimum_wire_bits(frame.shape), rates));
      priority_.push_back(planned_priority(frame));
    }
    interframe_ns_ = wire_time_ns(WireBits{can_interframe_bits, 0}, rates);
    inherit_phase();
  }

  std::vector<FrameWindow> run() {
    // Start with windows for an empty bus. A frame may come after a frame that is listed later, so there are as many
    // passes as frames.
    for (std::size_t pass = 0; pass < frames_.size(); ++pass) {
      for (std::size_t m = 0; m < frames_.size(); ++m) {
        windows_[m] = release_of(m);
        windows_[m].response_ns = worst_ns_[m];
        windows_[m].finish_ns = windows_[m].release_ns + windows_[m].jitter_ns + worst_ns_[m];
      }
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t m = 0; m < frames_.size(); ++m) changed = update(m) || changed;
    }
    return windows_;
  }

 private:
  [[nodiscard]] std::size_t trigger(std::size_t m) const { return static_cast<std::size_t>(triggers_[m]); }

  // If a frame comes after another frame that is out of step with the cycle, it is out of step too. It isn't sent more
  // often than the other frame either.
  void inherit_phase() {
    for (std::size_t pass = 0; pass < frames_.size(); ++pass) {
      for (std::size_t m = 0; m < frames_.size(); ++m) {
        if (triggers_[m] < 0) continue;
        frames_[m].any_time = frames_[m].any_time || frames_[trigger(m)].any_time;
        frames_[m].every_cycles = std::max(frames_[m].every_cycles, frames_[trigger(m)].every_cycles);
        frames_[m].every_ns = std::max(frames_[m].every_ns, frames_[trigger(m)].every_ns);
      }
    }
  }

  // True if the frame's time in the cycle is known. The frame needn't be sent in every cycle.
  [[nodiscard]] bool in_step(std::size_t k) const { return !frames_[k].any_time; }
  [[nodiscard]] std::int64_t every_ns(std::size_t k) const {
    return frames_[k].every_ns > 0 ? frames_[k].every_ns : period_ns_ * frames_[k].every_cycles;
  }

  [[nodiscard]] FrameWindow release_of(std::size_t m) const {
    const PlannedFrame& frame = frames_[m];
    FrameWindow window;
    const std::int64_t latest_delay_ns = std::max(frame.delay_ns, frame.latest_delay_ns);
    window.any_time = frame.any_time;
    if (triggers_[m] >= 0) {
      const FrameWindow& before = windows_[trigger(m)];
      window.release_ns = before.release_ns + least_ns_[trigger(m)] - interframe_ns_ + frame.delay_ns;
      window.jitter_ns = std::max(before.finish_ns + latest_delay_ns - window.release_ns, std::int64_t{0});
      window.bounded = before.bounded;
    } else if (!frame.any_time) {
      window.release_ns = std::llround(frame.release * static_cast<double>(period_ns_)) + frame.delay_ns;
      window.jitter_ns = latest_delay_ns - frame.delay_ns;
    }
    return window;
  }

  // Updates the window of frame m. True if the window grew. The iteration ends, because windows only grow, and only up
  // to a limit.
  bool update(std::size_t m) {
    const FrameWindow old = windows_[m];
    if (!old.bounded) return false;
    FrameWindow next = release_of(m);
    next.response_ns = old.response_ns;
    next.finish_ns = std::max(old.finish_ns, next.release_ns + next.jitter_ns + worst_ns_[m]);
    windows_[m] = next;
    const Level level = level_of(m);
    if (in_step(m)) {
      examine_in_step(m, level);
    } else {
      examine_any_phase(m, level);
    }
    const FrameWindow& now = windows_[m];
    return now.finish_ns != old.finish_ns || now.jitter_ns != old.jitter_ns || now.response_ns != old.response_ns ||
           now.bounded != old.bounded;
  }

  // True if frame k causes frame m, directly or through other frames, to be queued in the same cycle.
  [[nodiscard]] bool leads_to(std::size_t k, std::size_t m) const {
    for (int at = triggers_[m]; at >= 0; at = triggers_[static_cast<std::size_t>(at)]) {
      if (at == static_cast<int>(k)) return true;
    }
    return false;
  }

  // True if one sender queues both frames at the same time, so that the order of the list decides which frame is first.
  [[nodiscard]] bool queued_together(std::size_t a, std::size_t b) const {
    return frames_[a].sender == frames_[b].sender && triggers_[a] == triggers_[b] && in_step(a) && in_step(b) &&
           frames_[a].release == frames_[b].release && frames_[a].delay_ns == frames_[b].delay_ns &&
           frames_[a].latest_delay_ns == frames_[b].latest_delay_ns;
  }

  // True if frame k can be pending at some time in [from, to]. For a frame out of step this is assumed.
  [[nodiscard]] bool can_be_pending(std::size_t k, std::int64_t from_ns, std::int64_t to_ns) const {
    if (!in_step(k)) return true;
    const FrameWindow& window = windows_[k];
    const std::int64_t last = floor_divide(to_ns - window.release_ns, period_ns_);
    return window.finish_ns + last * period_ns_ > from_ns;
  }

  // True if frame a has the same sender as frame m and can precede m in the sender's queue.
  [[nodiscard]] bool can_precede(std::size_t a, std::size_t m) const {
    if (a == m || frames_[a].sender != frames_[m].sender) return false;
    if (!in_step(a) || !in_step(m)) return true;
    const FrameWindow& window = windows_[m];
    if (!can_be_pending(a, window.release_ns, window.release_ns + window.jitter_ns)) return false;
    return !queued_together(a, m) || a < m || windows_[a].finish_ns - windows_[a].release_ns >= period_ns_;
  }

  [[nodiscard]] Level level_of(std::size_t m) const {
    Level level{priority_[m], {}};
    for (std::size_t a = 0; a < frames_.size(); ++a) {
      if (can_precede(a, m)) level.weakest = std::max(level.weakest, priority_[a]);
    }
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      const bool same_sender = frames_[k].sender == frames_[m].sender;
      // By its definition, `weakest` excludes no frame that can precede m. A frame of m's sender that ended before m
      // was queued stays included: it belongs to the busy period, because it may have delayed other frames.
      if (k == m || priority_[k] > level.weakest) continue;
      Competitor competitor{k, same_sender, leads_to(m, k) || (queued_together(k, m) && k > m), false, 0};
      for (std::size_t l = 0; l < frames_.size(); ++l) {
        competitor.held_back = competitor.held_back || (priority_[l] > level.weakest && can_precede(l, k));
      }
      const FrameWindow& window = windows_[k];
      competitor.jitter_ns = window.jitter_ns;
      if (competitor.held_back) {
        competitor.jitter_ns = std::max(window.jitter_ns, window.finish_ns - window.release_ns - worst_ns_[k]);
      }
      level.competitors.push_back(competitor);
    }
    // Instances of m from earlier cycles.
    level.competitors.push_back({m, true, true, false, windows_[m].jitter_ns});
    return level;
  }

  // Returns how many instances of the competitor can be released in [start, end] at most. phase_known: `start` is a
  // time in m's cycle.
  [[nodiscard]] std::int64_t releases(const Competitor& k, std::int64_t start_ns, std::int64_t end_ns,
                                      bool phase_known) const {
    if (end_ns < start_ns) return 0;
    const std::int64_t at_any_phase = 1 + (end_ns - start_ns + k.jitter_ns) / every_ns(k.frame);
    if (!phase_known || !in_step(k.frame)) return at_any_phase;
    const std::int64_t release_ns = windows_[k.frame].release_ns;
    const std::int64_t last = last_cycle(k, end_ns);
    const std::int64_t before = floor_divide(start_ns - release_ns - k.jitter_ns - 1, period_ns_);
    return std::clamp<std::int64_t>(last - before, 0, at_any_phase);
  }

  // Returns the worst-case start of m's transmission in a busy period that begins at start_ns, or no_bound.
  [[nodiscard]] std::int64_t begin_of(std::size_t m, const Level& level, std::int64_t start_ns,
                                      std::int64_t blocking_ns, std::int64_t latest_release_ns,
                                      bool phase_known) const {
    std::int64_t begin_ns = start_ns + blocking_ns;
    for (;;) {
      std::int64_t next_ns = start_ns + blocking_ns;
      for (const Competitor& k : level.competitors) {
        // Earlier instances of m don't count here: if m's response took longer than its repetition time, m would have
        // no bound.
        if (k.frame == m && !phase_known) continue;
        const std::int64_t end_ns = k.ahead ? std::min(begin_ns, latest_release_ns) : begin_ns;
        next_ns += worst_ns_[k.frame] * releases(k, start_ns, end_ns, phase_known);
      }
      if (next_ns - start_ns > 2 * every_ns(m)) return no_bound;
      if (next_ns <= begin_ns) return begin_ns;
      begin_ns = next_ns;
    }
  }

  // Returns the wire time of the longest lower-priority frame that can be on the wire at some time in [from, to]; with
  // `anything`, at any time.
  [[nodiscard]] std::int64_t blocking(std::size_t m, const Level& level, std::int64_t from_ns, std::int64_t to_ns,
                                      bool anything) const {
    std::int64_t longest_ns = 0;
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      if (k == m || priority_[k] <= level.weakest) continue;
      if (anything || can_be_pending(k, from_ns, to_ns - 1)) longest_ns = std::max(longest_ns, worst_ns_[k]);
    }
    return longest_ns;
  }

  void grow(std::size_t m, std::int64_t begin_ns, std::int64_t earliest_release_ns) {
    FrameWindow& window = windows_[m];
    if (begin_ns == no_bound) {
      window.bounded = false;
      return;
    }
    const std::int64_t finish_ns = begin_ns + worst_ns_[m];
    window.response_ns = std::max(window.response_ns, finish_ns - earliest_release_ns);
    window.finish_ns = std::max(window.finish_ns, finish_ns);
    if (window.response_ns > every_ns(m)) window.bounded = false;
  }

  // Examines a frame m out of step: any other frame may be released at the same moment as m.
  void examine_any_phase(std::size_t m, const Level& level) {
    const std::int64_t blocking_ns = blocking(m, level, 0, 0, true);
    const std::int64_t begin_ns = begin_of(m, level, 0, blocking_ns, 0, false);
    const FrameWindow window = windows_[m];
    grow(m, begin_ns, 0);
    if (begin_ns != no_bound) {
      windows_[m].finish_ns =
          std::max(window.finish_ns, window.release_ns + window.jitter_ns + windows_[m].response_ns);
    }
  }

  // Examines all busy periods that can contain m:
  // 1. A busy period begins with the release of one of its frames.
  // 2. Of two busy periods with the same frames, the one that begins later also ends later.
  // 3. So among the busy periods with the same frames, only the latest beginning matters. The latest possible
  //    beginnings are the latest release times of m and of the competitors (`lasts`), and only these are tried.
  void examine_in_step(std::size_t m, const Level& level) {
    const FrameWindow own = windows_[m];
    const std::int64_t latest_ns = own.release_ns + own.jitter_ns;
    std::vector<std::int64_t> lasts{latest_ns};
    for (const Competitor& k : level.competitors) {
      for (std::int64_t n = -cycles_back; in_step(k.frame) && n <= last_cycle(k, latest_ns); ++n) {
        lasts.push_back(windows_[k.frame].release_ns + k.jitter_ns + n * period_ns_);
      }
    }
    examine_start(m, level, {m, false, false, false, own.jitter_ns}, 0, lasts);
    for (const Competitor& k : level.competitors) {
      if (!in_step(k.frame)) {
        // A competitor out of step can begin a busy period at any time up to m's release.
        for (const std::int64_t start_ns : lasts) examine_start_at(m, level, start_ns, blocking(m, level, 0, 0, true));
        continue;
      }
      for (std::int64_t n = -cycles_back; n <= last_cycle(k, latest_ns); ++n) examine_start(m, level, k, n, lasts);
    }
  }

  // Returns the last cycle, counted from m's cycle, whose instance of the competitor can be released until time_ns.
  [[nodiscard]] std::int64_t last_cycle(const Competitor& k, std::int64_t time_ns) const {
    const std::int64_t last = floor_divide(time_ns - windows_[k.frame].release_ns, period_ns_);
    return k.not_this_cycle ? std::min<std::int64_t>(last, -1) : last;
  }

  // Examines the busy periods that begin with the release of frame `first` in cycle n (0 is m's cycle).
  void examine_start(std::size_t m, const Level& level, const Competitor& first, std::int64_t n,
                     const std::vector<std::int64_t>& lasts) {
    const std::int64_t from_ns = windows_[first.frame].release_ns + n * period_ns_;
    const std::int64_t to_ns = from_ns + first.jitter_ns;
    const PlannedFrame& frame = frames_[first.frame];
    // A frame that is queued exactly at the end of another frame takes part in the next arbitration, so no
    // lower-priority frame blocks it.
    const bool at_end = triggers_[first.frame] >= 0 && frame.delay_ns == 0 && frame.latest_delay_ns <= 0;
    std::int64_t blocking_ns = 0;
    if (first.held_back) {
      blocking_ns = blocking(m, level, 0, 0, true);
    } else if (!at_end) {
      blocking_ns = blocking(m, level, from_ns, to_ns, false);
    }
    for (const std::int64_t start_ns : lasts) {
      if (start_ns >= from_ns && start_ns <= to_ns) examine_start_at(m, level, start_ns, blocking_ns);
    }
  }

  void examine_start_at(std::size_t m, const Level& level, std::int64_t start_ns, std::int64_t blocking_ns) {
    const FrameWindow& window = windows_[m];
    if (!window.bounded) return;
    const std::int64_t latest_ns = window.release_ns + window.jitter_ns;
    if (start_ns > latest_ns) return;
    const std::int64_t begin_ns = begin_of(m, level, start_ns, blocking_ns, latest_ns, true);
    if (begin_ns < window.release_ns) return;  // the busy period ends before m is released
    grow(m, begin_ns, std::max(start_ns, window.release_ns));
  }

  std::vector<PlannedFrame> frames_;
  const std::vector<int>& triggers_;
  std::int64_t period_ns_;
  std::int64_t interframe_ns_ = 0;
  std::vector<std::int64_t> worst_ns_;
  std::vector<std::int64_t> least_ns_;
  std::vector<std::uint64_t> priority_;
  std::vector<FrameWindow> windows_;
};

}  // namespace

std::vector<FrameWindow> response_windows(const PlannedBus& bus, const std::vector<int>& triggers,
                                          std::int64_t period_ns) {
  return Analysis(bus, triggers, period_ns).run();
}

std::uint64_t planned_priority(const PlannedFrame& frame) noexcept {
  const std::uint64_t fd = frame.shape.fd ? 1 : 0;
  if (!frame.shape.extended) return (std::uint64_t{frame.id} << 22) | (fd << 19);
  return (std::uint64_t{frame.id >> 18} << 22) | (3ull << 20) | (std::uint64_t{frame.id & 0x3ffff} << 2) | fd;
}

}  // namespace proxarm::fieldbus
