#pragma once
// Inside collision/ only. A tree of boxes named by number: FCL's hierarchy tree without the manager around it, whose
// hash table, collision objects and look at every node in each update cost more than the tree itself.
#include "collision/shapes/box_walk.hpp"
#include "collision/shapes/fcl_layout.hpp"

#include <fcl/broadphase/detail/hierarchy_tree.h>

#include <span>

namespace cairn {

class BoxTree {
public:
    using Node = fcl::detail::NodeBase<fcl::AABB<double>>;

    BoxTree();
    BoxTree(const BoxTree&) = delete;
    BoxTree& operator=(const BoxTree&) = delete;

    // A box is kept in its leaf alone. One that is in no tree yet is its maker's to delete.
    static Node* makeLeaf(std::uint32_t id);
    static Aabb boxOf(const Node* leaf) { return {leaf->bv.min_, leaf->bv.max_}; }
    // Those above a leaf that is in the tree are told by update() only.
    static void setBox(Node* leaf, const Aabb& box);

    std::size_t size() const { return tree_.size(); }
    bool holds(const Node* leaf) const { return leaf->parent || tree_.getRoot() == leaf; }  // or another tree does
    void remove(Node* leaf) { tree_.remove(leaf); }
    // Brings the tree up to the boxes of `changed` and takes in those that are in none. leaves: by id.
    void update(std::span<const std::uint32_t> changed, std::vector<Node*>& leaves);

    // Calls f(id) for all whose boxes, as the tree knows them, overlap `box`. open: room to work in.
    template <class F>
    void visit(const Aabb& box, std::vector<const Node*>& open, F f) const {
        const Node* root = tree_.getRoot();
        if (!root || !meet(root->bv, box)) {
            return;
        }
        std::size_t count = 1;
        open.resize(std::max<std::size_t>(open.size(), 64));
        open[0] = root;
        while (count > 0) {
            const Node* node = open[--count];
            if (node->isLeaf()) {
                f(node->code);
                continue;
            }
            if (count + 2 > open.size()) {
                open.resize(2 * open.size());
            }
            for (const Node* child : {node->children[1], node->children[0]}) {
                open[count] = child;
                count += meet(child->bv, box) ? 1 : 0;
            }
        }
    }

    // Calls f(id, limit) for the leaves by their measure(low, high, limit), the nearer first; answers the last limit.
    template <class Measure, class F>
    double walk(double limit, Measure measure, F f) const {
        if (!tree_.getRoot()) {
            return limit;
        }
        return walkNearest(
            static_cast<const Node*>(tree_.getRoot()), limit,
            [&](const Node* node, double within) { return measure(node->bv.min_, node->bv.max_, within); },
            [](const Node* node) { return node->isLeaf(); },
            [](const Node* node, int side) -> const Node* { return node->children[side]; },
            [&](const Node* node, double within) { return f(node->code, within); });
    }

private:
    using Tree = fcl::detail::HierarchyTree<fcl::AABB<double>>;

    // Without a branch a side: which side parts two boxes is never foreseen.
    static bool meet(const fcl::AABB<double>& a, const Aabb& b) {
        return (int{a.min_[0] <= b.max[0]} & int{a.min_[1] <= b.max[1]} & int{a.min_[2] <= b.max[2]} &
                int{b.min[0] <= a.max_[0]} & int{b.min[1] <= a.max_[1]} & int{b.min[2] <= a.max_[2]}) != 0;
    }

    void takeApart(Node* node);
    void rebuild(Node* node);
    void keepLow(const Node* leaf);

    Tree tree_;
    Tree builder_;
    std::vector<Node*> leaves_;
    std::vector<Node*> open_;
    std::vector<std::uint32_t> added_;
};

}  // namespace cairn
