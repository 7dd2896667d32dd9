#pragma once
// SIGINT and SIGTERM: the first ends the work cleanly at its next report of progress, a second one at once.

namespace texel {

void catch_interrupts();
[[nodiscard]] bool interrupted();
// Throws Error{kRunning} when a signal has come.
void stop_if_interrupted();

}  // namespace texel
