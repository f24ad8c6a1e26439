#include "method/external_work.hpp"

namespace ordo {

namespace {

template <class Loaded>
double work_on(const Loaded& before, const Loaded& after)
{
    return 0.5 * dot(before.force + after.force, after.x - before.x);
}

}  // namespace

template <int D>
ExternalWork<D>::ExternalWork(const Model<D>& model, State<D>& s) : model_(model), faces_(faces(s)), particles_(particles(s))
{}

/// By load.
template <int D>
std::vector<typename ExternalWork<D>::Loaded> ExternalWork<D>::faces(State<D>& s) const
{
    std::vector<Loaded> r(model_.loads.size());
    if (r.empty()) return r;
    const ParticleView<D> p = s.particles.view();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        for (int l = p.load[i]; l >= 0; l = model_.loads[l].is_last ? -1 : l + 1) {
            const LoadedFace<D> face = loaded_face(model_.loads[l], model_.tractions, s.lattice, p, i, s.t);
            r[l]                     = {p.x[i] + face.arm, face.force};
        }
    });
    return r;
}

template <int D>
std::vector<typename ExternalWork<D>::Loaded> ExternalWork<D>::particles(const State<D>& s) const
{
    const Particles<D>& p = s.particles;
    std::vector<Loaded> r(p.b.size());
    parallel_for_each(static_cast<std::ptrdiff_t>(r.size()), [&](std::ptrdiff_t i) { r[i] = {p.x[i], p.m[i] * p.b[i]}; });
    return r;
}

template <int D>
void ExternalWork<D>::add(State<D>& s) const
{
    const std::vector<Loaded> faces_now = faces(s), particles_now = particles(s);
    for (Exchange& e : s.account.tractions) e.force = {};
    for (std::size_t l = 0; l < faces_now.size(); ++l) {
        Exchange& e = s.account.tractions[static_cast<std::size_t>(model_.loads[l].traction)];
        e.work -= work_on(faces_[l], faces_now[l]);
        e.force += padded(faces_[l].force);
    }
    s.account.body_force_work -= parallel_reduce(
        static_cast<std::ptrdiff_t>(particles_now.size()), 0.0,
        [&](std::ptrdiff_t i) { return work_on(particles_[i], particles_now[i]); },
        [](double& total, double one) { total += one; });
}

template class ExternalWork<1>;
template class ExternalWork<2>;
template class ExternalWork<3>;

}  // namespace ordo
