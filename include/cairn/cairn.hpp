#pragma once
// Everything a game needs: #include <cairn/cairn.hpp>, link cairn::cairn.
#include <cairn/deformable.hpp>
#include <cairn/solvers.hpp>
#include <cairn/version.hpp>
#include <cairn/world.hpp>
