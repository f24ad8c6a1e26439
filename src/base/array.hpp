// The owner of a run of trivially copyable elements: zeroed, aligned to a cache line, pages touched only when used.
// A grid of a thousand cells a side thus costs memory for the material only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace ordo {

/// An owned array of `size()` elements, zero at construction.
template <class T>
class Array {
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    Array() = default;
    explicit Array(std::size_t n) : size_(n)
    {
        if (n == 0) return;
        // calloc maps untouched zero pages for large sizes; aligned_alloc would have to write them.
        constexpr std::size_t line = 64;
        memory_.reset(std::calloc(n * sizeof(T) + line, 1));
        if (!memory_) throw std::bad_alloc();
        const auto address = reinterpret_cast<std::uintptr_t>(memory_.get());
        data_              = reinterpret_cast<T*>((address + line - 1) / line * line);
    }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T* data() { return data_; }
    const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }

    Array(Array&& o) noexcept { *this = std::move(o); }
    Array& operator=(Array&& o) noexcept
    {
        memory_ = std::move(o.memory_);
        data_   = std::exchange(o.data_, nullptr);
        size_   = std::exchange(o.size_, 0);
        return *this;
    }

  private:
    struct Free {
        void operator()(void* p) const { std::free(p); }
    };
    std::unique_ptr<void, Free> memory_;
    T* data_          = nullptr;
    std::size_t size_ = 0;
};

}  // namespace ordo
