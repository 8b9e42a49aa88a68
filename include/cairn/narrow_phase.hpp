#pragma once

namespace cairn {

// Who answers in which direction, and how deep, two shapes overlap. Where they touch is told from that by contact
// points of Cairn's own in all cases.
enum class NarrowPhase {
    Auto,  // for each pair of kinds who is the better one as measured (docs/collision.md)
    Own,   // closed forms and searches of Cairn's own
    Fcl,   // FCL's closed forms, and its GJK and EPA on libccd, each answer checked and replaced where it is wrong
};

}  // namespace cairn
