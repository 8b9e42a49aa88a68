#pragma once
// Door of demos/studies: measurements of the engine's own solvers, and figures of them.
#include <cairn/demos/studies/convergence.hpp>
#include <cairn/demos/studies/figure.hpp>
