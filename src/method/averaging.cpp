#include "method/averaging.hpp"

#include "kernels/averaging.hpp"
#include "kernels/nodes.hpp"

#include <cmath>

namespace ordo {

namespace {

/// Averages over cells, or at vertices, of four bodies at a time.
template <int D, bool at_vertices>
void average_bodies(State<D>& s, const double* V, double* u)
{
    const ParticleView<D> p = s.particles.view();
    Lanes* records          = s.averages.records.data();
    for (int first = 0; first < s.averages.body_count; first += kBodiesOfRecord) {
        clear(records, s.field.tiles);
        s.field.tiles.for_each_by_colour(
            [&](const Tile& t) { spread_averages<D, at_vertices>(s.lattice, p, V, u, records, first, t.begin, t.end); });
        s.field.halo.add(records, 0, NodeLane::end);
        s.field.halo.copy(records);
        s.field.tiles.for_each([&](std::ptrdiff_t, const Tile& t) {
            collect_averages<D, at_vertices>(s.lattice, p, u, records, first, t.begin, t.end);
        });
    }
}

/// Makes room, and counts the bodies once.
template <int D>
void prepare(State<D>& s)
{
    make_room(s.averages.records, s.field.nodes.size());
    if (s.averages.u.size() == s.particles.x.size()) return;
    s.averages.u          = Array<double>(s.particles.x.size());
    s.averages.body_count = *std::max_element(s.particles.body.begin(), s.particles.body.end()) + 1;
}

}  // namespace

template <int D>
void average(const MethodSpec& method, State<D>& s, const double* V, double* u)
{
    prepare(s);
    if (method.averaging == Averaging::cell)
        average_bodies<D, false>(s, V, u);
    else
        average_bodies<D, true>(s, V, u);
}

template <int D>
void find_force_stress(const MethodSpec& method, State<D>& s)
{
    prepare(s);
    if (s.force_stress.size() != s.particles.x.size()) s.force_stress = Array<Stress<D>>(s.particles.x.size());
    const ParticleView<D> p = s.particles.view();
    double* mean            = s.averages.u.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        mean[i] = p.q ? -p.q[i] : 0.0;
        for (int a = 0; a < D; ++a) mean[i] += p.sigma[i](a, a) / D;
    });
    if (method.averaging != Averaging::none) average(method, s, p.V, mean);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        Stress<D> sigma = p.sigma[i];
        double own      = 0.0;
        for (int a = 0; a < D; ++a) own += sigma(a, a) / D;
        for (int a = 0; a < D; ++a) sigma(a, a) += mean[i] - own;
        s.force_stress[i] = sigma;
    });
}

template <int D>
void average_increments(const MethodSpec& method, State<D>& s, const double* before, Mat<D>* increments)
{
    prepare(s);
    const ParticleView<D> p = s.particles.view();
    double* mean            = s.averages.u.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { mean[i] = dilation(increments[i]); });
    average(method, s, before, mean);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const double theta = dilation(increments[i]);
        const double scale = std::pow((1 + mean[i]) / (1 + theta), 1.0 / D);
        increments[i]      = scale * increments[i] + (scale - 1) * Mat<D>::identity();
        p.F[i]             = scale * p.F[i];
        if (!p.cell) p.V[i] = det(p.F[i]) * p.V0[i];  // a cell has the volume between its corners
    });
}

#define ORDO_AVERAGING(D)                                                        \
    template void average(const MethodSpec&, State<D>&, const double*, double*); \
    template void find_force_stress(const MethodSpec&, State<D>&);               \
    template void average_increments(const MethodSpec&, State<D>&, const double*, Mat<D>*);
ORDO_AVERAGING(1)
ORDO_AVERAGING(2)
ORDO_AVERAGING(3)
#undef ORDO_AVERAGING

}  // namespace ordo
