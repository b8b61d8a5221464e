#include "controller/command_line/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace proxarm::command_line {
namespace {

constexpr int priority = 80;  // above the kernel's threaded interrupts (50), below its watchdogs (99)

}  // namespace

RealtimeThread::RealtimeThread() {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  scheduled_ = refused == 0;
  const bool locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (scheduled_ && locked) return;
  std::fprintf(stderr,
               "proxarm: %s%s%s refused (%s): cycles may be late when the machine is busy; grant rtprio and memlock in "
               "/etc/security/limits.conf\n",
               scheduled_ ? "" : "SCHED_FIFO", !scheduled_ && !locked ? " and " : "", locked ? "" : "mlockall",
               std::strerror(scheduled_ ? errno : refused));
}

RealtimeThread::~RealtimeThread() {
  if (!scheduled_) return;
  const sched_param parameters{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &parameters);
}

}  // namespace proxarm::command_line
