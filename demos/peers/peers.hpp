#pragma once
// Door of demos/peers: one scene on Cairn and on other engines, judged by one formula from the poses of its bodies.
#include <cairn/demos/peers/comparison.hpp>
#include <cairn/demos/peers/errors.hpp>
#include <cairn/demos/peers/peer.hpp>
#include <cairn/demos/peers/peer_run.hpp>
