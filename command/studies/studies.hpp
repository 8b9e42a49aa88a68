#pragma once
// Door of demos/studies: measurements of the engine's own solvers, and figures of them.
#include "command/studies/budgets.hpp"
#include "command/studies/clusters.hpp"
#include "command/studies/conservation.hpp"
#include "command/studies/convergence.hpp"
#include "command/studies/extremes.hpp"
#include "command/studies/figure.hpp"
#include "command/studies/growth.hpp"
#include "command/studies/hanging_chain.hpp"
#include "command/studies/narrow_phases.hpp"
#include "command/studies/stacks.hpp"
#include "command/studies/trials.hpp"
