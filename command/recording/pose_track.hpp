#pragma once
// The poses of one body over time, in few bytes. Numbers are rounded to whole multiples of a unit; of each only what
// differs from going on as in the last two frames is written, small numbers in one byte, and a body at rest in none:
//
//   value    = round(component / unit), components x y z of the position, x y z w of the rotation, frame after frame
//   residual = value - 2 value one frame before + value two frames before          (0 before the first frame)
//   zigzag   = 0, 1, 2, 3, 4 ... for residuals 0, -1, 1, -2, 2 ...
//   bytes    = zigzag, seven bits a byte, low ones first, the eighth bit set where more follow;
//              a 0 is followed by how many more zeros there are, written the same way
#include "base/base.hpp"

#include <optional>
#include <string>
#include <utility>

namespace cairn {

inline constexpr double positionUnit = 1.0 / 65536;  // m, about 0.015 mm
inline constexpr double rotationUnit = 1.0 / 65536;  // of a unit quaternion's component: at most 0.004 degrees
// What rounding can move a body by, m.
inline constexpr double positionRounding = 0.87 * positionUnit;

// Whole numbers written as the zigzags above.
void appendNumber(std::string& bytes, std::int64_t number);

using PoseValues = std::array<std::int64_t, 7>;
// Of the two quaternions of a rotation the one nearer `before`. Positions beyond 1e10 m are taken to be there.
PoseValues roundedPose(const Posed& pose, const PoseValues& before);
Posed poseOf(const PoseValues& values);

class PoseTrackWriter {
public:
    void add(const Posed& pose);
    const PoseValues& last() const { return last_; }
    std::size_t size() const { return bytes_.size(); }
    // The bytes so far, which it forgets: those that follow go on where these end.
    std::string take() { return std::exchange(bytes_, {}); }
    // The bytes of all that was added; nothing may be added after.
    std::string finish();

private:
    void writeZeros();

    std::string bytes_;
    PoseValues last_ = {};
    PoseValues before_ = {};
    std::uint64_t zeros_ = 0;
};

class PoseTrackReader {
public:
    // The bytes must outlive the reader.
    explicit PoseTrackReader(const std::string& bytes) : bytes_(&bytes) {}
    // Empty where the bytes end early or are no track.
    std::optional<PoseValues> next();
    // Whether nothing is left.
    bool done() const { return at_ == bytes_->size() && zeros_ == 0; }

private:
    std::optional<std::uint64_t> number();

    const std::string* bytes_;
    std::size_t at_ = 0;
    PoseValues last_ = {};
    PoseValues before_ = {};
    std::uint64_t zeros_ = 0;
};

}  // namespace cairn
