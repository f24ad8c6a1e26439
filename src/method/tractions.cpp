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
LoadedFace<D> loaded_face(const Load<D>& load, const std::vector<Traction<D>>& tractions, const Lattice<D>& g,
                          const ParticleView<D>& p, std::ptrdiff_t i, double t)
{
    LoadedFace<D> r{};
    Vec<D> area{};
    if (p.cell) {
        Vec<D> at[Face<D>::max_corners]{};
        for (int c = 0; c < load.face.count; ++c) {
            at[c] = p.corner[p.cell[i][load.face.corner[c]]];
            for (int a = 0; a < D; ++a)
                if (g.periodic[a]) at[c][a] -= p.turns[i][a] * (g.cells[a] * g.h[a]);
        }
        area  = D == 1 ? load.area0 : face_area(at, load.face.count);
        r.arm = face_center(at, load.face.count) - p.x[i];
    } else {
        area  = cofactor(p.F[i]) * load.area0;
        r.arm = p.F[i] * load.arm0;
    }
    const Traction<D>& traction = tractions[load.traction];
    const FieldPoint place{padded(g.inside_period(p.x[i] + r.arm)), padded(load.center0), t};
    switch (traction.type) {
    case TractionType::pressure: r.force = -traction.value[0](place) * area; break;
    case TractionType::traction: r.force = load.share * norm(area) * evaluate<D>(traction.value, place); break;
    case TractionType::dead: r.force = load.share * norm(load.area0) * evaluate<D>(traction.value, place); break;
    }
    return r;
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

template int add_loads(std::vector<Load<1>>&, Particles<1>&, const CellMesh<1>&, int, int,
                       const std::function<double(const Vec<1>&, const Vec<1>&)>&);
template int add_loads(std::vector<Load<2>>&, Particles<2>&, const CellMesh<2>&, int, int,
                       const std::function<double(const Vec<2>&, const Vec<2>&)>&);
template int add_loads(std::vector<Load<3>>&, Particles<3>&, const CellMesh<3>&, int, int,
                       const std::function<double(const Vec<3>&, const Vec<3>&)>&);
template LoadedFace<1> loaded_face(const Load<1>&, const std::vector<Traction<1>>&, const Lattice<1>&, const ParticleView<1>&,
                                   std::ptrdiff_t, double);
template void evaluate_loads(const std::vector<Load<1>>&, const std::vector<Traction<1>>&, const Lattice<1>&,
                             const ParticleView<1>&, double);
template LoadedFace<2> loaded_face(const Load<2>&, const std::vector<Traction<2>>&, const Lattice<2>&, const ParticleView<2>&,
                                   std::ptrdiff_t, double);
template void evaluate_loads(const std::vector<Load<2>>&, const std::vector<Traction<2>>&, const Lattice<2>&,
                             const ParticleView<2>&, double);
template LoadedFace<3> loaded_face(const Load<3>&, const std::vector<Traction<3>>&, const Lattice<3>&, const ParticleView<3>&,
                                   std::ptrdiff_t, double);
template void evaluate_loads(const std::vector<Load<3>>&, const std::vector<Traction<3>>&, const Lattice<3>&,
                             const ParticleView<3>&, double);

}  // namespace ordo
