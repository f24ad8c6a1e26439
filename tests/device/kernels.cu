// The kernels compile as device code; run where nvcc is, no GPU needed.
#include "kernels/evolve.hpp"
#include "kernels/gather.hpp"
#include "kernels/nodes.hpp"
#include "kernels/scatter.hpp"
#include "method/state.hpp"
#include "shape/box.hpp"
#include "shape/corners.hpp"
#include "shape/point.hpp"
using namespace ordo;
template <class S>
__global__ void one(Sweep<S::dim> s, TileReport* r)
{
    int i = blockIdx.x;
    Lanes value{}, flux[S::dim] = {};
    MassMomentum<S::dim>::add(s.p, i, value, flux);
    InternalForce<S::dim>::add(s.p, i, value, flux);
    S::spread(s.lattice, s.p, i, s.nodes, value, flux);
    Mat<S::dim> L{};
    deform(s, i, L, *r);
    move<S, Rigid<S::dim>>(s, i, Vec<S::dim>{}, *r);
}
template __global__ void one<Point<3, Hat>>(Sweep<3>, TileReport*);
template __global__ void one<Box<2>>(Sweep<2>, TileReport*);
template __global__ void one<Parallelepiped<3, Hat>>(Sweep<3>, TileReport*);
