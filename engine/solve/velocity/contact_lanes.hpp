#pragma once
// The contacts of an island with colours as packs of lanes (contact_kernels.hpp), taken from Problem::contactRows at the
// start of a sub-step and their impulses put back at its end. The same bits as the scalar code of CompactSweeps.
#include "engine/problem/problem.hpp"
#include "engine/solve/kernels/contact_kernels.hpp"

namespace cairn {

template <class S>
class ContactLanes {
public:
    // Whether the island is worth it.
    static bool areFor(const Problem<S>& problem) { return !problem.contactColours.empty(); }
    // From arms, C, friction coefficients and impulses to start from. `masses` as ContactLanesView's, which are kept.
    void begin(const Problem<S>& problem, const ContactTermRule<S>& rule, const S* masses);
    // `twists`: six a body, here and below.
    void relax(const Problem<S>& problem, S* twists, S h);
    // Pushes the bodies by all impulses. Gives slope + p^T (J v + b) for the twists before.
    S push(const Problem<S>& problem, S* twists, const S* before, S slope);
    // p^T s p.
    S curvature(const Problem<S>& problem, S sum);
    void scale(const Problem<S>& problem, S share);
    S sweep(const Problem<S>& problem, S* twists, S relaxation, S change);
    // Three a contact point: as they are; and more of them, by which the bodies are pushed.
    void copyImpulses(const Problem<S>& problem, S* impulses) const;
    void add(const Problem<S>& problem, S* twists, const S* change);
    void putBack(Problem<S>& problem) const;

private:
    using Pack = ContactPack<S>;
    using Row = PointPack<S>;

    // Packs by colour; of what found none, one by one.
    void layOut(const Problem<S>& problem);
    void addPack(const Problem<S>& problem, const std::uint32_t* contacts, std::size_t count);
    void fill(const Problem<S>& problem, Pack& pack);
    ContactLanesView<S> view(S* twists) { return {packs_.data(), points_.data(), twists, masses_}; }
    void exchange(const Problem<S>& problem, S* impulses);
    // Calls visit(lane, point, row among points_) for each contact point.
    template <class Visit>
    void forPoints(const Problem<S>& problem, const Visit& visit) const;
    // Calls visit(begin, end) over packs, colour by colour: calls at one time push no body in common.
    template <class Visit>
    void forColours(const Problem<S>& problem, const Visit& visit) const;

    std::vector<Pack> packs_;
    std::vector<Row> points_;
    std::vector<std::size_t> ends_;  // of the colours, among packs_
    std::vector<std::uint32_t> order_;
    std::vector<S> terms_;  // by contact or by point: what is summed in the order of the problem
    std::vector<S> sum_;    // of impulses, three a point
    const S* masses_ = nullptr;
};

}  // namespace cairn
