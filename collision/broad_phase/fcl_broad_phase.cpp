#include "base/base.hpp"
#include "collision/broad_phase/broad_phase.hpp"
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/fcl_layout.hpp"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace cairn {

namespace {

using Manager = fcl::DynamicAABBTreeCollisionManager<double>;
using Node = fcl::detail::NodeBase<fcl::AABB<double>>;

// A fat box that reaches this many margins beyond a fresh one is taken back (a fast body that has stopped).
constexpr double spareMargins = 4;
// New boxes are given to a tree one by one up to this many: a sorted row of them makes a chain, and FCL recurses.
constexpr std::size_t addOneByOne = 256;

// FCL's object with a box of our own, because its computeAABB() is that of the bounding sphere. It has no geometry, as
// only the box is ever asked for.
struct Proxy : fcl::CollisionObject<double> {
    Proxy(ProxyId proxyId, bool neverMoves)
        : fcl::CollisionObject<double>(std::shared_ptr<fcl::CollisionGeometry<double>>()),
          id(proxyId),
          isStatic(neverMoves),
          rests(neverMoves) {}

    Aabb fat() const { return {aabb.min_, aabb.max_}; }
    void setFat(const Aabb& box) {
        aabb.min_ = box.min;
        aabb.max_ = box.max;
    }

    ProxyId id;
    bool isStatic;
    bool rests;
    bool isEndless = false;  // has a side at infinity: in a list, not in a tree
    bool inTree = false;
    bool isMoved = false;    // its box is newer than the tree's copy
    bool hasShrunk = false;  // FCL's update() keeps the old box where it holds the new one
};

class Tree {
public:
    void remove(Proxy& proxy) {
        manager_->unregisterObject(&proxy);
        proxy.inTree = false;
    }

    // changed: this tree's proxies with new boxes; those not in the tree yet are added.
    void update(const std::vector<Proxy*>& changed) {
        if (changed.empty()) {
            return;
        }
        std::vector<fcl::CollisionObject<double>*> added;
        std::vector<fcl::CollisionObject<double>*> moved;
        for (Proxy* proxy : changed) {
            if (proxy->inTree && proxy->hasShrunk) {
                remove(*proxy);
            }
            (proxy->inTree ? moved : added).push_back(proxy);
            proxy->inTree = true;
        }
        if (added.size() > std::min(addOneByOne, manager_->size() / 4)) {
            rebuild(std::move(added));
        } else {
            for (fcl::CollisionObject<double>* proxy : added) {
                manager_->registerObject(proxy);
            }
        }
        // update() rebuilds from the top when the height exceeds log2 n by this, so at about 2 log2 n.
        manager_->max_tree_nonbalanced_level = std::max(4, static_cast<int>(std::bit_width(manager_->size())));
        manager_->update(moved);
    }

    // Calls f(const Proxy&) for all whose boxes, as the tree knows them, overlap `box`.
    template <class F>
    void visit(const fcl::AABB<double>& box, std::vector<const Node*>& open, F f) const {
        if (manager_->empty()) {
            return;
        }
        open.assign(1, manager_->getTree().getRoot());
        while (!open.empty()) {
            const Node* node = open.back();
            open.pop_back();
            if (!node->bv.overlap(box)) {
                continue;
            }
            if (node->isLeaf()) {
                f(*static_cast<Proxy*>(static_cast<fcl::CollisionObject<double>*>(node->data)));
            } else {
                open.push_back(node->children[1]);
                open.push_back(node->children[0]);
            }
        }
    }

    // Calls f(proxy, limit) for the leaves by their measure, the nearer first; answers the last limit.
    template <class Measure, class F>
    double walk(double limit, Measure measure, F f) const {
        if (manager_->empty()) {
            return limit;
        }
        return walkNearest(
            static_cast<const Node*>(manager_->getTree().getRoot()), limit,
            [&](const Node* node, double within) { return measure(node->bv.min_, node->bv.max_, within); },
            [](const Node* node) { return node->isLeaf(); },
            [](const Node* node, int side) -> const Node* { return node->children[side]; },
            [&](const Node* node, double within) {
                return f(*static_cast<Proxy*>(static_cast<fcl::CollisionObject<double>*>(node->data)), within);
            });
    }

private:
    // FCL's own list of objects is ordered by address; the leaves are in the same order on every run.
    void rebuild(std::vector<fcl::CollisionObject<double>*> added) {
        const double huge = std::numeric_limits<double>::infinity();
        std::vector<fcl::CollisionObject<double>*> all;
        std::vector<const Node*> open;
        visit({Vec3d::Constant(-huge), Vec3d::Constant(huge)}, open, [&](Proxy& proxy) { all.push_back(&proxy); });
        all.insert(all.end(), added.begin(), added.end());
        manager_ = std::make_unique<Manager>();
        manager_->registerObjects(all);
    }

    std::unique_ptr<Manager> manager_ = std::make_unique<Manager>();
};

void checkBox(const Aabb& box) {
    // Written so that NaN fails.
    CAIRN_CHECK((box.min.array() <= box.max.array()).all(), "a box must be ordered and free of NaN");
}

}  // namespace

struct BroadPhase::Impl {
    double margin;
    std::function<bool(ProxyId, ProxyId)> mayCollide;
    std::vector<std::unique_ptr<Proxy>> proxies;  // by id
    std::vector<Proxy*> endless;                  // in the order they came
    Tree moving;
    Tree still;
    std::vector<ProxyId> toAsk;            // whose pairs are to be found anew by the next update
    std::vector<std::uint8_t> isAskedFor;  // by id: whether it is in toAsk
    std::vector<ProxyPair> pairs;
    std::vector<ProxyPair> found;
    std::vector<const Node*> open;
    std::size_t reinserted = 0;

    Tree& treeOf(const Proxy& proxy) { return proxy.isStatic ? still : moving; }

    Proxy& at(ProxyId id) {
        CAIRN_CHECK(id < proxies.size() && proxies[id], "no such proxy");
        return *proxies[id];
    }

    void ask(ProxyId id) {
        if (!isAskedFor[id]) {
            isAskedFor[id] = 1;
            toAsk.push_back(id);
        }
    }

    void place(Proxy& proxy, const Aabb& fat) {
        proxy.setFat(fat);
        const bool isEndless = !fat.isFinite();
        if (isEndless != proxy.isEndless) {
            proxy.isEndless = isEndless;
            if (isEndless) {
                endless.push_back(&proxy);
                if (proxy.inTree) {
                    treeOf(proxy).remove(proxy);
                }
            } else {
                std::erase(endless, &proxy);
            }
        }
        proxy.isMoved = true;
        ask(proxy.id);
    }

    void add(const Proxy& a, const Proxy& b) {
        // Of two that both ask, the lower finds the pair.
        if (a.id == b.id || (a.rests && b.rests) || (isAskedFor[b.id] && b.id < a.id)) {
            return;
        }
        const ProxyPair pair{std::min(a.id, b.id), std::max(a.id, b.id)};
        if (a.getAABB().overlap(b.getAABB()) && (!mayCollide || mayCollide(pair.a, pair.b))) {
            found.push_back(pair);
        }
    }

    void findPartners(const Proxy& proxy) {
        if (proxy.isEndless) {
            for (const std::unique_ptr<Proxy>& other : proxies) {
                if (other) {
                    add(proxy, *other);
                }
            }
            return;
        }
        const auto meet = [&](const Proxy& other) { add(proxy, other); };
        moving.visit(proxy.getAABB(), open, meet);
        if (!proxy.rests) {
            still.visit(proxy.getAABB(), open, meet);
        }
        for (const Proxy* other : endless) {
            add(proxy, *other);
        }
    }

    void update() {
        if (toAsk.empty()) {
            reinserted = 0;
            return;
        }
        std::sort(toAsk.begin(), toAsk.end());
        std::vector<Proxy*> changedMoving;
        std::vector<Proxy*> changedStill;
        reinserted = 0;
        for (ProxyId id : toAsk) {
            Proxy* proxy = proxies[id].get();
            if (proxy && proxy->isMoved) {
                ++reinserted;
                if (!proxy->isEndless) {
                    (proxy->isStatic ? changedStill : changedMoving).push_back(proxy);
                }
            }
        }
        moving.update(changedMoving);
        still.update(changedStill);

        found.clear();
        for (ProxyId id : toAsk) {
            if (Proxy* proxy = proxies[id].get()) {
                proxy->isMoved = false;
                proxy->hasShrunk = false;
                findPartners(*proxy);
            }
        }
        std::sort(found.begin(), found.end());
        std::erase_if(pairs, [&](const ProxyPair& pair) { return isAskedFor[pair.a] || isAskedFor[pair.b]; });
        const auto middle = static_cast<std::ptrdiff_t>(pairs.size());
        pairs.insert(pairs.end(), found.begin(), found.end());
        std::inplace_merge(pairs.begin(), pairs.begin() + middle, pairs.end());
        for (ProxyId id : toAsk) {
            isAskedFor[id] = 0;
        }
        toAsk.clear();
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
    for (const std::unique_ptr<Proxy>& proxy : impl_->proxies) {
        if (proxy) {
            impl_->ask(proxy->id);
        }
    }
}

void BroadPhase::add(ProxyId id, const Aabb& tight, bool isStatic) {
    CAIRN_CHECK(!contains(id), "the proxy is there already");
    checkBox(tight);
    if (id >= impl_->proxies.size()) {
        impl_->proxies.resize(id + std::size_t{1});
        impl_->isAskedFor.resize(id + std::size_t{1}, 0);
    }
    impl_->proxies[id] = std::make_unique<Proxy>(id, isStatic);
    impl_->place(*impl_->proxies[id], tight.grown(impl_->margin));
}

void BroadPhase::remove(ProxyId id) {
    Proxy& proxy = impl_->at(id);
    if (proxy.isEndless) {
        std::erase(impl_->endless, &proxy);
    } else if (proxy.inTree) {
        impl_->treeOf(proxy).remove(proxy);
    }
    impl_->ask(id);
    impl_->proxies[id].reset();
}

bool BroadPhase::contains(ProxyId id) const {
    return id < impl_->proxies.size() && impl_->proxies[id];
}

void BroadPhase::move(ProxyId id, const Aabb& tight, const Vec3d& displacement) {
    Proxy& proxy = impl_->at(id);
    checkBox(tight);
    CAIRN_CHECK(displacement.allFinite(), "a sweep must be finite");
    Aabb fresh = tight.grown(impl_->margin);
    fresh.min += displacement.cwiseMin(0.0);
    fresh.max += displacement.cwiseMax(0.0);
    const Aabb old = proxy.fat();
    if (old.contains(tight) && fresh.grown(spareMargins * impl_->margin).contains(old)) {
        return;
    }
    proxy.hasShrunk |= old.contains(fresh);
    impl_->place(proxy, fresh);
}

void BroadPhase::refilter(ProxyId id) {
    impl_->at(id);
    impl_->ask(id);
}

void BroadPhase::setResting(ProxyId id, bool rests) {
    Proxy& proxy = impl_->at(id);
    CAIRN_CHECK(rests || !proxy.isStatic, "a static body rests");
    if (proxy.rests != rests) {
        proxy.rests = rests;
        impl_->ask(id);
    }
}

void BroadPhase::update() {
    impl_->update();
}

const std::vector<ProxyPair>& BroadPhase::pairs() const {
    return impl_->pairs;
}

std::vector<ProxyId> BroadPhase::query(const Aabb& region) const {
    checkBox(region);
    const fcl::AABB<double> box(region.min, region.max);
    std::vector<ProxyId> ids;
    const auto meet = [&](const Proxy& proxy) {
        if (proxy.getAABB().overlap(box)) {
            ids.push_back(proxy.id);
        }
    };
    // What has moved since the last update is asked one by one, as the trees know its old box only.
    const auto meetUnmoved = [&](const Proxy& proxy) {
        if (!proxy.isMoved) {
            meet(proxy);
        }
    };
    std::vector<const Node*> open;
    impl_->moving.visit(box, open, meetUnmoved);
    impl_->still.visit(box, open, meetUnmoved);
    for (const Proxy* proxy : impl_->endless) {
        meetUnmoved(*proxy);
    }
    for (ProxyId id : impl_->toAsk) {
        const Proxy* proxy = impl_->proxies[id].get();
        if (proxy && proxy->isMoved) {
            meet(*proxy);
        }
    }
    std::sort(ids.begin(), ids.end());
    return ids;
}

// measure(low, high, limit): how far a box is along the walk, infinite where it is out of it.
template <class Measure>
void BroadPhase::walk(double limit, Measure measure, Visitor visit) const {
    const auto meet = [&](const Proxy& proxy) {
        const double bound = measure(proxy.getAABB().min_, proxy.getAABB().max_, limit);
        if (bound <= limit && !std::isinf(bound)) {
            limit = visit(proxy.id, limit);
        }
    };
    for (const Proxy* proxy : impl_->endless) {
        if (!proxy->isMoved) {
            meet(*proxy);
        }
    }
    // The trees know the old boxes of what has moved since the last update.
    for (ProxyId id : impl_->toAsk) {
        const Proxy* proxy = impl_->proxies[id].get();
        if (proxy && proxy->isMoved) {
            meet(*proxy);
        }
    }
    const auto meetUnmoved = [&](const Proxy& proxy, double within) {
        return proxy.isMoved ? within : visit(proxy.id, within);
    };
    limit = impl_->moving.walk(limit, measure, meetUnmoved);
    impl_->still.walk(limit, measure, meetUnmoved);
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
