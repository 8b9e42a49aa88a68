#include "base/base.hpp"

#include <gtest/gtest.h>

#include <set>

namespace cairn {
namespace {

struct ThingTag;
using ThingId = Id<ThingTag>;
using Things = SlotTable<std::string, ThingId>;

TEST(Id, defaultIsNull) {
    EXPECT_TRUE(ThingId{}.isNull());
    EXPECT_FALSE((ThingId{0, 0}.isNull()));
    EXPECT_FALSE(Things{}.contains(ThingId{}));
}

TEST(Id, isOrderedByIndexThenGeneration) {
    EXPECT_LT((ThingId{1, 9}), (ThingId{2, 0}));
    EXPECT_LT((ThingId{1, 0}), (ThingId{1, 1}));
    EXPECT_EQ((ThingId{1, 1}), (ThingId{1, 1}));
}

TEST(SlotTable, keepsWhatIsAdded) {
    Things things;
    const ThingId a = things.add("a");
    const ThingId b = things.add("b");
    EXPECT_EQ(things.count(), 2u);
    EXPECT_EQ(things.slotCount(), 2u);
    EXPECT_EQ(things[a.index], "a");
    EXPECT_EQ(things[b.index], "b");
    EXPECT_EQ(things.idAt(1), b);
    EXPECT_TRUE(things.used(1));
    EXPECT_FALSE(things.used(2));
}

TEST(SlotTable, staleIdIsCaughtThoughItsSlotIsUsedAgain) {
    Things things;
    const ThingId a = things.add("a");
    const ThingId b = things.add("b");
    things.remove(a);
    EXPECT_FALSE(things.contains(a));
    EXPECT_FALSE(things.used(a.index));
    EXPECT_EQ(things.count(), 1u);
    const ThingId c = things.add("c");
    EXPECT_EQ(c.index, a.index) << "a freed slot is used again";
    EXPECT_NE(c, a);
    EXPECT_FALSE(things.contains(a));
    EXPECT_TRUE(things.contains(c));
    EXPECT_TRUE(things.contains(b));
    EXPECT_EQ(things.slotCount(), 2u);
}

TEST(SlotTable, removalLetsTheValueGo) {
    SlotTable<std::shared_ptr<int>, ThingId> things;
    const auto value = std::make_shared<int>(3);
    const ThingId id = things.add(value);
    EXPECT_EQ(value.use_count(), 2);
    things.remove(id);
    EXPECT_EQ(value.use_count(), 1);
}

// What is left of 100,000 is found in a few looks each, in rising order.
TEST(IndexSet, WalksOverWhatIsLeft) {
    IndexSet set;
    EXPECT_EQ(set.find(0).index, IndexSet::none);
    const std::size_t most = 100000;
    for (std::size_t i = 0; i < most; ++i) {
        set.insert(i);
    }
    std::size_t next = 0;
    int words = 0;
    for (IndexSet::Found found = set.find(0); found.index != IndexSet::none; found = set.find(found.index + 1)) {
        EXPECT_EQ(found.index, next++);
        words += found.words;
    }
    EXPECT_EQ(next, most);
    EXPECT_LT(words, static_cast<int>(most + most / 16)) << "a full set is walked bit by bit";
    const std::set<std::size_t> left = {0, 63, 64, 4095, 4096, 5000, 70001, most - 1};
    for (std::size_t i = 0; i < most; ++i) {
        if (!left.contains(i)) {
            set.erase(i);
        }
    }
    auto expected = left.begin();
    for (IndexSet::Found found = set.find(0); found.index != IndexSet::none; found = set.find(found.index + 1)) {
        ASSERT_NE(expected, left.end());
        EXPECT_EQ(found.index, *expected++);
        EXPECT_LE(found.words, 5) << "up and down three levels";
    }
    EXPECT_EQ(expected, left.end());
    for (const std::size_t i : left) {
        set.erase(i);
    }
    EXPECT_EQ(set.find(0).index, IndexSet::none);
    EXPECT_LE(set.find(0).words, 3);
}

TEST(IndexSet, GrowsAboveWordsThatAreEmptyAgain) {
    IndexSet set;
    set.insert(5);
    set.erase(5);
    set.insert(9000);
    EXPECT_EQ(set.find(0).index, 9000u);
    EXPECT_EQ(set.find(9001).index, IndexSet::none);
}

TEST(SlotTable, ForEachMeetsWhatIsInUse) {
    Things things;
    std::vector<ThingId> ids;
    for (int i = 0; i < 300; ++i) {
        ids.push_back(things.add(std::to_string(i)));
    }
    for (std::size_t i = 0; i < ids.size(); ++i) {
        if (i % 70 != 3) {
            things.remove(ids[i]);
        }
    }
    const ThingId again = things.add("again");
    std::vector<std::size_t> met;
    things.forEach([&](std::size_t i) { met.push_back(i); });
    EXPECT_EQ(met, (std::vector<std::size_t>{3, 73, 143, 213, 283, again.index}));
}

TEST(SlotTableDeathTest, removingTwiceEndsTheProgram) {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    Things things;
    const ThingId id = things.add("a");
    things.remove(id);
    EXPECT_DEATH(things.remove(id), "slot_table.hpp:[0-9]+: check failed: contains\\(id\\) \\(stale id\\)");
}

}  // namespace
}  // namespace cairn
