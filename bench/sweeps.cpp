// What a visit of a contact point costs in a sweep over contacts of a colour, by each instruction set of the machine.
#include "engine/solve/kernels/contact_kernels.hpp"

#include <benchmark/benchmark.h>

#include <string>

namespace cairn {
namespace {

// As many bodies and contacts of four points as a pyramid of 60 rows has.
template <class S>
struct Contacts {
    static constexpr std::size_t width = ContactPack<S>::width;
    static constexpr std::size_t bodies = 1830;
    static constexpr std::size_t packCount = 3600 / width;

    Contacts() : packs(packCount), points(4 * packCount), twists(6 * bodies, S(0.01)), masses(7 * bodies) {
        for (std::size_t body = 0; body < bodies; ++body) {
            for (std::size_t k = 0; k < 4; ++k) {
                masses[7 * body + k] = S(1);
            }
        }
        for (std::size_t n = 0; n < packCount; ++n) {
            packs[n].firstRow = static_cast<std::uint32_t>(4 * n);
            packs[n].count = 4;
            packs[n].lanes = width;
            for (std::size_t lane = 0; lane < width; ++lane) {
                fill(n, lane);
            }
        }
    }
    void fill(std::size_t n, std::size_t lane) {
        using Index = typename ContactPack<S>::Index;
        ContactPack<S>& pack = packs[n];
        const std::size_t contact = width * n + lane;
        pack.bodyA[lane] = static_cast<Index>(2 * contact % bodies);
        pack.bodyB[lane] = static_cast<Index>((2 * contact + 1) % bodies);
        pack.movesA |= 1U << lane;
        pack.movesB |= 1U << lane;
        pack.contact[lane] = static_cast<std::uint32_t>(contact);
        pack.points[lane] = 4;
        pack.normal[1][lane] = pack.tangent1[0][lane] = pack.tangent2[2][lane] = pack.apart[1][lane] = S(1);
        for (std::size_t k = 0; k < 4; ++k) {
            PointPack<S>& point = points[pack.firstRow + k];
            point.armB[0][lane] = k < 2 ? S(-0.5) : S(0.5);
            point.armB[2][lane] = k % 2 == 0 ? S(-0.5) : S(0.5);
            point.armB[1][lane] = S(-0.5);
            point.C[lane] = S(-0.001);
            point.friction[lane] = S(0.5);
            point.impulse[0][lane] = S(0.1);
            for (std::size_t t = 0; t < 3; ++t) {
                point.delassus[t][lane] = S(3);
            }
        }
    }

    std::vector<ContactPack<S>> packs;
    std::vector<PointPack<S>> points;
    std::vector<S> twists, masses;
};

template <class S>
void sweep(benchmark::State& state, const ContactKernels<S>& kernels) {
    Contacts<S> contacts;
    std::vector<S> change(Contacts<S>::packCount * Contacts<S>::width);
    const ContactLanesView<S> view{
        contacts.packs.data(),  contacts.points.data(), nullptr, nullptr, nullptr, nullptr, nullptr,
        contacts.twists.data(), contacts.masses.data()};
    for (auto _ : state) {
        kernels.sweep(view, 0, Contacts<S>::packCount, S(1), change.data());
    }
    using benchmark::Counter;
    state.counters["a point"] =
        Counter(4 * static_cast<double>(change.size()), Counter::kIsIterationInvariantRate | Counter::kInvert);
}

template <class S>
bool addSweeps(const char* scalar) {
    for (const ContactKernels<S>& kernels : allContactKernels<S>()) {
        const std::string name = std::string("sweep/") + scalar + "/" + kernels.instructionSet;
        benchmark::RegisterBenchmark(name.c_str(), sweep<S>, kernels);
    }
    return true;
}

const bool isAdded = addSweeps<double>("double") && addSweeps<float>("float");

}  // namespace
}  // namespace cairn
