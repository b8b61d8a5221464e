// Gives the thread of the cycle real-time scheduling, as far as the machine permits it.
#pragma once

namespace proxarm::controller {

// From its construction to its destruction the calling thread runs under SCHED_FIFO on one processor, and processors
// don't enter deep sleep states. The constructor also locks the process's memory and touches the thread's stack. Each
// measure that the machine doesn't permit is left out, with a line on standard error that names the effect and a
// remedy.
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

}  // namespace proxarm::controller
