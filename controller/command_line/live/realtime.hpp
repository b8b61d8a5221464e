// Real-time scheduling for the thread of the cycle, as far as the machine permits.
#pragma once

namespace proxarm::command_line {

// During its lifetime the calling thread runs under SCHED_FIFO on one processor, with its stack touched, the process's
// memory locked, and deep sleep of processors disabled. For each measure that the machine doesn't permit or isn't set
// up for, prints a line on standard error with the effect and a remedy, and goes on without it.
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
