#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn {

// A set of small numbers, walked in rising order in a time that goes with how many are in it, however large they are
// or once were: bits, and above every 64 of their words a word that says which of them are not 0.
class IndexSet {
public:
    static constexpr std::size_t none = static_cast<std::size_t>(-1);

    void insert(std::size_t index) {
        for (std::size_t level = 0;; ++level) {
            if (level == levels_.size()) {
                levels_.emplace_back();
                if (level > 0) {
                    levels_[level].push_back(levels_[level - 1].front() != 0 ? 1 : 0);  // it was alone until now
                }
            }
            std::vector<std::uint64_t>& words = levels_[level];
            if (index / bits >= words.size()) {
                words.resize(index / bits + 1, 0);
            }
            words[index / bits] |= bit(index);
            if (words.size() == 1) {
                return;
            }
            index /= bits;
        }
    }

    void erase(std::size_t index) {
        for (std::vector<std::uint64_t>& words : levels_) {
            if (index / bits >= words.size() || (words[index / bits] &= ~bit(index)) != 0) {
                return;
            }
            index /= bits;
        }
    }

    // The first that is not under `from`, or none; and how many words it took to find it.
    struct Found {
        std::size_t index;
        int words;
    };
    Found find(std::size_t from) const {
        int looked = 0;
        std::size_t level = 0;
        // Up to where one follows, then down to it.
        while (true) {
            if (level == levels_.size() || from / bits >= levels_[level].size()) {
                return {none, looked};
            }
            ++looked;
            const std::uint64_t rest = levels_[level][from / bits] & (~std::uint64_t{0} << from % bits);
            if (rest != 0) {
                from = from / bits * bits + static_cast<std::size_t>(std::countr_zero(rest));
                break;
            }
            from = from / bits + 1;
            ++level;
        }
        for (; level > 0; --level) {
            ++looked;
            from = from * bits + static_cast<std::size_t>(std::countr_zero(levels_[level - 1][from]));
        }
        return {from, looked};
    }

private:
    static constexpr std::size_t bits = 64;
    static std::uint64_t bit(std::size_t index) { return std::uint64_t{1} << index % bits; }

    std::vector<std::vector<std::uint64_t>> levels_;
};

}  // namespace cairn
