#pragma once
// A recorded run as one page that plays it in a browser and shows its error beside it.
#include "command/recording/record.hpp"

namespace cairn {

// A whole HTML document that needs no network. Throws InputError as makeSimulation does.
std::string viewPage(const Recording& recording);

}  // namespace cairn
