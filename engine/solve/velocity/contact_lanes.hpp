#pragma once
// The contacts of an island as packs of lanes (contact_kernels.hpp), each of one colour or level: laid out once a step,
// placed anew in each sub-step. They keep the rows of the contacts; forces and impulses are written to the problem
// where they are asked for. The bits are those of the scalar code of CompactSweeps.
#include "engine/problem/problem.hpp"
#include "engine/solve/kernels/contact_kernels.hpp"

namespace cairn {

template <class S>
class ContactLanes final : public ContactRowKeeper<S> {
public:
    // Frames, arms and C where the bodies are now.
    void place(Problem<S>& problem);
    // `masses` as ContactLanesView's, which are kept.
    void begin(Problem<S>& problem, ContactTermRule<S> rule, const S* masses);
    // `twists`: six a body, here and below.
    void relax(const Problem<S>& problem, S* twists, S h);
    // Pushes the bodies by all impulses. Gives slope + p^T (J v + b) for the twists before.
    S push(const Problem<S>& problem, S* twists, const S* before, S slope);
    // p^T s p.
    S curvature(const Problem<S>& problem, S sum);
    void scale(const Problem<S>& problem, S share);
    S sweep(const Problem<S>& problem, S* twists, S relaxation, S change);
    // Three a contact point: as they are; and more of them.
    void copyImpulses(const Problem<S>& problem, S* impulses) const;
    void add(const Problem<S>& problem, const S* change);
    // Adds the impulses up; forces and what was given go to the problem where they are asked for.
    void store(Problem<S>& problem, S h);
    ContactFrame<S> frameOf(std::size_t contact) const override;
    ContactRows<S> rowsOf(std::size_t contact, std::size_t point) const override;
    void addToC(std::size_t contact, std::size_t point, S change) override;
    PointGiven<S> givenBy(std::size_t contact, std::size_t point) const override;

private:
    using Pack = ContactPack<S>;
    using Row = PointPack<S>;

    // Which contacts are a pack.
    void layOut(const Problem<S>& problem);
    // What a pack has for the whole step: whose it is; frames, places, and no impulses.
    void fillPack(const Problem<S>& problem, std::size_t pack);
    void fill(const Problem<S>& problem, std::size_t pack);
    void placePoints(const Problem<S>& problem, const Pack& pack, std::size_t lane);
    bool isLaidOut(const Problem<S>& problem) const;
    // Calls visit(pack, lane, row among points_).
    template <class Visit>
    auto at(std::size_t contact, std::size_t point, const Visit& visit) const;
    static ContactFrame<S> frameAt(const Pack& pack, std::size_t lane);
    ContactRows<S> rowAt(std::size_t row, std::size_t lane, const Vec3<S>& apart) const;
    ContactLanesView<S> view(S* twists) {
        return {packs_.data(),  points_.data(),     frames_.data(), given_.data(), places_.data(),
                rounds_.data(), placements_.data(), twists,         masses_};
    }
    // Calls visit(kernels, begin, end) over all packs.
    template <class Visit>
    void forPacks(const Problem<S>& problem, const Visit& visit) const;
    // Calls visit(pack, lane, point, row among points_) for each contact point.
    template <class Visit>
    void forPoints(const Problem<S>& problem, const Visit& visit) const;
    // Calls visit(begin, end) over packs, level by level: calls at one time push no body in common.
    template <class Visit>
    void forLevels(const Problem<S>& problem, const Visit& visit) const;

    std::vector<Pack> packs_;
    std::vector<Row> points_;
    std::vector<FramePack<S>> frames_;
    std::vector<GivenPack<S>> given_;
    std::vector<PlacePack<S>> places_;
    std::vector<PlacePack<S>> rounds_;
    std::vector<S> placements_;
    std::vector<std::size_t> ends_;         // of the levels, among packs_
    std::array<std::size_t, 3> laidOut_{};  // bodies, contacts and points of the problem
    bool rubsAnew_ = false;                 // what sticks has another friction: looked at in every sub-step
    std::vector<std::uint32_t> order_;      // contacts, pack by pack
    std::vector<std::uint32_t> firstOf_;    // by pack, in order_; and its end
    std::vector<std::uint32_t> laneOf_;     // by contact, of all lanes of the packs
    std::vector<S> terms_;                  // by point: what is summed in the order of the problem
    std::vector<S> changes_;                // likewise by contact; 0 of those without points
    const S* masses_ = nullptr;
};

}  // namespace cairn
