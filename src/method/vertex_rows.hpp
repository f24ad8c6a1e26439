// The nodes that points of surfaces move with, by the functions of the grid themselves.
#pragma once

#include "method/state.hpp"
#include "shape/bspline.hpp"
#include "shape/hat.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

/// The nodes that vertices of outlines move with: v = sum_i N_i(x) v_i.
template <int D>
class VertexRows {
  public:
    VertexRows(const State<D>& s, std::size_t count)
        : s_(s), width_(s.lattice.basis.degree + 1), size_(power_of(width_, D)), nodes_(count * size_), weights_(count * size_)
    {}

    /// Sets row k: the basis at x, on the records of a field that begin at `first_node`. Images of periodic axes stand for the nodes that
    /// they repeat.
    void set(std::size_t k, const Vec<D>& x, std::ptrdiff_t first_node)
    {
        switch (s_.lattice.basis.degree) {
        case 2: return set_by<BSpline<2>>(k, x, first_node);
        case 3: return set_by<BSpline<3>>(k, x, first_node);
        default: return set_by<Hat>(k, x, first_node);
        }
    }
    std::size_t size() const { return size_; }
    std::ptrdiff_t node(std::size_t row, std::size_t n) const { return nodes_[row * size_ + n]; }
    double weight(std::size_t row, std::size_t n) const { return weights_[row * size_ + n]; }

  private:
    template <class Basis>
    void set_by(std::size_t k, const Vec<D>& x, std::ptrdiff_t first_node)
    {
        const Lattice<D>& g = s_.lattice;
        double w[D][Basis::width], dw[Basis::width];
        Index<D> first{};
        for (int a = 0; a < D; ++a)
            first[a] = static_cast<int>(Basis::row(g, a, g.cell_coordinate(a, g.inside_period(x)[a]), w[a], dw));
        std::size_t n = k * size_;
        IndexBox<D>{{}, Index<D>::filled(width_)}.for_each([&](const Index<D>& step) {
            weights_[n] = 1.0;
            for (int a = 0; a < D; ++a) weights_[n] *= w[a][step[a]];
            nodes_[n++] = first_node + g.offset(g.inside_period(first + step));
        });
    }

    const State<D>& s_;
    int width_;
    std::size_t size_;
    std::vector<std::ptrdiff_t> nodes_;
    std::vector<double> weights_;
};

}  // namespace ordo
