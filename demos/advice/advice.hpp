#pragma once
// Door of demos/advice: what is hard about a scene, what is modelled and at what cost, and which settings serve it
// best.
#include <cairn/demos/advice/bench.hpp>
#include <cairn/demos/advice/check.hpp>
#include <cairn/demos/advice/explain.hpp>
#include <cairn/demos/advice/measure.hpp>
#include <cairn/demos/advice/page.hpp>
#include <cairn/demos/advice/tune.hpp>
#include <cairn/demos/advice/tune_page.hpp>
