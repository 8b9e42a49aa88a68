#pragma once
#include <memory>

namespace cairn {

// A part that few of many objects have: a pointer in each, memory where there is one. Copies are deep.
template <class T>
class Rare {
public:
    Rare() = default;
    Rare(const Rare& other) : part_(other.part_ ? std::make_unique<T>(*other.part_) : nullptr) {}
    Rare(Rare&&) noexcept = default;
    Rare& operator=(const Rare& other) { return *this = Rare(other); }
    Rare& operator=(Rare&&) noexcept = default;
    ~Rare() = default;

    explicit operator bool() const { return part_ != nullptr; }
    T* operator->() { return part_.get(); }
    const T* operator->() const { return part_.get(); }
    T& operator*() { return *part_; }
    const T& operator*() const { return *part_; }
    // There from here on.
    T& make() {
        if (!part_) {
            part_ = std::make_unique<T>();
        }
        return *part_;
    }
    void reset() { part_.reset(); }

private:
    std::unique_ptr<T> part_;
};

}  // namespace cairn
