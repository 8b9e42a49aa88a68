#pragma once
// Door of demos/advice: what is hard about a scene, what is modelled and at what cost, and which settings serve it
// best.
#include "command/advice/bench.hpp"
#include "command/advice/check.hpp"
#include "command/advice/explain.hpp"
#include "command/advice/measure.hpp"
#include "command/advice/page.hpp"
#include "command/advice/tune.hpp"
#include "command/advice/tune_page.hpp"
