#pragma once
#include <cstddef>
#include <vector>

namespace cairn {

// As items.resize(count), which may take twice the room that is asked for: here it is at most a sixteenth more.
template <class T>
void resizeClosely(std::vector<T>& items, std::size_t count) {
    if (count > items.capacity()) {
        items.reserve(count + count / 16);
    }
    items.resize(count);
}

}  // namespace cairn
