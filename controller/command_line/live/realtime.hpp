// Real-time scheduling for the thread of the cycle, as far as the machine grants it.
#pragma once

namespace proxarm::command_line {

// While it lives, the calling thread runs under SCHED_FIFO on one processor, its stack is touched, the process' memory
// is locked, and processors don't sleep deeply. What the machine doesn't grant, or isn't set up for, is said on
// standard error, a line each with what it means and what helps, and done without.
class RealtimeThread {
 public:
  RealtimeThread();
  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;
  ~RealtimeThread();

 private:
  bool scheduled_ = false;
  int sleep_states_ = -1;  // /dev/cpu_dma_latency, held open
};

}  // namespace proxarm::command_line
