// Ranks that are threads of one process: everything of a run on several ranks but MPI, under any sanitizer.
#pragma once

#include "base/ranks.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

namespace ordo::test {

/// Who gets the pieces along the curve: equal parts, each piece any rank (anew each time), or one rank all.
enum class Division { parts, random, one };

/// What the threads share.
class Crew {
  public:
    Crew(int count, Division division)
        : count_(count),
          division_(division),
          has_left_(static_cast<std::size_t>(count)),
          slots_(static_cast<std::size_t>(count) * count)
    {}

    /// Waits for all. Throws if one of them has failed or left.
    void meet()
    {
        std::unique_lock lock(mutex_);
        const long round = round_;
        if (++waiting_ == count_) {
            waiting_ = 0;
            ++round_;
            changed_.notify_all();
        } else {
            auto one_has_left = [&] { return std::find(has_left_.begin(), has_left_.end(), 1) != has_left_.end(); };
            changed_.wait(lock, [&] { return round_ != round || has_failed_ || one_has_left(); });
            if (round_ == round && !has_failed_)
                throw std::runtime_error("another rank has ended, as one does whose ASSERT fails");
        }
        if (has_failed_) throw std::runtime_error("another rank has failed");
    }
    void fail()
    {
        const std::lock_guard lock(mutex_);
        has_failed_ = true;
        changed_.notify_all();
    }
    void leave(int index)
    {
        const std::lock_guard lock(mutex_);
        has_left_[static_cast<std::size_t>(index)] = 1;
        changed_.notify_all();
    }
    /// Between two meetings: what `from` sends to `to`.
    Bytes& slot(int from, int to) { return slots_[static_cast<std::size_t>(from * count_ + to)]; }

    using Key = std::tuple<int, int, int>;  ///< from, to, tag
    void post(const Key& key, std::vector<Lanes> records)
    {
        const std::lock_guard lock(mutex_);
        mail_[key].push_back(std::move(records));
        changed_.notify_all();
    }
    /// What has come under some of the keys, by their places in the list; waits for one if `waits`. Throws if a rank has failed, or if none of them
    /// will come because a sender has left.
    std::vector<std::pair<std::size_t, std::vector<Lanes>>> fetch(const std::vector<Key>& keys, bool waits)
    {
        std::unique_lock lock(mutex_);
        std::vector<std::pair<std::size_t, std::vector<Lanes>>> r;
        auto look = [&] {
            for (std::size_t k = 0; k < keys.size(); ++k) {
                const auto box = mail_.find(keys[k]);
                if (box == mail_.end() || box->second.empty()) continue;
                r.emplace_back(k, std::move(box->second.front()));
                box->second.pop_front();
            }
            return has_failed_ || !r.empty();
        };
        auto a_sender_has_left = [&] {
            return std::any_of(keys.begin(), keys.end(),
                               [&](const Key& key) { return has_left_[static_cast<std::size_t>(std::get<0>(key))] != 0; });
        };
        if (!look() && waits) changed_.wait(lock, [&] { return look() || a_sender_has_left(); });
        if (has_failed_) throw std::runtime_error("another rank has failed");
        if (r.empty() && waits) throw std::runtime_error("another rank has ended, as one does whose ASSERT fails");
        return r;
    }
    int count() const { return count_; }
    Division division() const { return division_; }

  private:
    int count_;
    Division division_;
    std::mutex mutex_;
    std::condition_variable changed_;
    int waiting_     = 0;
    long round_      = 0;
    bool has_failed_ = false;
    std::vector<char> has_left_;
    std::vector<Bytes> slots_;
    std::map<Key, std::deque<std::vector<Lanes>>> mail_;
};

/// How much a rank has sent.
struct Traffic {
    long messages = 0, bytes = 0;
};

class ThreadRelay final : public Relay {
  public:
    ThreadRelay(Crew& crew, int index, std::vector<RankMessage> out, std::vector<RankMessage> in, Traffic& traffic)
        : crew_(crew), index_(index), out_(std::move(out)), in_(std::move(in)), traffic_(traffic)
    {}

    void begin(std::span<const NodeRecords>) override
    {
        missing_.resize(in_.size());
        std::iota(missing_.begin(), missing_.end(), std::size_t{0});
    }
    void send(std::size_t k, std::span<const NodeRecords> records) override
    {
        const RankMessage& m = out_.at(k);
        std::vector<Lanes> packed(m.nodes.size() * static_cast<std::size_t>(size_of(records)));
        Lanes* to = packed.data();
        for (const std::ptrdiff_t node : m.nodes) to = copy_node(to, records, node);
        ++traffic_.messages;
        traffic_.bytes += static_cast<long>(packed.size() * sizeof(Lanes));
        crew_.post({index_, m.rank, m.tag}, std::move(packed));
    }
    std::vector<std::size_t> receive(bool is_idle, std::span<const NodeRecords> records) override
    {
        if (!is_idle && ++calls_ % 3 != 0) return {};  // late: tiles run in another order
        std::vector<Crew::Key> keys;
        for (const std::size_t k : missing_) keys.emplace_back(in_[k].rank, index_, in_[k].tag);
        std::vector<std::size_t> r;
        for (const auto& [place, packed] : crew_.fetch(keys, is_idle)) {
            const RankMessage& m = in_[r.emplace_back(missing_[place])];
            if (packed.size() != m.nodes.size() * static_cast<std::size_t>(size_of(records)))
                throw std::logic_error("a message of another size");
            const Lanes* from = packed.data();
            for (const std::ptrdiff_t node : m.nodes) from = copy_node(records, node, from);
        }
        std::erase_if(missing_, [&](std::size_t k) { return std::find(r.begin(), r.end(), k) != r.end(); });
        return r;
    }
    void end() override
    {
        if (!missing_.empty()) throw std::logic_error("a scatter ends without all of its messages");
    }

  private:
    Crew& crew_;
    int index_;
    std::vector<RankMessage> out_, in_;
    std::vector<std::size_t> missing_;
    Traffic& traffic_;
    unsigned calls_ = 0;
};

class ThreadRanks final : public Ranks {
  public:
    ThreadRanks(Crew& crew, int index) : crew_(crew), index_(index) {}

    int count() const override { return crew_.count(); }
    int index() const override { return index_; }
    void largest(std::span<double> values) override
    {
        fold(values, [](double& all, double one) { all = std::max(all, one); });
    }
    void add(std::span<std::int64_t> values) override
    {
        fold(values, [](std::int64_t& all, std::int64_t one) { all += one; });
    }
    void share(Bytes& bytes, int from) override
    {
        std::vector<Bytes> out(static_cast<std::size_t>(count()));
        if (index_ == from) std::fill(out.begin(), out.end(), bytes);
        bytes = exchange(std::move(out))[static_cast<std::size_t>(from)];
    }
    std::vector<Bytes> exchange(std::vector<Bytes> out) override
    {
        for (int to = 0; to < count(); ++to) crew_.slot(index_, to) = std::move(out.at(static_cast<std::size_t>(to)));
        crew_.meet();
        std::vector<Bytes> in;
        for (int from = 0; from < count(); ++from) in.push_back(std::move(crew_.slot(from, index_)));
        crew_.meet();
        return in;
    }
    std::unique_ptr<Relay> relay(std::vector<RankMessage> out, std::vector<RankMessage> in) override
    {
        messages = out;
        return std::make_unique<ThreadRelay>(crew_, index_, std::move(out), std::move(in), traffic);
    }
    std::vector<int> divide(std::span<const std::int64_t> weights, std::span<const int> before) const override
    {
        ++divisions_;
        if (crew_.division() == Division::parts) return Ranks::divide(weights, before);
        std::vector<int> to(weights.size(), count() - 1);
        if (crew_.division() == Division::random)
            for (std::size_t k = 0; k < to.size(); ++k)
                to[k] = static_cast<int>((k * 0x9e3779b97f4a7c15ull + divisions_ * 0xbf58476d1ce4e5b9ull) >> 40) % count();
        return to;
    }

    Traffic traffic;
    std::vector<RankMessage> messages;  ///< that go out in each scatter

  private:
    template <class T, class Combine>
    void fold(std::span<T> values, const Combine& combine)
    {
        Bytes mine;
        put_all(mine, std::span<const T>(values));
        const std::vector<Bytes> all = exchange(std::vector<Bytes>(static_cast<std::size_t>(count()), mine));
        for (std::size_t r = 0; r < all.size(); ++r) {
            const std::vector<T> one = values_of<T>(all[r]);
            for (std::size_t k = 0; k < values.size(); ++k) {
                if (r == 0)
                    values[k] = one[k];
                else
                    combine(values[k], one[k]);
            }
        }
    }

    Crew& crew_;
    int index_;
    mutable std::uint64_t divisions_ = 0;
};

/// f(ranks) on `count` threads. Throws what the first of them throws that did not wait for another.
template <class F>
void on_ranks(int count, Division division, const F& f)
{
    Crew crew(count, division);
    std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(count));
    std::vector<std::thread> threads;
    std::mutex mutex;
    std::exception_ptr first;
    for (int index = 0; index < count; ++index)
        threads.emplace_back([&, index] {
            ThreadRanks ranks(crew, index);
            try {
                f(ranks);
                crew.leave(index);
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (!first) first = std::current_exception();
                crew.fail();
            }
        });
    for (std::thread& thread : threads) thread.join();
    if (first) std::rethrow_exception(first);
}

}  // namespace ordo::test
