#include "verification/lattice_operator.hpp"

#include "base/error.hpp"
#include "method/planting.hpp"
#include "setup/schemes.hpp"
#include "verification/eigenvalues.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ordo::verification {

namespace {

using Complex = std::complex<double>;

constexpr double kPi = std::numbers::pi;

/// The value to which a degree of freedom is set. It is so small that second-order terms vanish, 1 + kTiny == 1: the step is
/// linear to the last bit and does not move the lattice. Rate laws carry the stress itself, so nothing cancels.
constexpr double kTiny = 0x1p-80;

/// The origin of the box. No coordinate is zero: even the smallest velocity would move it.
constexpr double kOrigin = 1.0;

template <int D>
int index_in_box(const Index<D>& k, int cells)
{
    int r = 0;
    for (int a = D - 1; a >= 0; --a) r = r * cells + k[a];
    return r;
}

}  // namespace

template <int D>
Model<D> model_of(const ParticleLattice& lattice, std::string_view law)
{
    Model<D> m{};
    m.method            = lattice.method;
    m.origin            = Vec<D>::filled(kOrigin);
    m.h                 = Vec<D>::filled(1.0);
    m.cells             = Index<D>::filled(lattice.cells);
    m.periodic          = Vec<D, bool>::filled(true);
    const double nu     = lattice.poisson;
    const double lambda = nu / (1 - nu);  // for lambda + 2 mu = 1
    m.materials         = {{find_law(law), 1.0, lambda, 0.5 * (1 - lambda)}};
    m.body_forces.resize(1);
    return m;
}

template <int D>
std::vector<Seed<D>> seeds_of(const ParticleLattice& lattice)
{
    const int n = lattice.per_axis;
    Mat<D> edges{};
    for (int a = 0; a < D; ++a) edges(a, a) = 0.5 / n;
    std::vector<Seed<D>> seeds;
    IndexBox<D>{{}, Index<D>::filled(lattice.cells)}.for_each([&](const Index<D>& cell) {
        IndexBox<D>{{}, Index<D>::filled(n)}.for_each([&](const Index<D>& k) {
            Vec<D> x{};
            for (int a = 0; a < D; ++a) x[a] = kOrigin + (cell[a] + (k[a] + 0.5 + lattice.shift) / n);
            seeds.push_back({x, std::pow(1.0 / n, D), edges});
        });
    });
    return seeds;
}

template <int D>
LatticeOperator<D>::LatticeOperator(const ParticleLattice& lattice)
    : scheme_(make_scheme(model_of<D>(lattice, rate_law<D>))), cells_(lattice.cells)
{
    const Model<D>& model = scheme_->model();
    if (field_groups(model).corner_samples)
        throw InputError("samples corners with domains that are cells: corners have velocities of their own, which are not part "
                         "of the map of particles; use domain parallelepiped");
    if (has_enrichment(model.method))
        throw InputError("enriched corners: a periodic lattice of particles has no interface, and its seam would cut finite "
                         "elements; use cpdi2");
    if (model.method.limiter != Limiter::none)
        throw InputError("limiter: what nodes take depends on the velocities, and no matrix describes the step; use limiter = "
                         "none, or cpls for cpls-limited");
    if (model.method.filter != Filter::none && model.method.filter_every > 1)
        throw InputError("filter_every above 1: steps differ, and one matrix does not describe them; use filter_every = 1");
    state_                = scheme_->start(plant_all(model, seeds_of<D>(lattice)));
    const Particles<D>& p = state_.particles;
    particles_            = p.count / static_cast<int>(std::lround(std::pow(cells_, D)));
    of_id_.resize(p.count);
    for (int i = 0; i < p.count; ++i) of_id_[p.id[i]] = i;

    for (int a = 0; a < D; ++a) fields_.push_back({Field::velocity, a, 0});
    for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) fields_.push_back({Field::stress, a, b});
    for (int a = 0; a < D && !p.L.empty(); ++a)
        for (int b = 0; b < D; ++b) fields_.push_back({Field::gradient, a, b});
    const int modes = p.modes.empty() ? 1 : power_of(static_cast<int>(model.method.degree) + 1, D);
    for (int k = 1; k < modes; ++k)
        for (int a = 0; a < D; ++a) fields_.push_back({Field::mode, k, a});
}

template <int D>
double& LatticeOperator<D>::at(int particle, const Field& f)
{
    Particles<D>& p = state_.particles;
    switch (f.kind) {
    case Field::velocity: return p.v[particle][f.a];
    case Field::stress: return p.sigma[particle](f.a, f.b);
    case Field::gradient: return p.L[particle](f.a, f.b);
    case Field::mode: return p.modes[particle].c[f.a][f.b];
    }
    return p.v[particle][0];
}

/// Resets the lattice to zero velocities and stresses, as after a first step.
template <int D>
void LatticeOperator<D>::rest()
{
    Particles<D>& p = state_.particles;
    for (int i = 0; i < p.count; ++i) {
        p.F[i]     = Mat<D>::identity();
        p.sigma[i] = {};
        for (const Field& f : fields_) at(i, f) = 0.0;
    }
    state_.n = 1;
}

template <int D>
void LatticeOperator<D>::assemble(double courant)
{
    const int n = size(), per_particle = static_cast<int>(fields_.size());
    const int in_box   = static_cast<int>(of_id_.size()) / particles_;
    const auto numbers = static_cast<std::size_t>(n) * n;
    blocks_.assign(numbers * in_box, 0.0);
    for (int column = 0; column < n; ++column) {
        rest();
        const int particle  = of_id_[column / per_particle];
        const Field& field  = fields_[column % per_particle];
        at(particle, field) = kTiny;
        if (field.kind == Field::stress) at(particle, {Field::stress, field.b, field.a}) = kTiny;
        state_.dt_prev = courant;
        scheme_->step(state_, courant);
        for (int cell = 0; cell < in_box; ++cell)
            for (int row = 0; row < n; ++row)
                blocks_[cell * numbers + row * n + column] =
                    at(of_id_[cell * particles_ + row / per_particle], fields_[row % per_particle]) / kTiny;
    }
    is_reached_.assign(in_box, 0);
    wraps_ = false;
    IndexBox<D>{{}, Index<D>::filled(cells_)}.for_each([&](const Index<D>& k) {
        const int cell = index_in_box(k, cells_);
        double largest = 0.0;
        for (std::size_t e = 0; e < numbers; ++e) largest = std::max(largest, std::fabs(blocks_[cell * numbers + e]));
        is_reached_[cell] = largest > 0;
        for (int a = 0; a < D; ++a) wraps_ = wraps_ || (std::abs(k[a] - cells_ / 2) <= 1 && largest > 1e-8);
    });
}

template <int D>
std::vector<Complex> LatticeOperator<D>::symbol(const Vec<D>& theta) const
{
    const auto numbers = static_cast<std::size_t>(size()) * size();
    std::vector<Complex> r(numbers);
    IndexBox<D>{{}, Index<D>::filled(cells_)}.for_each([&](const Index<D>& k) {
        const int cell = index_in_box(k, cells_);
        if (!is_reached_[cell]) return;
        double phase = 0.0;
        for (int a = 0; a < D; ++a) phase -= theta[a] * (k[a] <= cells_ / 2 ? k[a] : k[a] - cells_);
        const Complex factor = std::polar(1.0, phase);
        for (std::size_t e = 0; e < numbers; ++e) r[e] += factor * blocks_[cell * numbers + e];
    });
    return r;
}

template <int D>
std::vector<Complex> LatticeOperator<D>::eigenvalues(const Vec<D>& theta) const
{
    return eigenvalues_of(symbol(theta));
}

template <int D>
std::vector<Vec<D>> LatticeOperator<D>::wave_numbers(int intervals) const
{
    if (wraps_) intervals = cells_ / 2;
    Index<D> lo = Index<D>::filled(-intervals + 1);
    lo[0]       = 0;  // the spectrum at -theta is the conjugate
    std::vector<Vec<D>> r;
    IndexBox<D>{lo, Index<D>::filled(intervals + 1)}.for_each([&](const Index<D>& k) {
        Vec<D> theta{};
        for (int a = 0; a < D; ++a) theta[a] = kPi * k[a] / intervals;
        r.push_back(theta);
    });
    return r;
}

template <int D>
double LatticeOperator<D>::growth(int intervals) const
{
    double largest = 0.0;
    for (const Vec<D>& theta : wave_numbers(intervals))
        for (const Complex& value : eigenvalues(theta)) largest = std::max(largest, std::abs(value));
    return largest;
}

std::vector<Complex> frozen_spectrum(const SplineScheme<1>& scheme, State<1>& s)
{
    Particles<1>& p = s.particles;
    const int n     = p.count;
    std::vector<Complex> map(4 * n * n);  // of v and sigma to a and L
    for (int column = 0; column < 2 * n; ++column) {
        for (int i = 0; i < n; ++i) {
            p.v[i][0]        = column == i;
            p.sigma[i](0, 0) = column == n + i;
        }
        scheme.evaluate(s);
        for (int i = 0; i < n; ++i) {
            map[i * 2 * n + column]       = scheme.scratch().a_at[i][0];
            map[(n + i) * 2 * n + column] = scheme.scratch().L_at[i](0, 0);
        }
    }
    return eigenvalues_of(map);
}

double frozen_growth(const ParticleLattice& lattice)
{
    const SplineScheme<1> method(model_of<1>(lattice, rate_law<1>));
    State<1> s = method.start(plant_all(method.model(), seeds_of<1>(lattice)));
    double r   = 0.0;
    for (const Complex& value : frozen_spectrum(method, s)) r = std::max(r, value.real());
    return r;
}

template <int D>
StableCourantNumbers find_stable(LatticeOperator<D>& lattice, double largest)
{
    constexpr int coarse = D == 1 ? 32 : D == 2 ? 8 : 4, fine = D == 1 ? 256 : coarse;
    constexpr double step = 0.05;
    auto grows            = [&](double courant, int intervals) {
        lattice.assemble(courant);
        return lattice.growth(intervals) > 1 + kGrowthTolerance;
    };
    auto find_between = [&](double stable, double unstable) {
        while (std::fabs(unstable - stable) > 1e-6) {
            const double middle                       = 0.5 * (stable + unstable);
            (grows(middle, fine) ? unstable : stable) = middle;
        }
        return stable;
    };
    StableCourantNumbers r;
    double stable = StableCourantNumbers::smallest;
    if (grows(stable, coarse)) {
        const double below = stable;
        for (stable = step; grows(stable, fine); stable += step)
            if (stable >= 1.0) return r;
        r.from = find_between(stable, stable > step ? stable - step : below);
    }
    for (double next = stable + step; stable < largest; next += step) {
        next = std::min(next, largest);
        if (grows(next, coarse) || (next == largest && grows(next, fine))) {
            while (stable > std::max(r.from, step) && grows(stable, fine)) {  // for waves between those of the coarse search
                next   = stable;
                stable = std::max({stable - step, r.from, StableCourantNumbers::smallest});
            }
            r.to = find_between(stable, next);
            return r;
        }
        stable = next;
    }
    r.to = largest;
    return r;
}

template Model<1> model_of(const ParticleLattice&, std::string_view);
template Model<2> model_of(const ParticleLattice&, std::string_view);
template Model<3> model_of(const ParticleLattice&, std::string_view);
template std::vector<Seed<1>> seeds_of(const ParticleLattice&);
template std::vector<Seed<2>> seeds_of(const ParticleLattice&);
template std::vector<Seed<3>> seeds_of(const ParticleLattice&);
template class LatticeOperator<1>;
template class LatticeOperator<2>;
template class LatticeOperator<3>;
template StableCourantNumbers find_stable(LatticeOperator<1>&, double);
template StableCourantNumbers find_stable(LatticeOperator<2>&, double);
template StableCourantNumbers find_stable(LatticeOperator<3>&, double);

}  // namespace ordo::verification
