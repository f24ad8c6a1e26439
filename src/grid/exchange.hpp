// What bodies exchange with boundaries: the force on them and the work that is taken from them.
#pragma once

#include "base/parallel.hpp"
#include "base/vec.hpp"

#include <vector>

namespace ordo {

/// Of one boundary or traction.
struct Exchange {
    Vec<3> force{};     ///< on the bodies, mean over the last step, N
    double work = 0.0;  ///< taken from the bodies since the start, J; negative if they gained
};

/// What a boundary did to a node in a step. All nodes together change the momentum of the particles by `impulse`.
template <int D>
struct NodeImpulse {
    int boundary = 0;
    Vec<D> impulse{};   ///< N s
    double work = 0.0;  ///< taken, J
};

/// Sums of all nodes in a step of length dt, in an order that does not depend on the threads.
template <int D>
class ExchangeSums {
  public:
    /// Adds to `to`, which has a row for each boundary; null sums nothing.
    ExchangeSums(std::vector<Exchange>* to, double dt) : to_(to), dt_(dt) {}

    bool is_wanted() const { return to_ != nullptr; }

    /// f(i, note) for i in [0, n), in parallel; note(NodeImpulse) is for sums that are wanted.
    template <class F>
    void for_each(std::ptrdiff_t n, F&& f) const
    {
        std::vector<std::vector<NodeImpulse<D>>> pieces(is_wanted() ? static_cast<std::size_t>(n / kPiece + 1) : 0);
        parallel_pieces(n, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            auto note = [&](const NodeImpulse<D>& one) {
                if (is_wanted()) pieces[static_cast<std::size_t>(begin / kPiece)].push_back(one);
            };
            for (std::ptrdiff_t i = begin; i < end; ++i) f(i, note);
        });
        for (const auto& piece : pieces)
            for (const NodeImpulse<D>& one : piece) add(one);
    }

    void add(const NodeImpulse<D>& one) const
    {
        if (!is_wanted()) return;
        Exchange& e = (*to_)[static_cast<std::size_t>(one.boundary)];
        e.force += (1 / dt_) * padded(one.impulse);
        e.work += one.work;
    }

  private:
    std::vector<Exchange>* to_;
    double dt_;
};

}  // namespace ordo
