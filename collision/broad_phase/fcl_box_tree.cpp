#include "collision/broad_phase/fcl_box_tree.hpp"

#include <bit>
#include <utility>

namespace cairn {

namespace {

using Node = BoxTree::Node;

// FCL joins this few leaves by trying all pairs, at the cube of their number; more are halved at the median.
constexpr int joinByPairs = 4;

// How high a tree of so many leaves may be: twice what it is when balanced, and a little for the small ones.
std::size_t heightLimit(std::size_t leaves) {
    return 2 * static_cast<std::size_t>(std::bit_width(leaves)) + 4;
}

std::size_t leavesUnder(const Node* node) {
    return node->isLeaf() ? 1 : leavesUnder(node->children[0]) + leavesUnder(node->children[1]);
}

}  // namespace

BoxTree::BoxTree() : tree_(joinByPairs), builder_(joinByPairs) {}

Node* BoxTree::makeLeaf(std::uint32_t id) {
    Node* const leaf = new Node;
    leaf->data = nullptr;
    leaf->children[1] = nullptr;
    leaf->code = id;
    return leaf;
}

void BoxTree::setBox(Node* leaf, const Aabb& box) {
    leaf->bv.min_ = box.min;
    leaf->bv.max_ = box.max;
}

// Appends the leaves under `node` to leaves_ and frees what joined them.
void BoxTree::takeApart(Node* node) {
    open_.assign(1, node);
    while (!open_.empty()) {
        Node* next = open_.back();
        open_.pop_back();
        if (next->isLeaf()) {
            leaves_.push_back(next);
            continue;
        }
        open_.push_back(next->children[1]);
        open_.push_back(next->children[0]);
        delete next;
    }
}

// Builds the part of the tree under `node` anew from the top.
void BoxTree::rebuild(Node* node) {
    Node* parent = node->parent;
    const int side = parent && parent->children[1] == node ? 1 : 0;
    leaves_.clear();
    takeApart(node);
    builder_.init(leaves_);
    Node* root = std::exchange(builder_.getRoot(), nullptr);
    root->parent = parent;
    (parent ? parent->children[side] : tree_.getRoot()) = root;
    // Leaves whose turn to be updated has not come may have outgrown what is above.
    for (; parent && !parent->bv.contain(root->bv); parent = parent->parent) {
        parent->bv += root->bv;
    }
}

// A sorted row of boxes put in one by one makes a chain. As in a scapegoat tree (Galperin and Rivest 1993), the lowest
// part that is too high for its leaves is built anew, so that a long row costs O(log n) a box and FCL, which recurses,
// never goes deep.
void BoxTree::keepLow(const Node* leaf) {
    for (;;) {
        std::size_t depth = 0;
        for (const Node* node = leaf; node->parent; node = node->parent) {
            ++depth;
        }
        if (depth <= heightLimit(size())) {
            return;
        }
        const Node* child = leaf;
        Node* node = leaf->parent;
        std::size_t count = 1;
        for (std::size_t height = 1;; ++height) {
            count += leavesUnder(node->children[node->children[0] == child ? 1 : 0]);
            if (height > heightLimit(count) || !node->parent) {
                break;
            }
            child = node;
            node = node->parent;
        }
        rebuild(node);
    }
}

void BoxTree::update(std::span<const std::uint32_t> changed, std::vector<Node*>& leaves) {
    added_.clear();
    for (const std::uint32_t id : changed) {
        if (holds(leaves[id])) {
            tree_.update(leaves[id]);
            keepLow(leaves[id]);
        } else {
            added_.push_back(id);
        }
    }
    if (added_.size() <= size() / 2) {
        for (const std::uint32_t id : added_) {
            const Node* const outside = std::exchange(leaves[id], tree_.insert(leaves[id]->bv, nullptr));
            delete outside;  // the tree makes leaves of its own
            leaves[id]->code = id;
            keepLow(leaves[id]);
        }
        return;
    }
    leaves_.clear();
    if (tree_.getRoot()) {
        takeApart(std::exchange(tree_.getRoot(), nullptr));
    }
    for (const std::uint32_t id : added_) {
        leaves_.push_back(leaves[id]);  // the tree's from here on
    }
    tree_.init(leaves_);
    leaves_ = {};  // a build of all is seldom: its room is not kept
    added_ = {};
}

}  // namespace cairn
