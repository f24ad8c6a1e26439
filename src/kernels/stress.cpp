#include "kernels/stress.hpp"

#include "material/laws.hpp"

namespace ordo {

namespace {

template <int D, class L>
constexpr StressPass<D> pass_of()
{
    if constexpr (D <= L::max_dim)
        return update_stress<L, D>;
    else
        return nullptr;
}

template <int D, class... L>
StressPass<D> pass_of_row(std::size_t row, LawList<L...>)
{
    constexpr StressPass<D> passes[] = {pass_of<D, L>()...};
    return passes[row];
}

}  // namespace

template <int D>
StressPass<D> find_stress_pass(const LawRow& law)
{
    return pass_of_row<D>(static_cast<std::size_t>(&law - laws().data()), Laws{});
}

template StressPass<1> find_stress_pass(const LawRow&);
template StressPass<2> find_stress_pass(const LawRow&);
template StressPass<3> find_stress_pass(const LawRow&);

}  // namespace ordo
