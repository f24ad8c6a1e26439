#include "verification/any_law.hpp"

#include "base/error.hpp"
#include "material/laws.hpp"

#include <string>

namespace ordo::verification {

namespace {

/// The Cauchy stress by the law with the name of the material's law.
template <int D, class T, class... L>
Stress<D, T> stress_of(LawList<L...>, const Material& m, const Mat<D, T>& F)
{
    Stress<D, T> r{};
    auto try_law = [&]<class Law>() {
        if constexpr (Hyperelastic<Law>)
            if (m.law->name == Law::name) r = Law::of(m).cauchy(F);
    };
    (try_law.template operator()<L>(), ...);
    return r;
}

}  // namespace

template <int D>
AnyLaw<D>::AnyLaw(const Material& material) : material_(material)
{
    if (!material.law->is_hyperelastic)
        throw InputError("material: the stress of " + std::string(material.law->name) +
                         " is not a function of F, as a manufactured solution requires");
}

template <int D>
Stress<D, Gradient<D>> AnyLaw<D>::cauchy(const Mat<D, Gradient<D>>& F) const
{
    return stress_of(Laws{}, material_, F);
}

template <int D>
Stress<D, Gradient<D, Lanes>> AnyLaw<D>::cauchy(const Mat<D, Gradient<D, Lanes>>& F) const
{
    return stress_of(Laws{}, material_, F);
}

template class AnyLaw<1>;
template class AnyLaw<2>;
template class AnyLaw<3>;

}  // namespace ordo::verification
