// Rows of numbers that ranks have, as one list on the first of them, block after block: no rank needs memory for all. For files.
#pragma once

#include "base/parallel.hpp"
#include "base/ranks.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace ordo {

class JoinedRows {
  public:
    /// The rows of one process, in their order.
    explicit JoinedRows(std::int64_t count) : ranks_(&alone()), count_(count) {}
    /// @param places of the rows of this rank in the list, ascending; of a row that several ranks have, that of the last of them counts
    /// @param count of the list
    JoinedRows(Ranks& ranks, std::vector<std::int64_t> places, std::int64_t count)
        : ranks_(&ranks), places_(std::make_shared<const std::vector<std::int64_t>>(std::move(places))), count_(count)
    {}

    std::int64_t count() const { return count_; }
    /// Where row k of this rank is in the list.
    std::int64_t place(std::size_t k) const { return ranks_->is_alone() ? static_cast<std::int64_t>(k) : (*places_)[k]; }

    /// put(numbers) on the first rank for one block of the list after the other. Row k of this rank has length(k) numbers, which
    /// fill(k, out) writes, called in parallel. All ranks call this.
    template <class T, class Length, class Fill, class Put>
    void for_each_block(const Length& length, const Fill& fill, const Put& put) const
    {
        std::vector<std::int32_t> lengths;
        std::vector<std::size_t> begins;
        std::vector<T> numbers;
        const std::int64_t rows = std::min(kRows * ranks_->count(), kMostRows);
        for (std::int64_t first = 0; first < count_; first += rows) {
            const std::int64_t last = std::min(first + rows, count_);
            const auto [from, to]   = own_between(first, last);
            lengths.resize(to - from);
            for (std::size_t k = from; k < to; ++k) lengths[k - from] = static_cast<std::int32_t>(length(k));
            find_begins(lengths, begins);
            numbers.resize(begins.back());
            parallel_for_each(static_cast<std::ptrdiff_t>(to - from), [&, from = from](std::ptrdiff_t i) {
                const auto k = static_cast<std::size_t>(i);
                fill(from + k, numbers.data() + begins[k]);
            });
            if (!ranks_->is_alone()) join(first, last, from, lengths, begins, numbers);
            if (ranks_->index() == 0) put(std::span<T>(numbers));
        }
    }

  private:
    static constexpr std::int64_t kRows = 1 << 14, kMostRows = 1 << 19;  ///< of a block: for each rank, and at most

    /// The rows of this rank with places in [first, last).
    std::pair<std::size_t, std::size_t> own_between(std::int64_t first, std::int64_t last) const
    {
        if (ranks_->is_alone()) return {static_cast<std::size_t>(first), static_cast<std::size_t>(last)};
        auto at = [&](std::int64_t place) {
            return static_cast<std::size_t>(std::lower_bound(places_->begin(), places_->end(), place) - places_->begin());
        };
        return {at(first), at(last)};
    }
    static void find_begins(const std::vector<std::int32_t>& lengths, std::vector<std::size_t>& begins)
    {
        begins.resize(lengths.size() + 1);
        begins[0] = 0;
        for (std::size_t k = 0; k < lengths.size(); ++k) begins[k + 1] = begins[k] + static_cast<std::size_t>(lengths[k]);
    }

    /// Puts the rows of all ranks in [first, last) into `numbers` on the first. A message has the places of its rows, their lengths and
    /// their numbers.
    template <class T>
    void join(std::int64_t first, std::int64_t last, std::size_t from, std::vector<std::int32_t>& lengths,
              std::vector<std::size_t>& begins, std::vector<T>& numbers) const
    {
        std::vector<std::int32_t> places(lengths.size());
        for (std::size_t k = 0; k < places.size(); ++k) places[k] = static_cast<std::int32_t>((*places_)[from + k] - first);
        std::vector<Bytes> out(static_cast<std::size_t>(ranks_->count()));
        put(out[0], static_cast<std::int64_t>(places.size()));
        put_all(out[0], std::span<const std::int32_t>(places));
        put_all(out[0], std::span<const std::int32_t>(lengths));
        put_all(out[0], std::span<const T>(numbers));
        const std::vector<Bytes> all = ranks_->exchange(std::move(out));
        if (ranks_->index() != 0) return;

        struct Part {
            std::vector<std::int32_t> places, lengths;
            const unsigned char* numbers = nullptr;
        };
        std::vector<Part> parts;
        lengths.assign(static_cast<std::size_t>(last - first), 0);
        for (const Bytes& bytes : all) {
            const unsigned char* at = bytes.data();
            std::int64_t count      = 0;
            take(at, &count, 1);
            Part& part = parts.emplace_back();
            part.places.resize(static_cast<std::size_t>(count));
            part.lengths.resize(static_cast<std::size_t>(count));
            take(at, part.places.data(), part.places.size());
            take(at, part.lengths.data(), part.lengths.size());
            part.numbers = at;
            for (std::size_t k = 0; k < part.places.size(); ++k)
                lengths[static_cast<std::size_t>(part.places[k])] = part.lengths[k];
        }
        find_begins(lengths, begins);
        numbers.resize(begins.back());
        for (const Part& part : parts) {
            const unsigned char* at = part.numbers;
            for (std::size_t k = 0; k < part.places.size(); ++k)
                take(at, numbers.data() + begins[static_cast<std::size_t>(part.places[k])],
                     static_cast<std::size_t>(part.lengths[k]));
        }
    }
    template <class T>
    static void take(const unsigned char*& from, T* to, std::size_t count)
    {
        if (count > 0) std::memcpy(to, from, count * sizeof(T));
        from += count * sizeof(T);
    }

    Ranks* ranks_;
    std::shared_ptr<const std::vector<std::int64_t>> places_;  ///< null for one process; copies share them
    std::int64_t count_;
};

}  // namespace ordo
