#pragma once
// The contacts of an island with colours as packs of lanes (contact_kernels.hpp): laid out once a step, placed anew in
// each sub-step. Problem::contactRows, forces and impulses are written where they are asked for. The bits are those
// of the scalar code of CompactSweeps.
#include "engine/problem/problem.hpp"
#include "engine/solve/kernels/contact_kernels.hpp"

namespace cairn {

template <class S>
class ContactLanes {
public:
    // Whether the island is worth it.
    static bool areFor(const Problem<S>& problem) { return !problem.contactColours.empty(); }
    // Frames, arms and C where the bodies are now.
    void place(Problem<S>& problem);
    // In the first sub-step from the impulses of Problem::contactRows. `masses` as ContactLanesView's, which are kept.
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
    // Adds the impulses up; forces and what was given go to the problem where they are asked for.
    void store(Problem<S>& problem, S h);
    // Whether contactRows have been written in this sub-step.
    bool hasRows() const { return hasRows_; }

private:
    using Pack = ContactPack<S>;
    using Row = PointPack<S>;

    // Packs by colour; of what found none, one by one.
    void layOut(const Problem<S>& problem);
    void addPack(const Problem<S>& problem, const std::uint32_t* contacts, std::size_t count);
    void fill(const Problem<S>& problem, std::size_t pack);
    void fillPoint(const ContactGeometry<S>& from, PointGeometryPack<S>& to, std::size_t lane) const;
    bool isLaidOut(const Problem<S>& problem) const;
    // Whether something looks at single contacts in this sub-step.
    bool asksForRows(const Problem<S>& problem) const;
    void writeRows(Problem<S>& problem) const;
    ContactLanesView<S> view(S* twists) {
        return {packs_.data(), points_.data(), frames_.data(), geometry_.data(), placements_.data(), twists, masses_};
    }
    // Calls visit(kernels, begin, end) over all packs.
    template <class Visit>
    void forPacks(const Problem<S>& problem, const Visit& visit) const;
    void exchange(const Problem<S>& problem, S* impulses);
    // Calls visit(pack, lane, point, row among points_) for each contact point.
    template <class Visit>
    void forPoints(const Problem<S>& problem, const Visit& visit) const;
    // Calls visit(begin, end) over packs, colour by colour: calls at one time push no body in common.
    template <class Visit>
    void forColours(const Problem<S>& problem, const Visit& visit) const;

    std::vector<Pack> packs_;
    std::vector<Row> points_;
    std::vector<FramePack<S>> frames_;
    std::vector<PointGeometryPack<S>> geometry_;
    std::vector<S> placements_;
    std::vector<std::size_t> ends_;         // of the colours, among packs_
    std::array<std::size_t, 3> laidOut_{};  // bodies, contacts and points of the problem
    bool hasRows_ = false;
    bool needsRows_ = false;  // in every sub-step
    std::vector<std::uint32_t> order_;
    std::vector<S> terms_;  // by contact or by point: what is summed in the order of the problem
    std::vector<S> sum_;    // of impulses, three a point
    const S* masses_ = nullptr;
};

}  // namespace cairn
