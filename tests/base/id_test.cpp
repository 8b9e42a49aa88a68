#include "base/base.hpp"

#include <gtest/gtest.h>

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

TEST(SlotTableDeathTest, removingTwiceEndsTheProgram) {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    Things things;
    const ThingId id = things.add("a");
    things.remove(id);
    EXPECT_DEATH(things.remove(id), "slot_table.hpp:[0-9]+: check failed: contains\\(id\\) \\(stale id\\)");
}

}  // namespace
}  // namespace cairn
