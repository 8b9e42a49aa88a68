#pragma once
// What the fuzzers share: bytes read as calls and numbers, and claims that end the program where they do not hold.
#include <cairn/types.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

// libFuzzer's entry. A replay calls it with each file of a corpus.
// NOLINTNEXTLINE(readability-identifier-naming): the name by which it asks
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace cairn::fuzz {

inline void claim(bool holds, const char* what) {
    if (!holds) {
        std::fprintf(stderr, "does not hold: %s\n", what);
        std::abort();
    }
}

// All that is read beyond the end is 0.
class Input {
public:
    Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

    bool isEmpty() const { return left_ == 0; }
    std::uint8_t byte() {
        if (left_ == 0) {
            return 0;
        }
        --left_;
        return *data_++;
    }
    bool flag() { return (byte() & 1) != 0; }
    std::size_t below(std::size_t count) { return byte() % count; }

    // In [low, high], one of 65536.
    double within(double low, double high) {
        const unsigned word = byte() | static_cast<unsigned>(byte()) << 8;
        return low + (high - low) * word / 65535.0;
    }
    // Anything: mostly of ordinary size, else at the ends of what numbers can be.
    double anything() {
        static constexpr double infinity = std::numeric_limits<double>::infinity();
        static constexpr std::array<double, 24> edges = {
            0,     -0.0,  1,      -1,    1e-3,   1e3,      1e6,       -1e6,
            1e7,   1e9,   -1e9,   1e12,  1e15,   1e30,     3e38,      -3e38,
            1e150, 1e308, -1e308, 1e-30, 1e-308, infinity, -infinity, std::numeric_limits<double>::quiet_NaN()};
        const std::uint8_t kind = byte();
        if (kind < 176) {
            return within(-8, 8);
        }
        if (kind < 240) {
            return edges[below(edges.size())];
        }
        std::uint64_t bits = 0;
        for (int k = 0; k < 8; ++k) {
            bits = bits << 8 | byte();
        }
        double number = 0;
        std::memcpy(&number, &bits, sizeof number);
        return number;
    }
    Vec3d vectorWithin(double size) {
        const double x = within(-size, size);
        const double y = within(-size, size);
        return {x, y, within(-size, size)};
    }
    Quatd rotation() {
        const Vec3d v = vectorWithin(1);
        const double w = within(-1, 1);
        const Quatd q(w, v.x(), v.y(), v.z());
        return q.norm() > 0.01 ? q.normalized() : Quatd::Identity();
    }

private:
    const std::uint8_t* data_;
    std::size_t left_;
};

}  // namespace cairn::fuzz
