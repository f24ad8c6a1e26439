#include "method/external_work.hpp"

#include "method/sums.hpp"

namespace ordo {

namespace {

template <class Loaded>
double work_on(const Loaded& before, const Loaded& after)
{
    return 0.5 * dot(before.force + after.force, after.x - before.x);
}

}  // namespace

template <int D>
ExternalWork<D>::ExternalWork(const Model<D>& model, State<D>& s)
    : model_(model),
      has_body_force_(field_groups(model).body_force || !s.particles.b.empty()),
      faces_(faces(s)),
      particles_(particles(s))
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
    std::vector<ExchangeParts> parts(s.account.tractions.size());  // loads of other ranks are zero
    for (std::size_t l = 0; l < faces_now.size(); ++l) {
        ExchangeParts& e = parts[static_cast<std::size_t>(model_.loads[l].traction)];
        e.work += -work_on(faces_[l], faces_now[l]);
        for (int a = 0; a < D; ++a) e.force[static_cast<std::size_t>(a)] += faces_[l].force[a];
    }
    for (Exchange& e : s.account.tractions) e.force = {};
    add_over(*s.ranks, parts, s.account.tractions);
    if (!has_body_force_) return;
    s.account.body_force_work -= sum_over_particles<1>(s, [&](int i) {
        return Numbers<1>{{work_on(particles_[static_cast<std::size_t>(i)], particles_now[static_cast<std::size_t>(i)])}};
    })[0];
}

template class ExternalWork<1>;
template class ExternalWork<2>;
template class ExternalWork<3>;

}  // namespace ordo
