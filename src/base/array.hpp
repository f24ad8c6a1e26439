// An owned array of trivially copyable elements: zeroed, aligned to a cache line, pages touched only when used.
// So a grid of a thousand cells a side costs memory for the material only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace ordo {

/// Gives memory back to the system if it is mapped, else to the heap.
struct ReleaseMemory {
    std::size_t mapped = 0;  ///< bytes

    void operator()(void* p) const
    {
#if defined(__linux__)
        if (mapped > 0) {
            munmap(p, mapped);
            return;
        }
#endif
        std::free(p);
    }
};
using Memory = std::unique_ptr<void, ReleaseMemory>;

/// Where memory comes from. The heap may reuse memory that was touched before, which is faster than new pages but must be
/// cleared as a whole. Own pages cost only what is touched and go back to the system: for sparse or short-lived arrays.
enum class Pages { heap, own };

/// Zeroed bytes. Throws std::bad_alloc.
inline Memory make_memory(std::size_t bytes, [[maybe_unused]] Pages pages)
{
#if defined(__linux__)
    // By default Linux refuses an allocation larger than memory and swap together, however little of it would be touched.
    // With MAP_NORESERVE it does not.
    const std::size_t large = (pages == Pages::heap ? std::size_t{6} : std::size_t{1}) << 20;
    if (bytes >= large) {
        void* p = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (p == MAP_FAILED) throw std::bad_alloc();
        return Memory(p, {bytes});
    }
#endif
    // calloc maps untouched zero pages for large sizes; memory of aligned_alloc would have to be cleared.
    Memory memory(std::calloc(bytes, 1));
    if (!memory) throw std::bad_alloc();
    return memory;
}

/// An owned array of `size()` elements, zero at construction.
template <class T>
class Array {
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    Array() = default;
    explicit Array(std::size_t n, Pages pages = Pages::heap) : size_(n), room_(n)
    {
        if (n == 0) return;
        constexpr std::size_t line = 64;
        if (n > (std::numeric_limits<std::size_t>::max() - line) / sizeof(T)) throw std::bad_alloc();
        memory_            = make_memory(n * sizeof(T) + line, pages);
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

    /// Sets the size if there is room for it: as much as the array was made with. Elements stay where they are, also those beyond the size.
    bool fit(std::size_t n)
    {
        if (n > room_) return false;
        size_ = n;
        return true;
    }

    Array(Array&& o) noexcept { *this = std::move(o); }
    Array& operator=(Array&& o) noexcept
    {
        memory_ = std::move(o.memory_);
        data_   = std::exchange(o.data_, nullptr);
        size_   = std::exchange(o.size_, 0);
        room_   = std::exchange(o.room_, 0);
        return *this;
    }

  private:
    Memory memory_;
    T* data_          = nullptr;
    std::size_t size_ = 0, room_ = 0;
};

/// Makes `to` a copy of `from`.
template <class T>
void copy(Array<T>& to, const Array<T>& from)
{
    if (to.size() != from.size()) to = Array<T>(from.size());
    if (!from.empty()) std::memcpy(to.data(), from.data(), from.size() * sizeof(T));
}

/// Makes room for n elements, and for a quarter more if the array must grow: n changes from step to step.
template <class T>
void keep_room(Array<T>& array, std::size_t n)
{
    if (array.size() < n) array = Array<T>(array.empty() ? n : n + n / 4);
}

}  // namespace ordo
