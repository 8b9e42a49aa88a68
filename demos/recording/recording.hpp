#pragma once
// Door of demos/recording: runs that are kept, made again, and looked at.
#include <cairn/demos/recording/record.hpp>
#include <cairn/demos/recording/replay.hpp>
#include <cairn/demos/recording/view_page.hpp>
