#include "method/grid_sample.hpp"

#include "shape/bspline.hpp"
#include "shape/hat.hpp"
#include "shape/stencil.hpp"

namespace ordo {

namespace {

template <int D, class Basis>
GridSample<D> sample_grid_of(const State<D>& s, const Vec<D>& x)
{
    Stencil<D, Basis::width> row;
    row.first = 0;
    for (int a = 0; a < D; ++a)
        row.first += s.lattice.stride[a] * Basis::row(s.lattice, a, s.lattice.cell_coordinate(a, x[a]), row.w[a], row.dw[a]);
    GridSample<D> r{};
    double weights = 0.0;
    for_each_node(row, s.lattice, [&](std::ptrdiff_t node, double w, const Vec<D>&) {
        const Index<D> at = s.lattice.index(node);
        const Lanes n     = s.field.sum_at(s.lattice, at);
        if (!(n[NodeLane::mass] > 0)) return;
        double whole = 1.0;
        for (int a = 0; a < D; ++a) whole *= s.lattice.node_length(a, at[a]);
        weights += w;
        r.mass += w * n[NodeLane::mass];
        r.density += w * n[NodeLane::mass] / whole;
        for (int a = 0; a < D; ++a) r.velocity[a] += w * n[NodeLane::velocity + a];
    });
    if (weights > 0) r.velocity *= 1 / weights;
    return r;
}

}  // namespace

template <int D>
GridSample<D> sample_grid(const State<D>& s, const Vec<D>& x)
{
    switch (s.lattice.basis.degree) {
    case 2: return sample_grid_of<D, BSpline<2>>(s, x);
    case 3: return sample_grid_of<D, BSpline<3>>(s, x);
    default: return sample_grid_of<D, Hat>(s, x);
    }
}

template GridSample<1> sample_grid(const State<1>&, const Vec<1>&);
template GridSample<2> sample_grid(const State<2>&, const Vec<2>&);
template GridSample<3> sample_grid(const State<3>&, const Vec<3>&);

}  // namespace ordo
