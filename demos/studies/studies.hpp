#pragma once
// Door of demos/studies: measurements of the engine's own solvers, and figures of them.
#include <cairn/demos/studies/budgets.hpp>
#include <cairn/demos/studies/clusters.hpp>
#include <cairn/demos/studies/conservation.hpp>
#include <cairn/demos/studies/convergence.hpp>
#include <cairn/demos/studies/extremes.hpp>
#include <cairn/demos/studies/figure.hpp>
#include <cairn/demos/studies/hanging_chain.hpp>
#include <cairn/demos/studies/stacks.hpp>
