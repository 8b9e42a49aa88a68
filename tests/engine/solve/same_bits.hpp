#pragma once
// Kernels over lanes of one problem: every instruction set of this machine against the first.
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace cairn {

// `Input` is made of random numbers, with `twists` of its bodies, of which number 0 is fixed, and has an `answer` by
// `Kernels`, whose number is S.
template <class S, class Input, class Kernels>
void expectSameBits(const std::vector<Kernels>& all, TestRandom random) {
    ASSERT_GE(all.size(), 2U);
    for (int trial = 0; trial < 20; ++trial) {
        const Input start(random);
        std::vector<S> first;
        for (const Kernels& kernels : all) {
            Input input = start;
            const std::vector<S> answer = input.answer(kernels);
            EXPECT_TRUE(std::none_of(answer.begin(), answer.end(), [](S x) { return std::isnan(x); }));
            EXPECT_NE(input.twists, start.twists);
            EXPECT_TRUE(std::equal(start.twists.begin(), start.twists.begin() + 6, input.twists.begin()));
            first = first.empty() ? answer : first;
            ASSERT_EQ(answer.size(), first.size());
            EXPECT_EQ(std::memcmp(answer.data(), first.data(), answer.size() * sizeof(S)), 0)
                << kernels.instructionSet << " and " << all.front().instructionSet;
        }
    }
}

}  // namespace cairn
