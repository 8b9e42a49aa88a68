#pragma once
// Door of demos/recording: runs that are kept, made again, and looked at.
#include "command/recording/record.hpp"
#include "command/recording/replay.hpp"
#include "command/recording/view_page.hpp"
