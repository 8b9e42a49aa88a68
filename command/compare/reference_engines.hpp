#pragma once
// Door of demos/reference_engines: one scene on Cairn and on other engines, judged by one formula from the poses of its
// bodies.
#include "command/compare/comparison.hpp"
#include "command/compare/errors.hpp"
#include "command/compare/reference_engine.hpp"
#include "command/compare/reference_run.hpp"
