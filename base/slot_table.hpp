#pragma once
#include <cairn/id.hpp>

#include "base/check.hpp"
#include "base/index_set.hpp"

#include <utility>
#include <vector>

namespace cairn {

// A table whose elements keep their index until they are removed; freed slots are reused with a higher generation.
// Iteration is by index, in the same order on every run.
template <class T, class IdType>
class SlotTable {
public:
    // Ids of two tables whose first generations are far apart are told apart.
    explicit SlotTable(std::uint32_t firstGeneration = 0) : firstGeneration_(firstGeneration) {}

    IdType add(T value) {
        std::uint32_t index;
        if (free_.empty()) {
            index = static_cast<std::uint32_t>(slots_.size());
            slots_.push_back({std::move(value), firstGeneration_, true});
        } else {
            index = free_.back();
            free_.pop_back();
            slots_[index].value = std::move(value);
            slots_[index].used = true;
        }
        ++count_;
        living_.insert(index);
        return {index, slots_[index].generation};
    }

    bool contains(IdType id) const {
        return id.index < slots_.size() && slots_[id.index].used && slots_[id.index].generation == id.generation;
    }

    void remove(IdType id) {
        CAIRN_CHECK(contains(id), "stale id");
        Slot& slot = slots_[id.index];
        slot.value = T{};
        slot.used = false;
        ++slot.generation;
        free_.push_back(id.index);
        living_.erase(id.index);
        --count_;
    }

    bool used(std::size_t index) const { return index < slots_.size() && slots_[index].used; }
    IdType idAt(std::size_t index) const { return {static_cast<std::uint32_t>(index), slots_[index].generation}; }
    T& operator[](std::size_t index) { return slots_[index].value; }
    const T& operator[](std::size_t index) const { return slots_[index].value; }

    // Every element in use by its index, rising; what was removed takes no time. `visit` must not add or remove.
    template <class Visit>
    void forEach(Visit visit) const {
        for (std::size_t i = living_.find(0).index; i != IndexSet::none; i = living_.find(i + 1).index) {
            visit(i);
        }
    }

    std::size_t slotCount() const { return slots_.size(); }  // upper bound of the indices in use
    std::size_t count() const { return count_; }             // elements in use

private:
    struct Slot {
        [[no_unique_address]] T value;  // the others may lie in its padding
        std::uint32_t generation;
        bool used;
    };
    std::uint32_t firstGeneration_;
    std::vector<Slot> slots_;
    std::vector<std::uint32_t> free_;
    IndexSet living_;
    std::size_t count_ = 0;
};

}  // namespace cairn
