#include "command/recording/pose_track.hpp"

#include <algorithm>
#include <cmath>

namespace cairn {

namespace {

constexpr double farthest = 1e10;  // m: whole numbers of units stay exact as doubles, which pages compute in

void writeNumber(std::string& bytes, std::uint64_t number) {
    for (; number >= 128; number >>= 7) {
        bytes += static_cast<char>((number & 127u) | 128u);
    }
    bytes += static_cast<char>(number);
}

std::uint64_t zigzag(std::int64_t x) {
    return (static_cast<std::uint64_t>(x) << 1) ^ static_cast<std::uint64_t>(x >> 63);
}

std::int64_t fromZigzag(std::uint64_t x) {
    return static_cast<std::int64_t>(x >> 1) ^ -static_cast<std::int64_t>(x & 1u);
}

// Wraps around where a torn file asks for more than 64 bits.
std::int64_t goneOn(std::int64_t last, std::int64_t before, std::int64_t residual) {
    return static_cast<std::int64_t>(2 * static_cast<std::uint64_t>(last) - static_cast<std::uint64_t>(before) +
                                     static_cast<std::uint64_t>(residual));
}

}  // namespace

void appendNumber(std::string& bytes, std::int64_t number) {
    writeNumber(bytes, zigzag(number));
}

PoseValues roundedPose(const Posed& pose, const PoseValues& before) {
    PoseValues values;
    for (int k = 0; k < 3; ++k) {
        const double x = std::clamp(pose.position[k], -farthest, farthest);
        values[static_cast<std::size_t>(k)] = std::llround(x / positionUnit);
    }
    double along = 0;
    for (int k = 0; k < 4; ++k) {
        along += pose.rotation.coeffs()[k] * static_cast<double>(before[static_cast<std::size_t>(3 + k)]);
    }
    const double sign = along < 0 ? -1 : 1;
    for (int k = 0; k < 4; ++k) {
        values[static_cast<std::size_t>(3 + k)] = std::llround(sign * pose.rotation.coeffs()[k] / rotationUnit);
    }
    return values;
}

Posed poseOf(const PoseValues& values) {
    Posed pose;
    for (int k = 0; k < 3; ++k) {
        pose.position[k] = positionUnit * static_cast<double>(values[static_cast<std::size_t>(k)]);
    }
    for (int k = 0; k < 4; ++k) {
        pose.rotation.coeffs()[k] = static_cast<double>(values[static_cast<std::size_t>(3 + k)]);
    }
    pose.rotation.normalize();
    return pose;
}

void PoseTrackWriter::writeZeros() {
    if (zeros_ > 0) {
        bytes_ += '\0';
        writeNumber(bytes_, zeros_ - 1);
        zeros_ = 0;
    }
}

void PoseTrackWriter::add(const Posed& pose) {
    const PoseValues values = roundedPose(pose, last_);
    for (std::size_t k = 0; k < values.size(); ++k) {
        const std::int64_t residual = values[k] - 2 * last_[k] + before_[k];
        if (residual == 0) {
            ++zeros_;
        } else {
            writeZeros();
            appendNumber(bytes_, residual);
        }
    }
    before_ = last_;
    last_ = values;
}

std::string PoseTrackWriter::finish() {
    writeZeros();
    return std::move(bytes_);
}

std::optional<std::uint64_t> PoseTrackReader::number() {
    std::uint64_t number = 0;
    for (int shift = 0; shift < 64 && at_ < bytes_->size(); shift += 7) {
        const auto byte = static_cast<unsigned char>((*bytes_)[at_++]);
        number |= static_cast<std::uint64_t>(byte & 127u) << shift;
        if (byte < 128) {
            return number;
        }
    }
    return {};
}

std::optional<PoseValues> PoseTrackReader::next() {
    PoseValues values;
    for (std::size_t k = 0; k < values.size(); ++k) {
        std::int64_t residual = 0;
        if (zeros_ > 0) {
            --zeros_;
        } else {
            const std::optional<std::uint64_t> read = number();
            if (!read) {
                return {};
            }
            residual = fromZigzag(*read);
            if (residual == 0) {
                const std::optional<std::uint64_t> more = number();
                if (!more) {
                    return {};
                }
                zeros_ = *more;
            }
        }
        values[k] = goneOn(last_[k], before_[k], residual);
    }
    before_ = last_;
    last_ = values;
    return values;
}

}  // namespace cairn
