#include "method/tractions.hpp"

#include "base/parallel.hpp"

#include <cmath>

namespace ordo {

template <int D>
int add_loads(std::vector<Load<D>>& loads, Particles<D>& p, const CellMesh<D>& mesh, int first, int index,
              const std::function<double(const Vec<D>& normal, const Vec<D>& center)>& share)
{
    // The loads of a particle are contiguous, so its earlier loads are copied to the end of the list.
    std::vector<std::vector<Load<D>>> of(mesh.cells.size());
    for (std::size_t k = 0; k < of.size(); ++k)
        for (int l = p.load[first + static_cast<int>(k)]; l >= 0; l = loads[l].is_last ? -1 : l + 1) of[k].push_back(loads[l]);
    int count = 0;
    for (const Face<D>& f : outer_faces(mesh)) {
        Vec<D> at[Face<D>::max_corners]{};
        for (int c = 0; c < f.count; ++c) at[c] = mesh.corners[mesh.cells[f.cell][f.corner[c]]];
        const Vec<D> center = face_center(at, f.count), arm = center - p.x[first + f.cell];
        Vec<D> area = face_area(at, f.count);
        if (D == 1 && arm[0] < 0) area = -area;
        const double part = share(area * (1 / norm(area)), center);
        if (part == 0.0) continue;
        of[f.cell].push_back(
            {.traction = index, .is_last = false, .area0 = area, .share = part, .arm0 = arm, .center0 = center, .face = f});
        ++count;
    }
    for (std::size_t k = 0; k < of.size(); ++k) {
        if (of[k].empty()) continue;
        p.load[first + static_cast<int>(k)] = static_cast<int>(loads.size());
        for (Load<D>& l : of[k]) l.is_last = false;
        of[k].back().is_last = true;
        loads.insert(loads.end(), of[k].begin(), of[k].end());
    }
    return count;
}

template <int D>
FaceShape<D> shape_of_face(const Load<D>& load, const Lattice<D>& g, const ParticleView<D>& p, std::ptrdiff_t i)
{
    if (!p.cell) return {cofactor(p.F[i]) * load.area0, p.F[i] * load.arm0};
    Vec<D> at[Face<D>::max_corners]{};
    for (int c = 0; c < load.face.count; ++c) {
        at[c] = p.corner[p.cell[i][load.face.corner[c]]];
        for (int a = 0; a < D; ++a)
            if (g.periodic[a]) at[c][a] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
    }
    return {D == 1 ? load.area0 : face_area(at, load.face.count), face_center(at, load.face.count) - p.x[i]};
}

template <int D>
Vec<D> force_on(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Vec<D>& area, const Vec<D>& center,
                double t)
{
    const Traction<D>& traction = tractions[load.traction];
    const FieldPoint place{padded(center), padded(load.center0), t};
    switch (traction.type) {
    case TractionType::pressure: return -traction.value[0](place) * area;
    case TractionType::traction: return load.share * norm(area) * evaluate<D>(traction.value, place);
    case TractionType::dead: return load.share * norm(load.area0) * evaluate<D>(traction.value, place);
    }
    return {};
}

template <int D>
Vec<D> force_by_area(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Vec<D>& area, const Vec<D>& d_area,
                     const Vec<D>& center, double t)
{
    const Traction<D>& traction = tractions[load.traction];
    const FieldPoint place{padded(center), padded(load.center0), t};
    switch (traction.type) {
    case TractionType::pressure: return -traction.value[0](place) * d_area;
    case TractionType::traction: return load.share * dot(area, d_area) / norm(area) * evaluate<D>(traction.value, place);
    case TractionType::dead: break;
    }
    return {};
}

template <int D>
LoadedFace<D> loaded_face(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Lattice<D>& g,
                          const ParticleView<D>& p, std::ptrdiff_t i, double t)
{
    const FaceShape<D> face = shape_of_face(load, g, p, i);
    return {force_on(load, tractions, face.area, g.inside_period(p.x[i] + face.arm), t), face.arm};
}

template <int D>
void evaluate_loads(const std::vector<Load<D>>& loads, const std::vector<Traction<D>>& tractions, const Lattice<D>& g,
                    const ParticleView<D>& p, double t)
{
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        Vec<D> force{};
        Mat<D> moment{};
        for (int l = p.load[i]; l >= 0; l = loads[l].is_last ? -1 : l + 1) {
            const LoadedFace<D> face = loaded_face(loads[l], tractions, g, p, i, t);
            force += face.force;
            moment += outer(face.force, face.arm);
        }
        p.traction[i]        = force;
        p.traction_moment[i] = moment;
    });
}

#define ORDO_TRACTIONS(D)                                                                                                       \
    template int add_loads(std::vector<Load<D>>&, Particles<D>&, const CellMesh<D>&, int, int,                                  \
                           const std::function<double(const Vec<D>&, const Vec<D>&)>&);                                         \
    template FaceShape<D> shape_of_face(const Load<D>&, const Lattice<D>&, const ParticleView<D>&, std::ptrdiff_t);             \
    template Vec<D> force_on(const Load<D>&, const std::vector<Traction<D>>&, const Vec<D>&, const Vec<D>&, double);            \
    template Vec<D> force_by_area(const Load<D>&, const std::vector<Traction<D>>&, const Vec<D>&, const Vec<D>&, const Vec<D>&, \
                                  double);                                                                                      \
    template LoadedFace<D> loaded_face(const Load<D>&, const std::vector<Traction<D>>&, const Lattice<D>&,                      \
                                       const ParticleView<D>&, std::ptrdiff_t, double);                                         \
    template void evaluate_loads(const std::vector<Load<D>>&, const std::vector<Traction<D>>&, const Lattice<D>&,               \
                                 const ParticleView<D>&, double);
ORDO_TRACTIONS(1)
ORDO_TRACTIONS(2)
ORDO_TRACTIONS(3)
#undef ORDO_TRACTIONS

}  // namespace ordo
