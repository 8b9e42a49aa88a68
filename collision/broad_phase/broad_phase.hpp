#pragma once
// Which bodies may touch: FCL's dynamic AABB tree over fattened boxes, kept from step to step.
// A body is asked again only when its tight box leaves its fat one. Static and moving bodies live in separate trees, so
// that static ones never look for each other; boxes without end (half-spaces) are kept in a list of their own.
#include <cairn/shapes.hpp>

#include "base/function_ref.hpp"

#include <functional>
#include <limits>

namespace cairn {

class JobSystem;

using ProxyId = std::uint32_t;  // chosen by the caller: the body's index

struct ProxyPair {
    ProxyId a = 0;
    ProxyId b = 0;  // a < b
    friend auto operator<=>(const ProxyPair&, const ProxyPair&) = default;
};

class BroadPhase {
public:
    // fatMargin: how far a box is grown, m. 5 cm: 6 % of jittering bodies are asked again each step.
    explicit BroadPhase(double fatMargin = 0.05);
    ~BroadPhase();
    BroadPhase(BroadPhase&&) noexcept;
    BroadPhase& operator=(BroadPhase&&) noexcept;

    // Asked with the lower id first, within update(), and by several threads at once where that is given a job system.
    // Pairs for which this answers false are never reported. Must be a pure function of the two ids between calls to
    // refilter(). Null: every pair is.
    void setFilter(std::function<bool(ProxyId, ProxyId)> mayCollide);

    // Boxes must be ordered and free of NaN; a NaN here is a programmer's mistake and ends the program.
    // What add(), remove(), move() and refilter() tell shows in pairs() after the next update().
    void add(ProxyId id, const Aabb& tight, bool isStatic);
    void remove(ProxyId id);
    bool contains(ProxyId id) const;
    // Tells the new tight box; cheap when it stays within the fat one. `displacement` (m): this step's expected motion,
    // by some of which a re-inserted fat box is stretched ahead.
    void move(ProxyId id, const Aabb& tight, const Vec3d& displacement);
    // Whether move() would re-insert the body; where not, it need not be called. Thread-safe beside other queries, so
    // that many may be asked in parallel and the few then moved in order.
    bool needsMove(ProxyId id, const Aabb& tight, const Vec3d& displacement) const;
    bool holds(ProxyId id, const Aabb& box) const;     // within its fat box
    bool overlaps(ProxyId id, const Aabb& box) const;  // by its fat box
    void refilter(ProxyId id);                         // its filter, or a joint of it, has changed
    // A static body rests, and so does one that sleeps: of two that rest no pair is kept, so that they cost nothing.
    void setResting(ProxyId id, bool rests);

    // Brings pairs() up to date: re-inserts the bodies that left their fat boxes, asks the trees for those, and drops
    // pairs whose fat boxes came apart. Allocates nothing where it has no more to do than an update before had, save
    // where part of a tree has grown too high and is built anew; a body added takes two nodes of FCL's.
    void update(JobSystem& jobs);
    void update();  // in the calling thread

    // Sorted, each once, no static-static pair; the same for the same history whatever the thread count.
    const std::vector<ProxyPair>& pairs() const;
    // The ids whose fat boxes overlap `region`, sorted; they are as the last add(), remove() or move() left them.
    // Thread-safe beside other queries.
    std::vector<ProxyId> query(const Aabb& region) const;
    // The same in any order, each once, without a list. visit() must not come back here.
    void forEachIn(const Aabb& region, FunctionRef<void(ProxyId)> visit) const;
    // The walks below call visit(id, limit) for the bodies whose fat boxes are in question, roughly the nearest first;
    // it answers the new limit, no greater than the old one, beyond which nothing is asked; one below 0 ends the walk.
    // Which bodies end up asked may depend on the tree's history, so an answer must not hang on the order: of equal
    // ones take the lowest id. They see the boxes as the last add(), remove() or move() left them. Thread-safe beside
    // other queries.
    using Visitor = FunctionRef<double(ProxyId, double)>;
    // Those that a box of these half extents meets between `origin` and origin + limit * motion; a ray's are zero.
    void cast(const Vec3d& origin, const Vec3d& motion, const Vec3d& halfExtents, double limit, Visitor visit) const;
    // Those within `limit` (m) of a box.
    void near(const Aabb& box, Visitor visit, double limit = std::numeric_limits<double>::infinity()) const;

    std::size_t lastReinserted() const;  // bodies re-inserted by the last update

private:
    template <class Measure>
    void walk(double limit, Measure measure, Visitor visit) const;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace cairn
