#include "kernels/nominal_stress.hpp"

#include "material/laws.hpp"

namespace ordo {

namespace {

template <int D, class L>
constexpr NominalPass<D> pass_of()
{
    if constexpr (D <= L::max_dim)
        return find_nominal_stress<L, D>;
    else
        return nullptr;
}

template <int D, class... L>
NominalPass<D> pass_of_row(std::size_t row, LawList<L...>)
{
    constexpr NominalPass<D> passes[] = {pass_of<D, L>()...};
    return passes[row];
}

}  // namespace

template <int D>
NominalPass<D> find_nominal_pass(const LawRow& law)
{
    if (law.outside) return nullptr;
    return pass_of_row<D>(static_cast<std::size_t>(&law - laws().data()), Laws{});
}

template NominalPass<1> find_nominal_pass(const LawRow&);
template NominalPass<2> find_nominal_pass(const LawRow&);
template NominalPass<3> find_nominal_pass(const LawRow&);

}  // namespace ordo
