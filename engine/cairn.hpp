#pragma once
// Everything a game needs: #include <cairn/cairn.hpp>, link cairn::cairn.
#include <cairn/engine/engine.hpp>
