#pragma once
// The game's own engine: a clock. It shares its folder's and its file's name with Cairn's.
namespace game {

class Clock {
public:
    explicit Clock(double framesPerSecond) : dt_(1 / framesPerSecond) {}
    double dt() const { return dt_; }  // s
    double now() const { return now_; }
    void tick() { now_ += dt_; }

private:
    double dt_;
    double now_ = 0;
};

}  // namespace game
