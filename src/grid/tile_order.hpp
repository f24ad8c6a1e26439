// The order of tiles in a scatter that ranks share: each runs as soon as the tiles that write to its nodes before it have, here and on
// other ranks. So sums have the order of one process, and no rank waits for a colour of all tiles.
#pragma once

#include "base/parallel.hpp"
#include "base/ranks.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <queue>
#include <span>
#include <thread>
#include <utility>
#include <vector>

namespace ordo {

class TileOrder {
  public:
    TileOrder() = default;
    /// @param colours by tile of this rank
    /// @param after [tile]: tiles of higher colours that share nodes with it
    /// @param out_tiles [message that goes out]: tiles that must have run before it
    /// @param in_tiles [message that comes in]: tiles that wait for it
    TileOrder(std::shared_ptr<Relay> relay, const std::vector<int>& colours, std::vector<std::vector<int>> after,
              const std::vector<std::vector<int>>& out_tiles, std::vector<std::vector<int>> in_tiles)
        : relay_(std::move(relay)),
          after_(std::move(after)),
          sends_(after_.size()),
          in_tiles_(std::move(in_tiles)),
          tiles_before_message_(out_tiles.size()),
          things_before_tile_(after_.size(), 0),
          turn_(after_.size())
    {
        for (const auto& tiles : after_)
            for (const int tile : tiles) ++things_before_tile_[at(tile)];
        for (const auto& tiles : in_tiles_)
            for (const int tile : tiles) ++things_before_tile_[at(tile)];
        for (std::size_t m = 0; m < out_tiles.size(); ++m) {
            tiles_before_message_[m] = static_cast<int>(out_tiles[m].size());
            for (const int tile : out_tiles[m]) sends_[at(tile)].push_back(static_cast<int>(m));
        }
        find_turns(colours);
    }

    bool is_set() const { return relay_ != nullptr; }

    /// f(tile) for all tiles, by several threads, and the messages between. Afterwards the records are sums over all ranks.
    template <class F>
    void run(std::span<const NodeRecords> records, const F& f, bool worth_threads) const
    {
        Progress progress(*this);
        relay_->begin(records);
        parallel_team(
            [&](int thread, int threads) {
                const bool speaks = thread == 0;  // MPI hears one thread only
                for (;;) {
                    if (speaks) progress.try_to([&] { relay_messages(records, progress, threads); });
                    const int tile = progress.take();
                    if (tile >= 0) {
                        f(tile);
                        progress.has_run(tile);
                    } else if (progress.is_over(speaks)) {
                        return;
                    } else if (threads > 1) {
                        std::this_thread::yield();
                    }
                }
            },
            worth_threads);
        progress.rethrow();
        relay_->end();
    }

  private:
    class Progress;

    static std::size_t at(int k) { return static_cast<std::size_t>(k); }

    /// Sends what is due and takes what has come.
    void relay_messages(std::span<const NodeRecords> records, Progress& progress, int threads) const
    {
        for (const int m : progress.due_messages()) relay_->send(at(m), records);
        const bool is_idle = threads == 1 && progress.misses_messages() && progress.has_nothing_to_do();
        for (const std::size_t m : relay_->receive(is_idle, records)) progress.has_come(m);
    }

    /// Of tiles that may run, those go first that messages wait for or that have waited for one, then those next to them; by colour.
    void find_turns(const std::vector<int>& colours)
    {
        std::vector<int> distance(turn_.size(), 2);
        for (std::size_t k = 0; k < turn_.size(); ++k)
            if (!sends_[k].empty()) distance[k] = 0;
        for (const auto& tiles : in_tiles_)
            for (const int tile : tiles) distance[at(tile)] = 0;
        for (std::size_t k = 0; k < turn_.size(); ++k)
            for (const int tile : after_[k])
                if (distance[at(tile)] == 0) distance[k] = std::min(distance[k], 1);
        std::vector<int> order(turn_.size());
        for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
        std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
            return std::pair(distance[at(a)], colours[at(a)]) < std::pair(distance[at(b)], colours[at(b)]);
        });
        tile_of_turn_ = order;
        for (std::size_t k = 0; k < order.size(); ++k) turn_[at(order[k])] = static_cast<int>(k);
    }

    /// What of a scatter is done.
    class Progress {
      public:
        explicit Progress(const TileOrder& order)
            : order_(order),
              before_tile_(order.things_before_tile_),
              before_message_(order.tiles_before_message_),
              tiles_left_(before_tile_.size()),
              missing_(order.in_tiles_.size())
        {
            for (std::size_t k = 0; k < before_tile_.size(); ++k)
                if (before_tile_[k] == 0) make_ready(k);
            for (std::size_t m = 0; m < before_message_.size(); ++m)
                if (before_message_[m] == 0) due_.push_back(static_cast<int>(m));
        }
        std::vector<int> due_messages()
        {
            const std::lock_guard lock(mutex_);
            return std::exchange(due_, {});
        }
        bool has_nothing_to_do()
        {
            const std::lock_guard lock(mutex_);
            return ready_.empty() && due_.empty();
        }
        bool misses_messages() const { return missing_ > 0; }
        void has_come(std::size_t message)
        {
            const std::lock_guard lock(mutex_);
            --missing_;
            for (const int tile : order_.in_tiles_[message]) release(tile);
        }
        /// A tile that may run; -1 if there is none.
        int take()
        {
            if (ready_count_ == 0) return -1;  // idle threads leave the lock to those that work
            const std::lock_guard lock(mutex_);
            if (ready_.empty() || failure_) return -1;
            const int turn = ready_.top();
            ready_.pop();
            --ready_count_;
            return order_.tile_of_turn_[at(turn)];
        }
        void has_run(int tile)
        {
            const std::lock_guard lock(mutex_);
            --tiles_left_;
            for (const int next : order_.after_[at(tile)]) release(next);
            for (const int m : order_.sends_[at(tile)])
                if (--before_message_[at(m)] == 0) due_.push_back(m);
        }
        /// Whether a thread has nothing left; the one that speaks also has messages.
        bool is_over(bool speaks)
        {
            if (tiles_left_ > 0 && !has_failed_) return false;
            const std::lock_guard lock(mutex_);
            return failure_ || (tiles_left_ == 0 && (!speaks || (missing_ == 0 && due_.empty())));
        }
        /// Calls f(). What it throws ends all threads, and `rethrow` throws it.
        template <class F>
        void try_to(const F& f)
        {
            try {
                f();
            } catch (...) {
                const std::lock_guard lock(mutex_);
                failure_    = std::current_exception();
                has_failed_ = true;
            }
        }
        void rethrow() const
        {
            if (failure_) std::rethrow_exception(failure_);
        }

      private:
        void release(int tile)
        {
            if (--before_tile_[at(tile)] == 0) make_ready(at(tile));
        }
        void make_ready(std::size_t tile)
        {
            ready_.push(order_.turn_[tile]);
            ++ready_count_;
        }

        const TileOrder& order_;
        std::vector<int> before_tile_, before_message_;
        std::priority_queue<int, std::vector<int>, std::greater<>> ready_;  ///< turns
        std::vector<int> due_;
        std::atomic<std::size_t> tiles_left_;
        std::size_t missing_;  ///< messages; for the thread that speaks
        std::atomic<std::size_t> ready_count_{0};
        std::atomic<bool> has_failed_{false};
        std::exception_ptr failure_;
        std::mutex mutex_;
    };

    std::shared_ptr<Relay> relay_;
    std::vector<std::vector<int>> after_, sends_, in_tiles_;
    std::vector<int> tiles_before_message_, things_before_tile_;
    std::vector<int> turn_, tile_of_turn_;
};

}  // namespace ordo
