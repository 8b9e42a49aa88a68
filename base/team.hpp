#pragma once
// Many short loops, one after the other, by threads that stay together: a sweep over a thousand contacts is a dozen
// loops of some microseconds each, as long as it takes to hand one to a job system.
#include "base/function_ref.hpp"

#include <cairn/jobs.hpp>

namespace cairn {

// Calls lead(team), where `team` is a job system whose loops begin within a fraction of a microsecond: those threads of
// `jobs` that come stay until lead returns, and wait for its loops (spinning, then yielding, after a millisecond with
// naps). Nobody waits for a thread that does not come. Loops within loops of the team run in the thread that asks.
// `lead` may run in another thread than the caller's; what it or a loop throws is thrown on. Of one thread, `team` is
// `jobs` itself.
void leadTeam(JobSystem& jobs, FunctionRef<void(JobSystem&)> lead);

}  // namespace cairn
