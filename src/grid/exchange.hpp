// What bodies exchange with boundaries: the force on them and the work that is taken from them.
#pragma once

#include "base/exact_sum.hpp"
#include "base/parallel.hpp"
#include "base/vec.hpp"

#include <array>
#include <vector>

namespace ordo {

/// Of one boundary or traction.
struct Exchange {
    Vec<3> force{};     ///< on the bodies, mean over the last step, N
    double work = 0.0;  ///< taken from the bodies since the start, J; negative if they gained
};

/// The same of a part of a step.
struct ExchangeParts {
    std::array<ExactSum, 3> force;
    ExactSum work;

    ExchangeParts& operator+=(const ExchangeParts& o)
    {
        for (std::size_t a = 0; a < 3; ++a) force[a] += o.force[a];
        work += o.work;
        return *this;
    }
    void clear()
    {
        for (ExactSum& f : force) f.clear();
        work.clear();
    }
};

/// Adds the parts of all ranks to `to`, which has a row for each.
inline void add_over(Ranks& ranks, std::vector<ExchangeParts>& parts, std::vector<Exchange>& to)
{
    std::vector<ExactSum*> sums;
    for (ExchangeParts& one : parts) {
        for (ExactSum& f : one.force) sums.push_back(&f);
        sums.push_back(&one.work);
    }
    ExactSum::add_over(ranks, sums);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        for (std::size_t a = 0; a < 3; ++a) to[k].force[static_cast<int>(a)] += parts[k].force[a].value();
        to[k].work += parts[k].work.value();
    }
}

/// What a boundary did to a node in a step. All nodes together change the momentum of the particles by `impulse`.
template <int D>
struct NodeImpulse {
    int boundary = 0;
    Vec<D> impulse{};   ///< N s
    double work = 0.0;  ///< taken, J
};

/// Sums of all nodes in a step of length dt.
template <int D>
class ExchangeSums {
  public:
    /// Adds to `to`, which has a row for each boundary; null sums nothing.
    ExchangeSums(std::vector<ExchangeParts>* to, double dt) : to_(to), dt_(dt) {}

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
        ExchangeParts& e = (*to_)[static_cast<std::size_t>(one.boundary)];
        for (int a = 0; a < D; ++a) e.force[static_cast<std::size_t>(a)] += (1 / dt_) * one.impulse[a];
        e.work += one.work;
    }

  private:
    std::vector<ExchangeParts>* to_;
    double dt_;
};

}  // namespace ordo
