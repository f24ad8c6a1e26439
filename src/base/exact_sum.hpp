// Sums without rounding, so that they do not depend on the order of their terms, nor on how ranks share them.
#pragma once

#include "base/ranks.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace ordo {

/// A sum of doubles in fixed point: digits of 32 bits from 2^-1074 on, each in 64 bits, so that carries wait for the result. Exact for
/// up to 2^31 terms; the value is rounded once, to nearest, ties to even. A NaN or both infinities give NaN.
class ExactSum {
  public:
    ExactSum& operator+=(double x)
    {
        const auto bits     = std::bit_cast<std::uint64_t>(x);
        const auto exponent = static_cast<int>(bits >> 52 & 0x7ff);
        auto mantissa       = static_cast<std::int64_t>(bits & ((std::uint64_t{1} << 52) - 1));
        if (exponent == 0x7ff) {
            ++digits_[mantissa != 0 ? kNaN : x > 0 ? kPlus : kMinus];
            begin_ = 0;  // so that special values are seen
            end_   = kDigits;
            return *this;
        }
        if (exponent > 0) mantissa |= std::int64_t{1} << 52;
        if (mantissa == 0) return *this;
        const int place = std::max(exponent, 1) - 1, first = place / 32, shift = place % 32;
        const std::int64_t sign = x < 0 ? -1 : 1;
        // Of the shifted mantissa, up to 84 bits: the lowest 32, the next 32 and the rest.
        const auto low  = static_cast<std::uint64_t>(mantissa) << shift;  // its lowest 64 bits
        const auto high = shift == 0 ? 0 : static_cast<std::int64_t>(static_cast<std::uint64_t>(mantissa) >> (64 - shift));
        digits_[first] += sign * static_cast<std::int64_t>(low & kMask);
        digits_[first + 1] += sign * static_cast<std::int64_t>(low >> 32);
        digits_[first + 2] += sign * high;
        begin_ = std::min(begin_, first);
        end_   = std::max(end_, first + 3);
        return *this;
    }
    ExactSum& operator+=(const ExactSum& o)
    {
        for (int k = 0; k < kAll; ++k) digits_[k] += o.digits_[k];
        begin_ = std::min(begin_, o.begin_);
        end_   = std::max(end_, o.end_);
        return *this;
    }

    double value() const
    {
        if (begin_ >= end_) return 0.0;
        if (digits_[kNaN] > 0 || (digits_[kPlus] > 0 && digits_[kMinus] > 0)) return std::numeric_limits<double>::quiet_NaN();
        if (digits_[kPlus] > 0) return std::numeric_limits<double>::infinity();
        if (digits_[kMinus] > 0) return -std::numeric_limits<double>::infinity();
        Carried d{};
        const bool is_negative = carry(d, 1) < 0;
        if (is_negative) carry(d, -1);
        int top = kCarried - 1;
        while (top >= 0 && d[top] == 0) --top;
        if (top < 0) return 0.0;
        auto digit     = [&](int k) { return k >= 0 ? d[static_cast<std::size_t>(k)] : 0u; };
        const int zero = std::countl_zero(digit(top));
        // The highest 64 bits, and whether anything is below them.
        std::uint64_t bits = (static_cast<std::uint64_t>(digit(top)) << 32 | digit(top - 1)) << zero;
        if (zero > 0) bits |= digit(top - 2) >> (32 - zero);
        bool is_more = (digit(top - 2) << zero) != 0;
        for (int k = top - 3; k >= 0; --k) is_more = is_more || digit(k) != 0;
        constexpr int cut            = 64 - 53;  // bits beyond a mantissa
        constexpr std::uint64_t half = std::uint64_t{1} << (cut - 1);
        const std::uint64_t below    = bits & (2 * half - 1);
        std::uint64_t mantissa       = bits >> cut;
        const bool is_odd_or_above   = (mantissa & 1) != 0 || is_more;
        if (below > half || (below == half && is_odd_or_above)) ++mantissa;
        const double r = std::ldexp(static_cast<double>(mantissa), 32 * (top - 1) - zero + cut - 1074);
        return is_negative ? -r : r;
    }

    void clear()
    {
        if (begin_ < end_) std::fill(digits_.begin() + begin_, digits_.begin() + end_, 0);
        for (int k = kDigits; k < kAll; ++k) digits_[k] = 0;
        begin_ = kDigits;
        end_   = 0;
    }

    /// Makes each of these sums that over all ranks.
    static void add_over(Ranks& ranks, std::span<ExactSum* const> sums)
    {
        if (ranks.is_alone() || sums.empty()) return;
        std::vector<std::int64_t> all;
        for (const ExactSum* one : sums) all.insert(all.end(), one->digits_.begin(), one->digits_.end());
        ranks.add(all);
        for (std::size_t k = 0; k < sums.size(); ++k) {
            std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(k * kAll), kAll, sums[k]->digits_.begin());
            sums[k]->begin_ = 0;
            sums[k]->end_   = kDigits;
        }
    }

  private:
    static constexpr std::uint64_t kMask = 0xffffffff;
    static constexpr int kDigits         = 67;           // the largest double ends in digit 65
    static constexpr int kCarried        = kDigits + 2;  // room for 2^31 terms
    enum Special { kNaN = kDigits, kPlus, kMinus, kAll };
    using Carried = std::array<std::uint32_t, kCarried>;  ///< digits with carries taken

    /// Sets the digits of `sign` times the sum; returns what is left above them, negative if the sum is.
    std::int64_t carry(Carried& d, int sign) const
    {
        std::int64_t rest = 0;
        for (int k = begin_; k < kCarried; ++k) {
            rest += k < end_ ? sign * digits_[k] : 0;
            d[k] = static_cast<std::uint32_t>(rest & static_cast<std::int64_t>(kMask));
            rest >>= 32;
        }
        return rest;
    }

    std::array<std::int64_t, kAll> digits_{};
    int begin_ = kDigits, end_ = 0;  ///< digits outside are zero
};

/// The value of a sum over all ranks.
inline double total(Ranks& ranks, ExactSum sum)
{
    ExactSum* one = &sum;
    ExactSum::add_over(ranks, {&one, 1});
    return sum.value();
}

/// Several numbers that are summed together.
template <int n>
struct Numbers {
    double c[n] = {};

    double& operator[](int k) { return c[k]; }
    double operator[](int k) const { return c[k]; }
    Numbers& operator+=(const Numbers& o)
    {
        for (int k = 0; k < n; ++k) c[k] += o.c[k];
        return *this;
    }
};

/// The sum of the parts that all ranks have.
template <int n>
Numbers<n> exact_total(Ranks& ranks, std::span<const Numbers<n>> parts)
{
    std::array<ExactSum, n> sums;
    for (const Numbers<n>& one : parts)
        for (int k = 0; k < n; ++k) sums[static_cast<std::size_t>(k)] += one[k];
    std::array<ExactSum*, n> all{};
    for (std::size_t k = 0; k < n; ++k) all[k] = &sums[k];
    ExactSum::add_over(ranks, all);
    Numbers<n> r;
    for (int k = 0; k < n; ++k) r[k] = sums[static_cast<std::size_t>(k)].value();
    return r;
}

}  // namespace ordo
