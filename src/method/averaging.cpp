#include "method/averaging.hpp"

#include "kernels/averaging.hpp"
#include "kernels/nodes.hpp"

#include <cmath>

namespace ordo {

namespace {

/// Averages over cells, or at vertices, of four bodies at a time.
template <int D, bool at_vertices>
void average_bodies(State<D>& s, double* u)
{
    const double* V         = s.averages.weights.data();
    const ParticleView<D> p = s.particles.view();
    Lanes* records          = s.averages.records.data();
    for (int first = 0; first < s.averages.body_count; first += kBodiesOfRecord) {
        clear(records, s.field.tiles);
        s.field.tiles.for_each_by_colour({{records}}, [&](const Tile& t) {
            spread_averages<D, at_vertices>(s.lattice, p, V, u, records + t.first_node, first, t.begin, t.end);
        });
        s.field.halo.add(records, 0, NodeLane::end);
        s.field.halo.copy(records);
        s.field.tiles.for_each([&](std::ptrdiff_t, const Tile& t) {
            collect_averages<D, at_vertices>(s.lattice, p, u, records + t.first_node, first, t.begin, t.end);
        });
    }
}

/// Whether J of particle i is averaged, not its change in the step: where stress is a function of F, F is all that particles
/// remember, and averages of changes would forget how their volumes differ from that of their cell. Where they flow, that
/// difference has no meaning.
template <int D>
bool averages_total(const Model<D>& model, const ParticleView<D>& p, std::ptrdiff_t i)
{
    return model.materials[p.material[i]].law->is_hyperelastic;
}

}  // namespace

template <int D>
void prepare_averages(const Model<D>& model, State<D>& s)
{
    const ParticleView<D> p = s.particles.view();
    Averages<D>& a          = s.averages;
    make_room(a.records, s.field.nodes.size());
    if (a.u.size() != s.particles.x.size()) {
        a.u       = Array<double>(p.count);
        a.weights = Array<double>(p.count);
    }
    if (a.body_count == 0) a.body_count = body_count(s);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { a.weights[i] = averages_total(model, p, i) ? p.V0[i] : p.V[i]; });
}

template <int D>
void average(const MethodSpec& method, State<D>& s, double* u)
{
    if (method.averaging == Averaging::cell)
        average_bodies<D, false>(s, u);
    else
        average_bodies<D, true>(s, u);
}

template <int D>
void find_force_stress(const Model<D>& model, State<D>& s)
{
    const bool is_averaged = model.method.averaging != Averaging::none;
    if (is_averaged) prepare_averages(model, s);
    if (s.force_stress.size() != s.particles.x.size()) s.force_stress = Array<Stress<D>>(s.particles.x.size());
    const ParticleView<D> p = s.particles.view();
    auto mean_of            = [&](std::ptrdiff_t i) {
        double r = 0.0;
        for (int a = 0; a < D; ++a) r += p.sigma[i](a, a) / D;
        return r;
    };
    auto set = [&](std::ptrdiff_t i, double part, double mean) {  // part (sigma - s I) + mean I
        s.force_stress[i] = p.sigma[i] * part;
        for (int a = 0; a < D; ++a) s.force_stress[i](a, a) += mean - part * mean_of(i);
    };
    if (!is_averaged) return parallel_for_each(p.count, [&](std::ptrdiff_t i) { set(i, 1.0, mean_of(i) - p.q[i]); });
    double* mean = s.averages.u.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { mean[i] = mean_of(i) - (p.q ? p.q[i] : 0.0); });
    average(model.method, s, mean);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { set(i, det(p.F[i]) / p.J[i], mean[i]); });
}

template <int D>
void average_increments(const Model<D>& model, State<D>& s)
{
    const ParticleView<D> p = s.particles.view();
    double* mean            = s.averages.u.data();
    Mat<D>* increments      = s.increments.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        mean[i] = dilation(increments[i]);
        if (!averages_total(model, p, i)) return;
        p.J[i] *= 1 + mean[i];
        mean[i] = p.J[i];
    });
    average(model.method, s, mean);
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const bool is_total = averages_total(model, p, i);
        const double change = is_total ? mean[i] / det(p.F[i]) : (1 + mean[i]) / (1 + dilation(increments[i]));
        const double scale  = std::pow(change, 1.0 / D);
        increments[i]       = scale * increments[i] + (scale - 1) * Mat<D>::identity();
        p.F[i]              = scale * p.F[i];
        if (!is_total) p.J[i] = det(p.F[i]);
        if (!p.cell) p.V[i] = p.J[i] * p.V0[i];  // a cell has the volume between its corners
    });
}

#define ORDO_AVERAGING(D)                                         \
    template void prepare_averages(const Model<D>&, State<D>&);   \
    template void average(const MethodSpec&, State<D>&, double*); \
    template void find_force_stress(const Model<D>&, State<D>&);  \
    template void average_increments(const Model<D>&, State<D>&);
ORDO_AVERAGING(1)
ORDO_AVERAGING(2)
ORDO_AVERAGING(3)
#undef ORDO_AVERAGING

}  // namespace ordo
