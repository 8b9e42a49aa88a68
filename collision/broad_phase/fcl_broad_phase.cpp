#include "base/base.hpp"
#include "base/parallel.hpp"
#include "collision/broad_phase/broad_phase.hpp"
#include "collision/broad_phase/fcl_box_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

namespace cairn {

namespace {

using Node = BoxTree::Node;

// A fat box that reaches this many margins beyond a fresh one is taken back (a fast body that has stopped).
constexpr double spareMargins = 4;
// So many steps' motion a fresh box reaches ahead: of 3000 boxes in flight a step takes 8 % less than with one, and
// with three no less again.
constexpr double stepsAhead = 2;
// How many ask in one job at least, and how many jobs an update is cut into at most; the cut is the same for any number
// of threads.
constexpr std::size_t asksPerJob = 32;
constexpr std::size_t maxJobs = 64;

// What is true of a proxy, in one byte: the walks read these at random.
namespace flag {
constexpr std::uint8_t isThere = 1;
constexpr std::uint8_t isStatic = 2;
constexpr std::uint8_t rests = 4;
constexpr std::uint8_t isEndless = 8;  // has a side at infinity: in a list, not in a tree
constexpr std::uint8_t isMoved = 16;   // its box is newer than the tree's copy
constexpr std::uint8_t isAskedFor = 32;
}  // namespace flag

void checkBox(const Aabb& box) {
    // Written so that NaN fails.
    CAIRN_CHECK((box.min.array() <= box.max.array()).all(), "a box must be ordered and free of NaN");
}

// The order of pairs in one comparison, as an update makes some for every pair there is; no function, as sorting would
// call that by its address.
constexpr auto inOrder = [](const ProxyPair& p, const ProxyPair& q) {
    const auto key = [](const ProxyPair& pair) { return std::uint64_t{pair.a} << 32 | pair.b; };
    return key(p) < key(q);
};

// Merges `more` into `into`, both sorted, with no room beside.
void mergeInto(std::vector<ProxyPair>& into, const std::vector<ProxyPair>& more) {
    std::size_t left = into.size();
    into.resize(left + more.size());
    std::size_t to = into.size();
    for (std::size_t i = more.size(); i > 0; --i) {
        while (left > 0 && inOrder(more[i - 1], into[left - 1])) {
            into[--to] = into[--left];
        }
        into[--to] = more[i - 1];
    }
}

}  // namespace

struct BroadPhase::Impl {
    // What one job of an update finds, and its room to work in; on cache lines of its own.
    struct alignas(64) Finder {
        std::vector<ProxyPair> ahead;   // of who asks with a higher id: in order
        std::vector<ProxyPair> behind;  // of who asks with a lower id: in the order of b
        std::vector<const Node*> open;
        std::vector<std::uint64_t> marks;  // a bit for each id; all 0 between calls
    };

    double margin;
    std::function<bool(ProxyId, ProxyId)> mayCollide;
    // By id.
    std::vector<Node*> leaves;  // with the fat boxes; not in a tree yet where new, and never where endless
    std::vector<std::uint8_t> flags;

    std::vector<ProxyId> endless;  // in the order they came
    BoxTree moving;
    BoxTree still;
    std::vector<ProxyId> toAsk;  // whose pairs are to be found anew by the next update
    bool someMoved = false;      // boxes are newer than the trees' copies
    bool someCameToRest = false;
    std::vector<ProxyPair> pairs;
    std::size_t reinserted = 0;

    // Kept so that an update like the last one allocates nothing.
    std::vector<ProxyId> changedMoving;
    std::vector<ProxyId> changedStill;
    std::vector<Finder> finders;
    std::vector<ProxyPair> ahead;
    std::vector<ProxyPair> behind;
    std::vector<ProxyPair> behindInOrder;
    std::vector<std::uint32_t> firstOf;

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        for (ProxyId id = 0; id < leaves.size(); ++id) {
            if (leaves[id] && !treeOf(id).holds(leaves[id])) {
                delete leaves[id];
            }
        }
    }

    bool has(ProxyId id, std::uint8_t which) const { return (flags[id] & which) != 0; }
    void set(ProxyId id, std::uint8_t which) { flags[id] = static_cast<std::uint8_t>(flags[id] | which); }
    void clear(ProxyId id, std::uint8_t which) { flags[id] = static_cast<std::uint8_t>(flags[id] & ~which); }
    BoxTree& treeOf(ProxyId id) { return has(id, flag::isStatic) ? still : moving; }
    void check(ProxyId id) const { CAIRN_CHECK(id < flags.size() && has(id, flag::isThere), "no such proxy"); }

    void ask(ProxyId id) {
        if (!has(id, flag::isAskedFor)) {
            set(id, flag::isAskedFor);
            toAsk.push_back(id);
        }
    }

    Aabb fat(ProxyId id) const { return BoxTree::boxOf(leaves[id]); }

    void dropLeaf(ProxyId id) {
        Node* const leaf = std::exchange(leaves[id], nullptr);
        if (leaf && treeOf(id).holds(leaf)) {
            treeOf(id).remove(leaf);
        } else {
            delete leaf;
        }
    }

    Aabb fresh(const Aabb& tight, const Vec3d& displacement) const {
        Aabb box = tight.grown(margin);
        box.min += stepsAhead * displacement.cwiseMin(0.0);
        box.max += stepsAhead * displacement.cwiseMax(0.0);
        return box;
    }

    // Its fat box holds the tight one, and is not much larger than a fresh one.
    bool stays(ProxyId id, const Aabb& tight, const Vec3d& displacement) const {
        const Aabb old = fat(id);
        return old.contains(tight) && fresh(tight, displacement).grown(spareMargins * margin).contains(old);
    }

    void place(ProxyId id, const Aabb& box) {
        const bool endsNowhere = !box.isFinite();
        if (endsNowhere != has(id, flag::isEndless)) {
            if (endsNowhere) {
                set(id, flag::isEndless);
                endless.push_back(id);
                dropLeaf(id);
            } else {
                clear(id, flag::isEndless);
                std::erase(endless, id);
            }
        }
        if (!leaves[id]) {
            leaves[id] = BoxTree::makeLeaf(id);
        }
        BoxTree::setBox(leaves[id], box);
        set(id, flag::isMoved);
        someMoved = true;
        ask(id);
    }

    // To be asked for a whose box overlaps b's.
    void add(ProxyId a, ProxyId b, Finder& out) const {
        const std::uint8_t ofB = flags[b];
        // Of two that both ask, the lower finds the pair.
        if (a == b || (flags[a] & ofB & flag::rests) != 0 || ((ofB & flag::isAskedFor) != 0 && b < a)) {
            return;
        }
        const ProxyPair pair{std::min(a, b), std::max(a, b)};
        if (!mayCollide || mayCollide(pair.a, pair.b)) {
            (a < b ? out.ahead : out.behind).push_back(pair);
        }
    }

    void findPartners(ProxyId id, Finder& out) const {
        const auto first = static_cast<std::ptrdiff_t>(out.ahead.size());
        const auto firstBehind = static_cast<std::ptrdiff_t>(out.behind.size());
        const Aabb box = fat(id);
        const auto meet = [&](ProxyId other) { add(id, other, out); };
        const auto meetOverlapping = [&](ProxyId other) {
            if (box.overlaps(fat(other))) {
                meet(other);
            }
        };
        if (has(id, flag::isEndless)) {
            for (ProxyId other = 0; other < flags.size(); ++other) {
                if (has(other, flag::isThere)) {
                    meetOverlapping(other);
                }
            }
        } else {
            moving.visit(box, out.open, meet);
            if (!has(id, flag::rests)) {
                still.visit(box, out.open, meet);
            }
            std::for_each(endless.begin(), endless.end(), meetOverlapping);
        }
        order({out.ahead.begin() + first, out.ahead.end()}, &ProxyPair::b, out.marks);
        order({out.behind.begin() + firstBehind, out.behind.end()}, &ProxyPair::a, out.marks);
    }

    // Sorts pairs that differ in `which` alone.
    void order(std::span<ProxyPair> some, ProxyId ProxyPair::*which, std::vector<std::uint64_t>& marks) const {
        constexpr std::size_t bits = 64;
        if (some.size() < bits || some.size() < flags.size() / bits) {
            std::sort(some.begin(), some.end(), inOrder);
            return;
        }
        // So many of a crowd are put in order as they are counted.
        marks.resize(flags.size() / bits + 1, 0);
        for (const ProxyPair& pair : some) {
            marks[pair.*which / bits] |= std::uint64_t{1} << pair.*which % bits;
        }
        std::size_t to = 0;
        for (std::size_t word = 0; word < marks.size(); ++word) {
            for (std::uint64_t left = std::exchange(marks[word], 0); left != 0; left &= left - 1) {
                some[to++].*which = static_cast<ProxyId>(word * bits) + static_cast<ProxyId>(std::countr_zero(left));
            }
        }
    }

    // Calls f(id) for all that the trees do not know where they are: the endless, and who moved since the last update.
    template <class F>
    void forEachOutside(F f) const {
        for (const ProxyId id : endless) {
            if (!has(id, flag::isMoved)) {
                f(id);
            }
        }
        if (!someMoved) {
            return;
        }
        for (const ProxyId id : toAsk) {
            if (has(id, flag::isThere) && has(id, flag::isMoved)) {
                f(id);
            }
        }
    }

    void reinsert() {
        someMoved = false;
        changedMoving.clear();
        changedStill.clear();
        for (const ProxyId id : toAsk) {
            if (has(id, flag::isThere) && has(id, flag::isMoved)) {
                ++reinserted;
                clear(id, flag::isMoved);
                if (!has(id, flag::isEndless)) {
                    (has(id, flag::isStatic) ? changedStill : changedMoving).push_back(id);
                }
            }
        }
        moving.update(changedMoving, leaves);
        still.update(changedStill, leaves);
    }

    // Brings `behind`, which is in the order of b, into that of a.
    void orderBehind() {
        if (behind.size() < flags.size() / 8) {
            std::sort(behind.begin(), behind.end(), inOrder);
            return;
        }
        firstOf.assign(flags.size() + 1, 0);
        for (const ProxyPair& pair : behind) {
            ++firstOf[pair.a + std::size_t{1}];
        }
        for (std::size_t i = 1; i < firstOf.size(); ++i) {
            firstOf[i] += firstOf[i - 1];
        }
        behindInOrder.resize(behind.size());
        for (const ProxyPair& pair : behind) {
            behindInOrder[firstOf[pair.a]++] = pair;
        }
        behind.swap(behindInOrder);
    }

    void find(JobSystem* jobs) {
        const std::size_t perJob = std::max(asksPerJob, (toAsk.size() + maxJobs - 1) / maxJobs);
        const std::size_t count = (toAsk.size() + perJob - 1) / perJob;
        if (finders.size() < count) {
            finders.resize(count);
        }
        const auto findSome = [&](std::size_t k) {
            Finder& out = finders[k];
            out.ahead.clear();
            out.behind.clear();
            for (std::size_t i = k * perJob; i < std::min((k + 1) * perJob, toAsk.size()); ++i) {
                if (has(toAsk[i], flag::isThere)) {
                    findPartners(toAsk[i], out);
                }
            }
        };
        if (jobs) {
            parallelFor(*jobs, count, 1, findSome);
        } else {
            for (std::size_t k = 0; k < count; ++k) {
                findSome(k);
            }
        }
        ahead.clear();
        behind.clear();
        for (std::size_t k = 0; k < count; ++k) {
            ahead.insert(ahead.end(), finders[k].ahead.begin(), finders[k].ahead.end());
            behind.insert(behind.end(), finders[k].behind.begin(), finders[k].behind.end());
        }
        orderBehind();
    }

    void update(JobSystem* jobs) {
        reinserted = 0;
        if (toAsk.empty() && !someCameToRest) {
            return;
        }
        if (!std::is_sorted(toAsk.begin(), toAsk.end())) {
            std::sort(toAsk.begin(), toAsk.end());
        }
        reinsert();
        find(jobs);
        std::erase_if(pairs, [&](const ProxyPair& pair) {
            const std::uint8_t a = flags[pair.a];
            const std::uint8_t b = flags[pair.b];
            return ((a | b) & flag::isAskedFor) != 0 || (a & b & flag::rests) != 0;
        });
        mergeInto(ahead, behind);
        if (pairs.empty() && ahead.size() > flags.size()) {
            // A world that begins: no later update needs that much room.
            pairs.swap(ahead);
            finders.clear();
            behind = {};
            behindInOrder = {};
            changedMoving = {};
        } else {
            mergeInto(pairs, ahead);
        }
        for (const ProxyId id : toAsk) {
            clear(id, flag::isAskedFor);
        }
        toAsk.clear();
        someCameToRest = false;
    }
};

BroadPhase::BroadPhase(double fatMargin) : impl_(std::make_unique<Impl>()) {
    if (!std::isfinite(fatMargin) || fatMargin < 0) {
        throw InputError("fatMargin", std::to_string(fatMargin), "give a finite length >= 0 in m");
    }
    impl_->margin = fatMargin;
}

BroadPhase::~BroadPhase() = default;
BroadPhase::BroadPhase(BroadPhase&&) noexcept = default;
BroadPhase& BroadPhase::operator=(BroadPhase&&) noexcept = default;

void BroadPhase::setFilter(std::function<bool(ProxyId, ProxyId)> mayCollide) {
    impl_->mayCollide = std::move(mayCollide);
    for (ProxyId id = 0; id < impl_->flags.size(); ++id) {
        if (impl_->has(id, flag::isThere)) {
            impl_->ask(id);
        }
    }
}

void BroadPhase::add(ProxyId id, const Aabb& tight, bool isStatic) {
    CAIRN_CHECK(!contains(id), "the proxy is there already");
    checkBox(tight);
    if (id >= impl_->flags.size()) {
        impl_->leaves.resize(id + std::size_t{1}, nullptr);
        impl_->flags.resize(id + std::size_t{1}, 0);
    }
    impl_->set(id, flag::isThere);
    if (isStatic) {
        impl_->set(id, flag::isStatic | flag::rests);
    }
    impl_->place(id, tight.grown(impl_->margin));
}

void BroadPhase::remove(ProxyId id) {
    impl_->check(id);
    if (impl_->has(id, flag::isEndless)) {
        std::erase(impl_->endless, id);
    }
    impl_->dropLeaf(id);
    impl_->ask(id);
    impl_->flags[id] = flag::isAskedFor;
}

bool BroadPhase::contains(ProxyId id) const {
    return id < impl_->flags.size() && impl_->has(id, flag::isThere);
}

bool BroadPhase::needsMove(ProxyId id, const Aabb& tight, const Vec3d& displacement) const {
    impl_->check(id);
    return !impl_->stays(id, tight, displacement);
}

bool BroadPhase::holds(ProxyId id, const Aabb& box) const {
    impl_->check(id);
    return impl_->fat(id).contains(box);
}

bool BroadPhase::overlaps(ProxyId id, const Aabb& box) const {
    return impl_->fat(id).overlaps(box);
}

void BroadPhase::move(ProxyId id, const Aabb& tight, const Vec3d& displacement) {
    checkBox(tight);
    CAIRN_CHECK(displacement.allFinite(), "a sweep must be finite");
    if (needsMove(id, tight, displacement)) {
        impl_->place(id, impl_->fresh(tight, displacement));
    }
}

void BroadPhase::refilter(ProxyId id) {
    impl_->check(id);
    impl_->ask(id);
}

void BroadPhase::setResting(ProxyId id, bool rests) {
    impl_->check(id);
    CAIRN_CHECK(rests || !impl_->has(id, flag::isStatic), "a static body flag::rests");
    if (rests == impl_->has(id, flag::rests)) {
        return;
    }
    if (rests) {
        // Who comes to rest gains no pair, so nothing has to be asked.
        impl_->set(id, flag::rests);
        impl_->someCameToRest = true;
    } else {
        impl_->clear(id, flag::rests);
        impl_->ask(id);
    }
}

void BroadPhase::update(JobSystem& jobs) {
    impl_->update(&jobs);
}

void BroadPhase::update() {
    impl_->update(nullptr);
}

const std::vector<ProxyPair>& BroadPhase::pairs() const {
    return impl_->pairs;
}

std::vector<ProxyId> BroadPhase::query(const Aabb& region) const {
    std::vector<ProxyId> ids;
    forEachIn(region, [&](ProxyId id) { ids.push_back(id); });
    std::sort(ids.begin(), ids.end());
    return ids;
}

void BroadPhase::forEachIn(const Aabb& region, FunctionRef<void(ProxyId)> visit) const {
    checkBox(region);
    const Impl& impl = *impl_;
    // What has moved since the last update is asked one by one, as the trees know its old box only.
    const auto meetUnmoved = [&](ProxyId id) {
        if (!impl.has(id, flag::isMoved)) {
            visit(id);
        }
    };
    static thread_local std::vector<const Node*> open;
    impl.moving.visit(region, open, meetUnmoved);
    impl.still.visit(region, open, meetUnmoved);
    impl.forEachOutside([&](ProxyId id) {
        if (impl.fat(id).overlaps(region)) {
            visit(id);
        }
    });
}

// measure(low, high, limit): how far a box is along the walk, infinite where it is out of it.
template <class Measure>
void BroadPhase::walk(double limit, Measure measure, Visitor visit) const {
    const Impl& impl = *impl_;
    impl.forEachOutside([&](ProxyId id) {
        const Aabb box = impl.fat(id);
        const double bound = measure(box.min, box.max, limit);
        if (bound <= limit && !std::isinf(bound)) {
            limit = visit(id, limit);
        }
    });
    const auto meetUnmoved = [&](ProxyId id, double within) {
        return impl.has(id, flag::isMoved) ? within : visit(id, within);
    };
    limit = impl.moving.walk(limit, measure, meetUnmoved);
    impl.still.walk(limit, measure, meetUnmoved);
}

void BroadPhase::cast(const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents, double limit,
                      Visitor visit) const {
    const MovingBox moving(origin, motion, halfExtents);
    walk(
        limit, [&](const Vec3d& low, const Vec3d& high, double within) { return moving.entry(low, high, within); },
        visit);
}

void BroadPhase::near(const Aabb& box, Visitor visit, double limit) const {
    walk(
        limit, [&](const Vec3d& low, const Vec3d& high, double) { return boxDistance(box, low, high); }, visit);
}

std::size_t BroadPhase::lastReinserted() const {
    return impl_->reinserted;
}

}  // namespace cairn
