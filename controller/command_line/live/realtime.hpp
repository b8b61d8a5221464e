// Real-time scheduling for the thread of the cycle, as far as the machine permits.
#pragma once

namespace proxarm::command_line {

// During its lifetime the calling thread runs under SCHED_FIFO on one processor, its stack is touched, the process's
// memory is locked, and processors don't sleep deeply. A measure that the machine doesn't permit is left out, with a
// line on standard error that names the effect and a remedy.
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
