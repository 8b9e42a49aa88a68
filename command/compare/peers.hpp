#pragma once
// Door of demos/peers: one scene on Cairn and on other engines, judged by one formula from the poses of its bodies.
#include "command/compare/comparison.hpp"
#include "command/compare/errors.hpp"
#include "command/compare/peer.hpp"
#include "command/compare/peer_run.hpp"
