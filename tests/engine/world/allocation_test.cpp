// A step in a steady state asks for no memory, and what has settled gives back what its solution took. Counted are
// calls of operator new; bench/core counts those of malloc.
#include "tests/engine/engine_kit.hpp"

#include <gtest/gtest.h>

#include <malloc.h>

#include <atomic>
#include <new>

namespace {

std::atomic<long> allocations = 0;
std::atomic<long> inUse = 0;  // bytes

void* allocate(std::size_t size, std::size_t alignment) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    void* const room = alignment <= alignof(std::max_align_t)
                           ? std::malloc(size)
                           : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (room == nullptr) {
        throw std::bad_alloc();
    }
    inUse.fetch_add(static_cast<long>(malloc_usable_size(room)), std::memory_order_relaxed);
    return room;
}

// Not inlined: g++ would see a free() of what a new gave, and warn of it.
[[gnu::noinline]] void release(void* room) {
    inUse.fetch_sub(static_cast<long>(malloc_usable_size(room)), std::memory_order_relaxed);
    std::free(room);
}

}  // namespace

void* operator new(std::size_t size) {
    return allocate(size, 0);
}
// Left to the library it would come from elsewhere under a sanitizer, which minds that release() takes it back.
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
    try {
        return allocate(size, 0);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* room) noexcept {
    release(room);
}
void operator delete(void* room, const std::nothrow_t& /*tag*/) noexcept {
    release(room);
}
void operator delete(void* room, std::size_t) noexcept {
    release(room);
}
void operator delete(void* room, std::align_val_t) noexcept {
    release(room);
}
void operator delete(void* room, std::size_t, std::align_val_t) noexcept {
    release(room);
}

namespace cairn {
namespace {

// Calls of operator new in the last of some steps.
long allocationsOf(Worldd& world, int steps) {
    for (int k = 0; k < steps; ++k) {
        world.step(1.0 / 60);
    }
    const long before = allocations;
    world.step(1.0 / 60);
    return allocations - before;
}

TEST(Allocations, AGridThatRestsAsksForNone) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    for (int i = 0; i < 400; ++i) {
        const int row = i / 20;
        addBox(world, Vec3d(2 * (i % 20), 0.5, 2 * row));
    }
    EXPECT_EQ(allocationsOf(world, 60), 0);
    EXPECT_EQ(world.report().counts.settledIslands, 400);
}

TEST(Allocations, APyramidThatRestsAsksForNone) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    for (int row = 0; row < 8; ++row) {
        for (int i = 0; i < 8 - row; ++i) {
            addBox(world, Vec3d((i + 0.5 * row) * 1.1, 0.5 + row, 0));
        }
    }
    EXPECT_EQ(allocationsOf(world, 120), 0);
    EXPECT_EQ(world.report().counts.settledIslands, 1);
}

TEST(Allocations, WhatHasSettledGivesBackWhatItsSolutionTook) {
    Worldd world({.sleep = {.enabled = false}});
    addFloor(world);
    constexpr int rows = 40;
    for (int row = 0; row < rows; ++row) {
        for (int i = 0; i < rows - row; ++i) {
            addBox(world, Vec3d((i + 0.5 * row) * 1.1, 0.5 + row, 0));
        }
    }
    const long built = inUse;
    world.step(1.0 / 60);
    const long solved = inUse - built;
    int steps = 0;
    while (world.report().counts.settledIslands == 0 && ++steps < 100) {
        world.step(1.0 / 60);
    }
    ASSERT_LT(steps, 100);
    for (int k = 0; k < 65; ++k) {
        world.step(1.0 / 60);
    }
    EXPECT_EQ(world.report().counts.settledIslands, 1);
    const long rested = inUse - built;
    const int points = world.report().counts.contacts;
    expectBelow("bytes a contact point", static_cast<double>(rested) / points, 600);
    expectBelow("share of what it took", static_cast<double>(rested) / static_cast<double>(solved), 0.25);
}

TEST(Allocations, ASolvedStepOfBoxesUnderSweepsAsksForNone) {
    Worldd world({.solver = GaussSeidelDef{}, .sleep = {.enabled = false}});
    addFloor(world);
    for (int i = 0; i < 5; ++i) {
        addBox(world, Vec3d(0, 0.5 + i, 0));
    }
    EXPECT_EQ(allocationsOf(world, 120), 0);
    EXPECT_EQ(world.report().counts.settledIslands, 0);
}

}  // namespace
}  // namespace cairn
