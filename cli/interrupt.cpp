#include "cli/interrupt.h"

#include <unistd.h>

#include <csignal>

#include "formats/error.h"

namespace texel {
namespace {

// A signal handler can reach nothing but a variable of the process.
volatile std::sig_atomic_t signals_seen = 0;

extern "C" void on_signal(int) {
  if (signals_seen) _exit(static_cast<int>(Code::kRunning));
  signals_seen = 1;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action{};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return signals_seen != 0; }

void stop_if_interrupted() {
  if (interrupted()) throw Error(Code::kRunning, "", "interrupted", "nothing was changed");
}

}  // namespace texel
