#pragma once
// The fields of what a user fills in, told once: describe(archive, def) names each field with its rule to an archive,
// be it the check of a new joint (joint.cpp), or a reader, a writer and the schema of scene files (assets).
#include <limits>

namespace cairn {

// What a field's value must be. Limits hold for every number of a vector.
struct FieldRule {
    const char* text;  // unit and meaning: the schema's description and a part of error messages
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    bool above = false;  // least itself is not allowed
    bool below = false;  // most itself is not allowed
    bool required = false;
    std::size_t minItems = 0;    // elements of a list
    bool direction = false;      // a vector of any length but 0
    bool mayBeInfinite = false;  // which a file says by leaving it out
    bool fileOnly = false;       // least and most hold in files, where leaving out says what numbers beyond them say
};

}  // namespace cairn
