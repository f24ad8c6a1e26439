#include "sim/output_fields.hpp"

#include "material/outside_law.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

namespace ordo {

namespace {

template <int D>
struct OutputField {
    const char *name, *what, *unit;
    int components;
    void (*get)(const FieldReader<D>&, int i, double* out);
};

template <int D>
void put(const Vec<D>& v, double* out)
{
    for (int a = 0; a < 3; ++a) out[a] = a < D ? v[a] : 0.0;
}
void put(const Mat<3>& m, double* out)
{
    for (int c = 0; c < 9; ++c) out[c] = m(c / 3, c % 3);
}

template <int D>
Mat<3> full_gradient(const Mat<D>& F)
{
    Mat<3> full = Mat<3>::identity();
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) full(a, b) = F(a, b);
    return full;
}

double von_mises(Mat<3> stress)
{
    const double mean = trace(stress) / 3;
    for (int a = 0; a < 3; ++a) stress(a, a) -= mean;
    return std::sqrt(1.5 * ddot(stress, stress));
}

template <int D>
using Of = const FieldReader<D>&;

template <int D>
constexpr OutputField<D> kFields[] = {
    // The first is no choice of the input: it is written with every domain, whose points in the file are its corners.
    {"position", "", "m", 3, [](Of<D> f, int i, double* out) { put(place_in_period(f.model(), f.particles(), i), out); }},
    {"displacement", "x - X", "m", 3, [](Of<D> f, int i, double* out) { put(displacement(f.model(), f.particles(), i), out); }},
    {"velocity", "", "m/s", 3, [](Of<D> f, int i, double* out) { put(f.particles().v[i], out); }},
    {"stress", "Cauchy stress, 9 components", "Pa", 9,
     [](Of<D> f, int i, double* out) { put(full(f.particles().sigma[i]), out); }},
    {"deformation_gradient", "F, 9 components", "", 9,
     [](Of<D> f, int i, double* out) { put(full_gradient(f.particles().F[i]), out); }},
    {"density", "m/V", "kg/m^3", 1, [](Of<D> f, int i, double* out) { *out = f.particles().m[i] / f.particles().V[i]; }},
    {"mass", "", "kg", 1, [](Of<D> f, int i, double* out) { *out = f.particles().m[i]; }},
    {"volume", "J V0", "m^3", 1, [](Of<D> f, int i, double* out) { *out = f.particles().V[i]; }},
    {"pressure", "-tr(sigma)/3", "Pa", 1, [](Of<D> f, int i, double* out) { *out = -trace(f.particles().sigma[i]) / 3; }},
    {"von_mises", "von Mises stress", "Pa", 1,
     [](Of<D> f, int i, double* out) { *out = von_mises(full(f.particles().sigma[i])); }},
    {"energy_density", "stored energy per current volume", "J/m^3", 1,
     [](Of<D> f, int i, double* out) { *out = f.stored_energy()(i) / f.particles().V[i]; }},
};

}  // namespace

const std::vector<OutputFieldText>& output_fields()
{
    return kept_with_laws([] {
        std::vector<OutputFieldText> r;
        for (const auto& f : std::span(kFields<3>).subspan(1)) r.push_back({f.name, f.what, f.unit});
        for (const LawRow* law : all_laws())
            for (const HistoryColumn& c : law->history)
                if (std::none_of(r.begin(), r.end(), [&](const auto& row) { return row.name == c.name; }))
                    r.push_back({std::string(c.name), std::string(c.what) + ", of " + std::string(law->name), ""});
        return r;
    });
}

bool is_computed_field(std::string_view name)
{
    return std::any_of(std::begin(kFields<3>), std::end(kFields<3>), [&](const auto& f) { return f.name == name; });
}

template <int D>
FieldReader<D>::FieldReader(std::string_view name, const Model<D>& model, const Particles<D>& p)
    : model_(&model), p_(&p), energy_(model.materials, p)
{
    const auto field = std::find_if(std::begin(kFields<D>), std::end(kFields<D>), [&](const auto& f) { return f.name == name; });
    if (field != std::end(kFields<D>)) {
        components_ = field->components;
        get_        = field->get;
        return;
    }
    const int column = p.history_column(name);
    if (column < 0) throw std::logic_error("FieldReader: no field " + std::string(name));
    history_ = p.history[column].data();
    get_     = [](const FieldReader& f, int i, double* out) { *out = f.history()[i]; };
}

template class FieldReader<1>;
template class FieldReader<2>;
template class FieldReader<3>;

}  // namespace ordo
