// The passes of least-squares fits: velocities at nodes, and fields in cells.
#include "kernels/cell_fields.hpp"
#include "kernels/velocity_fit.hpp"
#include "method/passes.hpp"

#include <stdexcept>

namespace ordo {

namespace {

template <int D, int degree, bool is_limited, class Places, int W>
VelocityFitPasses<D> velocity_fit()
{
    return {VelocityMoments<D, degree, is_limited>::size, work_of_sample<D, degree, D, Places, W, is_limited>(),
            spread_velocity<D, degree, Places, W, is_limited>, solve_velocity<D, degree, is_limited>};
}

template <int D, int degree, bool is_limited, class Places>
VelocityFitPasses<D> velocity_fit_of(Weight weight)
{
    switch (weight) {
    case Weight::hat: return velocity_fit<D, degree, is_limited, Places, 2>();
    case Weight::quadratic: return velocity_fit<D, degree, is_limited, Places, 3>();
    case Weight::cubic: return velocity_fit<D, degree, is_limited, Places, 4>();
    }
    throw std::logic_error("velocity_fit_of: unhandled choice");
}

template <int D, int degree, bool is_limited>
VelocityFitPasses<D> velocity_fit_on(const MethodSpec& spec)
{
    return has_splines(spec) ? velocity_fit_of<D, degree, is_limited, SplineNodes>(spec.weight)
                             : velocity_fit_of<D, degree, is_limited, HatNodes>(spec.weight);
}

template <int D, int degree>
void set_one_point(const Lattice<D>& g, const Index<D>& cell, const Lanes* record, const Lanes&, const Vec<D>& distance, double V,
                   bool, const ParticleView<D>& q, int first, FitReport& report)
{
    Vec<D> x = g.cell_center(cell);
    for (int a = 0; a < D; ++a) x[a] += distance[a] * g.h[a];
    set_cell_point<D, degree>(record, distance, x, V, q, first, report.dropped);
}

template <int D, int degree>
void set_all_gauss_points(const Lattice<D>& g, const Index<D>& cell, const Lanes* record, const Lanes& content, const Vec<D>&,
                          double V, bool is_edge, const ParticleView<D>& q, int first, FitReport& report)
{
    set_gauss_points<D, degree>(record, content, g.cell_center(cell), g.h, V, is_edge, q, first, report.dropped);
}

template <int D, int degree>
CellFitPasses<D> cell_fit(bool is_gauss)
{
    if (is_gauss)
        return {CellFields<D, true>::template Record<degree>::size, 1 << D,
                [](int) { return CellFields<D, true>::template Record<degree>::size; }, spread_gauss_cells<D, degree>,
                set_all_gauss_points<D, degree>};
    return {CellFields<D, false>::template Record<degree>::size, 1,
            work_of_sample<D, degree, CellFields<D, false>::count, CellCenters, 3>, spread_one_point_cells<D, degree>,
            set_one_point<D, degree>};
}

/// f(std::integral_constant<int, degree>) for a degree 0..3.
template <class F>
auto with_degree(double degree, F&& f)
{
    switch (static_cast<int>(degree)) {
    case 0: return f(std::integral_constant<int, 0>{});
    case 1: return f(std::integral_constant<int, 1>{});
    case 2: return f(std::integral_constant<int, 2>{});
    case 3: return f(std::integral_constant<int, 3>{});
    }
    throw std::logic_error("with_degree: a degree from 0 to 3");
}

}  // namespace

template <int D>
VelocityFitPasses<D> choose_velocity_fit(const MethodSpec& spec)
{
    if (!fits_velocity(spec)) return {};
    if (spec.limiter == Limiter::slope) return velocity_fit_on<D, 1, true>(spec);
    return with_degree(spec.degree, [&](auto degree) { return velocity_fit_on<D, degree.value, false>(spec); });
}

template <int D>
CellFitPasses<D> choose_cell_fit(const MethodSpec& spec)
{
    const bool is_gauss = has_gauss_forces(spec) || has_tls_velocity(spec);
    if (!is_gauss && spec.quadrature != Quadrature::cell) return {};
    return with_degree(spec.degree, [&](auto degree) { return cell_fit<D, degree.value>(is_gauss); });
}

template VelocityFitPasses<1> choose_velocity_fit(const MethodSpec&);
template VelocityFitPasses<2> choose_velocity_fit(const MethodSpec&);
template VelocityFitPasses<3> choose_velocity_fit(const MethodSpec&);
template CellFitPasses<1> choose_cell_fit(const MethodSpec&);
template CellFitPasses<2> choose_cell_fit(const MethodSpec&);
template CellFitPasses<3> choose_cell_fit(const MethodSpec&);

}  // namespace ordo
