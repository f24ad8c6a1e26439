// Ranks: processes that share one run. Each has a part of the particles; all take the same decisions, in the same order.
// The only implementation outside ranks/ is alone(), one process; tests have ranks that are threads.
#pragma once

#include "base/lanes.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace ordo {

using Bytes = std::vector<unsigned char>;

/// Records of nodes that go to another rank or come from it, in the order of the list. Messages from one rank to another differ in `tag`,
/// which is above 0.
struct RankMessage {
    int rank = 0, tag = 0;
    std::vector<std::ptrdiff_t> nodes;
};

/// Records of `size` Lanes a node.
struct NodeRecords {
    Lanes* lanes = nullptr;
    int size     = 1;
};

/// How many Lanes a node has in all of them.
inline int size_of(std::span<const NodeRecords> records)
{
    int r = 0;
    for (const NodeRecords& one : records) r += one.size;
    return r;
}
/// Copies the records of a node to `to`, and back from there; returns the end of what was copied.
inline Lanes* copy_node(Lanes* to, std::span<const NodeRecords> records, std::ptrdiff_t node)
{
    for (const NodeRecords& one : records) to = std::copy_n(one.lanes + node * one.size, one.size, to);
    return to;
}
inline const Lanes* copy_node(std::span<const NodeRecords> records, std::ptrdiff_t node, const Lanes* from)
{
    for (const NodeRecords& one : records) {
        std::copy_n(from, one.size, one.lanes + node * one.size);
        from += one.size;
    }
    return from;
}

/// Hands records of nodes from rank to rank, as grid/rim_plan.hpp says. Values are copied, never added. Ranks begin and end the same scatters in
/// the same order; in a scatter each message is sent once.
class Relay {
  public:
    virtual ~Relay() = default;

    /// Messages of this scatter may come from now on.
    virtual void begin(std::span<const NodeRecords> records) = 0;
    /// Sends what the records of message k of those that go out hold now.
    virtual void send(std::size_t k, std::span<const NodeRecords> records) = 0;
    /// Puts the records of messages that have come in their places, and returns their numbers among those that come in. Waits for one if
    /// there is none and `is_idle`.
    virtual std::vector<std::size_t> receive(bool is_idle, std::span<const NodeRecords> records) = 0;
    /// All messages have been sent and received.
    virtual void end() = 0;
};

/// The processes of a run, as one of them sees them. All of them call each function, in the same order; `divide` alone
/// communicates nothing.
class Ranks {
  public:
    virtual ~Ranks() = default;

    virtual int count() const = 0;
    virtual int index() const = 0;  ///< of this one, from 0
    bool is_alone() const { return count() == 1; }

    /// Each value becomes its largest over all ranks. No value is NaN.
    virtual void largest(std::span<double> values) = 0;
    /// Each value becomes its sum over all ranks.
    virtual void add(std::span<std::int64_t> values) = 0;
    /// `bytes` becomes what rank `from` has.
    virtual void share(Bytes& bytes, int from) = 0;
    /// Sends out[r] to rank r. Returns what each rank sent here.
    virtual std::vector<Bytes> exchange(std::vector<Bytes> out) = 0;
    /// For messages that each other rank knows too, as the other side of it.
    virtual std::unique_ptr<Relay> relay(std::vector<RankMessage> out, std::vector<RankMessage> in) = 0;
    /// Ends all ranks at once, where one of them cannot go on and the others would wait for it.
    virtual void abort() {}

    /// The rank of each piece of work, for pieces along a curve: equal parts of all weight, one after the other. `before`, if not empty, is a
    /// division that stays unless its heaviest part weighs a twentieth more than that of a new one.
    virtual std::vector<int> divide(std::span<const std::int64_t> weights, std::span<const int> before) const;
};

/// One process that has everything.
Ranks& alone();

inline std::vector<int> Ranks::divide(std::span<const std::int64_t> weights, std::span<const int> before) const
{
    constexpr double tolerated = 1.05;
    std::int64_t all = 0, sum = 0;
    for (const std::int64_t w : weights) all += w;
    std::vector<int> to;
    to.reserve(weights.size());
    for (const std::int64_t w : weights) {
        // The middle of the piece decides: it falls in one of `count` equal parts.
        const double middle = static_cast<double>(sum) + 0.5 * static_cast<double>(w);
        const int part      = all > 0 ? static_cast<int>(middle * count() / static_cast<double>(all)) : 0;
        to.push_back(part < count() ? part : count() - 1);
        sum += w;
    }
    auto heaviest = [&](std::span<const int> parts) {
        std::vector<std::int64_t> of_part(static_cast<std::size_t>(count()), 0);
        for (std::size_t k = 0; k < parts.size(); ++k) of_part[static_cast<std::size_t>(parts[k])] += weights[k];
        return static_cast<double>(*std::max_element(of_part.begin(), of_part.end()));
    };
    if (!before.empty() && heaviest(before) <= tolerated * heaviest(to)) return {before.begin(), before.end()};
    return to;
}

namespace detail {

class Alone final : public Ranks {
  public:
    int count() const override { return 1; }
    int index() const override { return 0; }
    void largest(std::span<double>) override {}
    void add(std::span<std::int64_t>) override {}
    void share(Bytes&, int) override {}
    std::vector<Bytes> exchange(std::vector<Bytes> out) override { return out; }
    std::unique_ptr<Relay> relay(std::vector<RankMessage>, std::vector<RankMessage>) override { return nullptr; }
};

}  // namespace detail

inline Ranks& alone()
{
    static detail::Alone one;
    return one;
}

/// The largest of a value over all ranks.
inline double largest(Ranks& ranks, double value)
{
    ranks.largest({&value, 1});
    return value;
}

/// The part [first, second) of `count` things that one of `parts` equal parts has.
inline std::pair<std::int64_t, std::int64_t> part_of(std::int64_t count, int index, int parts)
{
    return {count * index / parts, count * (index + 1) / parts};
}

/// Appends the bytes of a value.
template <class T>
void put(Bytes& to, const T& value)
{
    const auto* bytes = reinterpret_cast<const unsigned char*>(&value);
    to.insert(to.end(), bytes, bytes + sizeof(T));
}
template <class T>
void put_all(Bytes& to, std::span<const T> values)
{
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    to.insert(to.end(), bytes, bytes + values.size_bytes());
}

/// The values whose bytes these are.
template <class T>
std::vector<T> values_of(const Bytes& bytes)
{
    std::vector<T> r(bytes.size() / sizeof(T));
    if (!r.empty()) std::memcpy(r.data(), bytes.data(), r.size() * sizeof(T));
    return r;
}

/// The lists of all ranks, by rank, on all of them.
template <class T>
std::vector<std::vector<T>> gather_all(Ranks& ranks, const std::vector<T>& mine)
{
    Bytes bytes;
    put_all(bytes, std::span<const T>(mine));
    std::vector<std::vector<T>> all;
    for (const Bytes& one : ranks.exchange(std::vector<Bytes>(static_cast<std::size_t>(ranks.count()), bytes)))
        all.push_back(values_of<T>(one));
    return all;
}

}  // namespace ordo
