#include "implicit/particle_forces.hpp"

#include "method/averaging.hpp"

#include <algorithm>
#include <cmath>

namespace ordo {

template <int D>
ParticleForces<D>::ParticleForces(const Model<D>& model, State<D>& s, double dt, bool is_middle)
    : model_(model), s_(s), dt_(dt), is_middle_(is_middle)
{
    const auto n = static_cast<std::size_t>(s.particles.x.size());
    for (std::size_t k = 0; k < model.materials.size(); ++k) {
        const Material& m = model.materials[k];
        OfMaterial& one   = materials_.emplace_back(OfMaterial{find_nominal_pass<D>(*m.law), static_cast<int>(k), {}});
        ORDO_EXPECT(one.pass);  // see require_implicit_model
        for (const HistoryColumn& c : history_of(m, D)) one.columns.push_back(s.particles.history_column(c.name));
    }
    const ParticleView<D> p = s.particles.view();
    faces_.resize(model.loads.size());
    if (!model.loads.empty())
        parallel_for_each(p.count, [&](std::ptrdiff_t i) {
            for (int l = p.load[i]; l >= 0; l = model.loads[l].is_last ? -1 : l + 1)
                faces_[l] = shape_of_face(model.loads[l], s.lattice, p, i);
        });
    f_ = Array<Mat<D>>(n), stress_ = Array<Mat<D>>(n), moment_ = Array<Mat<D>>(n), force_ = Array<Vec<D>>(n);
    load_moment_ = Array<Mat<D>>(n), u_ = Array<Vec<D>>(n);
    if (!has_averages()) return;
    averaged_ = Array<Mat<D>>(n);
    d_stress_ = Array<Mat<D>>(n);
    for (Array<double>* a : {&scale_, &ratio_, &mean_, &part_, &mean_part_, &d_mean_, &d_part_, &d_mean_part_})
        *a = Array<double>(n);
    prepare_averages(model, s);
}

template <int D>
Vec<D> ParticleForces<D>::traction_on(const Load<D>& load, const FaceShape<D>& face, int i, const Vec<D>& u, const Mat<D>& f,
                                      double t) const
{
    return force_on(load, model_.tractions, cofactor(f) * face.area,
                    s_.lattice.inside_period(s_.particles.x[i] + u + f * face.arm), t);
}

/// The virtual work of a face is that of its force times the displacement of its centre, which is linear in the particle: its moment has the arm
/// at the start of the step.
template <int D>
void ParticleForces<D>::find_loads(const Vec<D>* u, const Mat<D>* f, double t)
{
    const ParticleView<D> p = s_.particles.view();
    const double part       = is_middle_ ? 0.5 : 1.0;
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        Vec<D> force = p.b ? p.m[i] * p.b[i] : Vec<D>{};
        Mat<D> moment{};
        for (int l = model_.loads.empty() ? -1 : p.load[i]; l >= 0; l = model_.loads[l].is_last ? -1 : l + 1) {
            const Vec<D> one = traction_on(model_.loads[l], faces_[l], static_cast<int>(i), part * u[i], part_of(f[i]), t);
            force += one;
            moment += outer(one, faces_[l].arm);
        }
        force_[i]       = force;
        load_moment_[i] = moment;
    });
}

/// f scaled so that its volume ratio, or with laws of memory its dilation, is the average A, see averaging.hpp:
/// s = (A j/(r det f))^(1/D) with j = J det f and r = det F_n, or j = det f and r = 1.
template <int D>
void ParticleForces<D>::average_steps(const Mat<D>* f)
{
    const ParticleView<D> p = s_.particles.view();
    auto is_total           = [&](std::ptrdiff_t i) { return model_.materials[p.material[i]].law->is_hyperelastic; };
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { ratio_[i] = mean_[i] = (is_total(i) ? p.J[i] : 1.0) * det(f[i]); });
    average(model_.method, s_, mean_.data());
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        scale_[i]    = std::pow(mean_[i] / (det(f[i]) * (is_total(i) ? det(p.F[i]) : 1.0)), 1.0 / D);
        averaged_[i] = scale_[i] * f[i];
    });
}

/// From the stress that is work-conjugate to s f to that of f. With c = Pi : s f/D and e = c/(w A j), A self-adjoint in the weights w,
/// Pi : d(s f) = s Pi : df + c (d(A j)/(A j) - d(det f)/det f), and sum c d(A j)/(A j) = sum w (A e) dj, dj = j f^-T : df.
template <int D>
void ParticleForces<D>::spread_averages(const Mat<D>* f)
{
    const ParticleView<D> p = s_.particles.view();
    const double* w         = s_.averages.weights.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        part_[i]      = ddot(stress_[i], averaged_[i]) / D;
        mean_part_[i] = part_[i] / (w[i] * mean_[i]);
    });
    average(model_.method, s_, mean_part_.data());
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const Mat<D> inverse_T = cofactor(f[i]) * (1 / det(f[i]));
        moment_[i] -= scale_[i] * stress_[i] + (w[i] * mean_part_[i] * ratio_[i] - part_[i]) * inverse_T;
    });
}

template <int D>
TileReport ParticleForces<D>::find(const Vec<D>* u, const Mat<D>* f, bool with_derivatives)
{
    const ParticleView<D> p = s_.particles.view();
    TileReport report;
    const std::ptrdiff_t none = p.count;
    const auto turned         = parallel_reduce(
                p.count, none, [&](std::ptrdiff_t i) { return det(f[i]) > 0 ? none : i; },
                [](std::ptrdiff_t& least, std::ptrdiff_t one) { least = std::min(least, one); });
    if (turned < none) {
        report.flag(Fault::inverted, static_cast<int>(turned));
        return report;
    }
    std::copy_n(f, p.count, f_.data());
    std::copy_n(u, p.count, u_.data());
    if (has_averages()) average_steps(f);
    if (with_derivatives && tangent_.empty()) tangent_ = Array<Tangent<D>>(static_cast<std::size_t>(p.count));
    const TrialStep<D> trial{p,
                             model_.materials.data(),
                             dt_,
                             is_middle_,
                             has_averages() ? averaged_.data() : f_.data(),
                             stress_.data(),
                             with_derivatives ? tangent_.data() : nullptr};
    std::vector<TileReport> reports(s_.field.tiles.tiles().size());
    s_.field.tiles.for_each([&](std::ptrdiff_t k, const Tile& tile) {
        for (const OfMaterial& one : materials_)
            one.pass(trial, one.material, one.columns.data(), tile.begin, tile.end, reports[k]);
    });
    for (const TileReport& r : reports)
        if (r.fault != Fault::none) report.flag(r.fault, r.particle);
    if (report.fault != Fault::none) return report;
    find_loads(u, f, s_.t + (is_middle_ ? 0.5 : 1.0) * dt_);
    const auto endless = parallel_reduce(
        p.count, none, [&](std::ptrdiff_t i) { return std::isfinite(norm(force_[i])) ? none : i; },
        [](std::ptrdiff_t& least, std::ptrdiff_t one) { least = std::min(least, one); });
    if (endless < none) {
        report.flag(Fault::not_finite, static_cast<int>(endless));
        return report;
    }
    find_moments(f);
    return report;
}

/// Of the stresses and the loads.
template <int D>
void ParticleForces<D>::find_moments(const Mat<D>* f)
{
    std::copy_n(load_moment_.data(), s_.particles.count, moment_.data());
    if (has_averages())
        spread_averages(f);
    else
        parallel_for_each(s_.particles.count, [&](std::ptrdiff_t i) { moment_[i] -= stress_[i]; });
}

/// Of a step f = I, scaled by averages to s I, Pi = V s^(D-1) sigma.
template <int D>
void ParticleForces<D>::find_at_start()
{
    const ParticleView<D> p = s_.particles.view();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { f_[i] = Mat<D>::identity(), u_[i] = {}; });
    if (has_averages()) average_steps(f_.data());
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const double volume = p.V0[i] * det(p.F[i]) * (has_averages() ? std::pow(scale_[i], D - 1) : 1.0);
        for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) stress_[i](a, b) = volume * p.sigma[i](a, b);
    });
    find_loads(u_.data(), f_.data(), s_.t);
    find_moments(f_.data());
}

template <int D>
bool ParticleForces<D>::has_symmetric_tangents() const
{
    constexpr double rounding = 1e-9;
    struct Sizes {
        double whole, skew;
    };
    const Sizes most = parallel_reduce(
        s_.particles.count, Sizes{},
        [&](std::ptrdiff_t i) {
            Sizes r{};
            for (int j = 0; j < D * D; ++j)
                for (int k = 0; k <= j; ++k) {
                    const double one = tangent_[i].c[j][k], other = tangent_[i].c[k][j];
                    r.whole = std::max(r.whole, std::fabs(one));
                    r.skew  = std::max(r.skew, std::fabs(one - other));
                }
            return r;
        },
        [](Sizes& total, const Sizes& one) {
            total = {std::max(total.whole, one.whole), std::max(total.skew, one.skew)};
        });
    return most.skew <= rounding * most.whole;
}

template <int D>
void ParticleForces<D>::differentiate(const Mat<D>* df, Vec<D>* force, Mat<D>* moment)
{
    const ParticleView<D> p = s_.particles.view();
    const double part       = is_middle_ ? 0.5 : 1.0;
    auto trace_of           = [&](std::ptrdiff_t i) { return ddot(cofactor(f_[i]), df[i]) / det(f_[i]); };  // f^-T : df
    auto add_loads          = [&](std::ptrdiff_t i) {
        force[i] = {};
        for (int l = model_.loads.empty() ? -1 : p.load[i]; l >= 0; l = model_.loads[l].is_last ? -1 : l + 1) {
            const Mat<D> at = part_of(f_[i]), change = part * df[i], cof = cofactor(at);
            const Vec<D> area = cof * faces_[l].area;
            // d cof(f) = ((f^-T : df) I - f^-T df^T) cof(f)
            const Vec<D> d_area = (ddot(cof, change) / det(at)) * area - (1 / det(at)) * (cof * (transpose(change) * area));
            const Vec<D> place  = s_.lattice.inside_period(p.x[i] + part * u_[i] + at * faces_[l].arm);
            const Vec<D> one    = force_by_area(model_.loads[l], model_.tractions, area, d_area, place, s_.t + part * dt_);
            force[i] += one;
            moment[i] += outer(one, faces_[l].arm);
        }
    };
    if (!has_averages()) {
        parallel_for_each(p.count, [&](std::ptrdiff_t i) {
            moment[i] = -1.0 * (tangent_[i] * df[i]);
            add_loads(i);
        });
        return;
    }
    const double* w = s_.averages.weights.data();
    parallel_for_each(p.count, [&](std::ptrdiff_t i) { d_mean_[i] = ratio_[i] * trace_of(i); });
    average(model_.method, s_, d_mean_.data());
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const double d_scale    = scale_[i] / D * (d_mean_[i] / mean_[i] - trace_of(i));
        const Mat<D> d_averaged = scale_[i] * df[i] + d_scale * f_[i];
        d_stress_[i]            = tangent_[i] * d_averaged;
        d_part_[i]              = (ddot(d_stress_[i], averaged_[i]) + ddot(stress_[i], d_averaged)) / D;
        d_mean_part_[i]         = (d_part_[i] - part_[i] * d_mean_[i] / mean_[i]) / (w[i] * mean_[i]);
        moment[i]               = -1.0 * (scale_[i] * d_stress_[i] + d_scale * stress_[i]);
    });
    average(model_.method, s_, d_mean_part_.data());
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        const Mat<D> inverse_T = cofactor(f_[i]) * (1 / det(f_[i]));
        const double d_ratio   = ratio_[i] * trace_of(i);
        const double factor    = w[i] * mean_part_[i] * ratio_[i] - part_[i];
        const double d_factor  = w[i] * (d_mean_part_[i] * ratio_[i] + mean_part_[i] * d_ratio) - d_part_[i];
        // d f^-T = -f^-T df^T f^-T
        moment[i] -= d_factor * inverse_T - factor * (inverse_T * transpose(df[i]) * inverse_T);
        add_loads(i);
    });
}

template class ParticleForces<1>;
template class ParticleForces<2>;
template class ParticleForces<3>;

}  // namespace ordo
