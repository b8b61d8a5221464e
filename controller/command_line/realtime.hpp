// Real-time scheduling for the thread of the cycle, as far as the machine grants it.
#pragma once

namespace proxarm::command_line {

// While it lives, the calling thread runs under SCHED_FIFO and the process' memory is locked. What isn't granted is
// warned of on standard error, in one line, and done without.
class RealtimeThread {
 public:
  RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;
  ~RealtimeThread();

 private:
  bool scheduled_ = false;
};

}  // namespace proxarm::command_line
