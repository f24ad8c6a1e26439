// The kernels compile as device code; run where nvcc is, no GPU needed.
#include "kernels/affine.hpp"
#include "kernels/cell_fields.hpp"
#include "kernels/cell_gradient.hpp"
#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "kernels/velocity_fit.hpp"
#include "method/state.hpp"
#include "shape/box.hpp"
#include "shape/bspline.hpp"
#include "shape/corners.hpp"
#include "shape/dual_domain.hpp"
#include "shape/point.hpp"
using namespace ordo;
template <class S, class Evolution>
__global__ void one(Sweep<S::dim> s, TileReport* r)
{
    int i = blockIdx.x;
    Lanes value{};
    UpperLanes force{}, flux[S::dim] = {};
    MassMomentum<S::dim>::add(s.p, i, value, flux);
    Forces<S::dim, false>::add(s.p, i, force, flux);
    S::spread(s.lattice, s.p, i, s.nodes, value, flux);
    S::spread(s.lattice, s.p, i, s.nodes, force, flux);
    S::spread_value(s.lattice, s.p, i, s.nodes, value);
    Quad gradient[S::dim] = {};
    S::collect(s.lattice, s.p, i, s.nodes, value, gradient);
    S::collect_value(s.lattice, s.p, i, s.nodes, value);
    const Batch b{i, 1};
    Lanes move{}, reach{};
    deform(s, b, Mat<S::dim, Lanes>{}, *r);
    place(s, b, Vec<S::dim, Lanes>{}, move, *r);
    Evolution::apply(s, b);
    measure_reach<S>(s, b, reach, *r);
}
#define ORDO_ONE(S, D, ...) template __global__ void one<S, __VA_ARGS__>(Sweep<D>, TileReport*);
using PointHat = Point<3, Hat>;
using PointSpline = Point<3, BSpline<3>>;
using BoxHat = Box<2, Hat>;
using BoxSpline = Box<2, BSpline<2>>;
using EdgesHat = Parallelepiped<3, Hat>;
using EdgesSpline = Parallelepiped<3, BSpline<2>>;
using CellHat = Cell<3, Hat, true>;
using CellSpline = Cell<2, BSpline<3>, false>;
using DualPoint = DualDomain<2>;
using SplineAffine = AffinePoint<3, BSpline<2>>;
ORDO_ONE(PointHat, 3, Rigid<3>)
ORDO_ONE(PointSpline, 3, Rigid<3>)
ORDO_ONE(BoxHat, 2, StretchedBox<2>)
ORDO_ONE(BoxSpline, 2, StretchedBox<2>)
ORDO_ONE(EdgesHat, 3, AffineEdges<3>)
ORDO_ONE(EdgesSpline, 3, AffineEdges<3>)
ORDO_ONE(CellHat, 3, OfCorners<CellHat>)
ORDO_ONE(CellSpline, 2, OfCorners<CellSpline>)
ORDO_ONE(DualPoint, 2, Rigid<2>)
ORDO_ONE(SplineAffine, 3, Rigid<3>)

/// Fits: samples and sums of one particle, the solve of one target.
template <int D, int degree>
__global__ void fit(Sweep<D> s, Lanes* records, Vec<D> distance)
{
    using M = Moments<D, degree, D>;
    auto add = [&](const Vec<D, Lanes>&, const Vec<D, Lanes>& v_c, int) {
        double v[D];
        for (int a = 0; a < D; ++a) v[a] = v_c[a][0];
        M::add(records, distance, 1.0, v);
    };
    for_each_sample(s, true, 0, 1, add);
    double matrix[M::unknowns][M::unknowns], row[M::unknowns];
    M::matrix(records, matrix);
    const Ldl<M::unknowns> ldl(matrix);
    ldl.first_row(row);
    s.p.v[0][0] = row[0] + M::mean(records, 0);
    interpolate_gradient(s, 0, s.p.F[0]);
}
template __global__ void fit<2, 2>(Sweep<2>, Lanes*, Vec<2>);
template __global__ void fit<3, 1>(Sweep<3>, Lanes*, Vec<3>);

