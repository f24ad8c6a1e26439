#include "setup/overlap.hpp"

#include "method/place.hpp"
#include "setup/inside.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace ordo::setup {

namespace {

/// Only particles of lists may overlap others of their body.
template <int D>
bool is_listed(const BodySpec<D>& body)
{
    return std::holds_alternative<std::vector<Seed<D>>>(body.shape);
}

/// Copies of the seeds that may overlap others, in bins of the size of a grid cell.
template <int D>
class Candidates {
  public:
    Candidates(const std::vector<BodySpec<D>>& bodies, const std::vector<SeedWalk<D>>& seeds, const Model<D>& model)
        : bodies_(bodies), model_(model)
    {
        const std::vector<Bounds<D>> bounds = bounds_of(seeds);
        for_each_seed(seeds, [&](const Seed<D>& s, int k) {
            if (!is_listed(bodies[k]) && !is_near_another(s.x, reach_of_domain(s), k, bounds)) return;
            bins_.emplace_back(bin_of(s.x), static_cast<int>(seeds_.size()));
            seeds_.push_back(s);
            body_.push_back(k);
        });
        std::sort(bins_.begin(), bins_.end());
    }

    void require_apart() const
    {
        for (const auto& [bin, i] : bins_) require_others_outside(i);
    }

  private:
    std::uint64_t bin_of(const Vec<D>& x) const
    {
        std::uint64_t key = 0;
        for (int a = D - 1; a >= 0; --a)
            key = key * static_cast<std::uint64_t>(model_.cells[a]) +
                  static_cast<std::uint64_t>(std::clamp((x[a] - model_.origin[a]) / model_.h[a], 0.0, model_.cells[a] - 0.5));
        return key;
    }

    void require_outside(int j, int i, const Mat<D>& to_domain) const
    {
        if (j == i) return;
        const Vec<D> local = to_domain * (seeds_[j].x - seeds_[i].x);
        bool inside        = true;
        for (int a = 0; a < D; ++a) inside = inside && std::fabs(local[a]) < 1 - 1e-9;
        if (!inside) return;
        const int one = std::max(body_[i], body_[j]), other = std::min(body_[i], body_[j]);
        throw SetupError(Part::body, one, "shape",
                         fmt::format("body \"{}\" overlaps {} near {}; move them apart", bodies_[one].name,
                                     one == other ? "itself" : "body \"" + bodies_[other].name + "\"", place_text(seeds_[j].x)));
    }

    /// No other centre may lie in the domain of seed i, which may reach over several bins.
    void require_others_outside(int i) const
    {
        const Seed<D>& s       = seeds_[i];
        const Mat<D> to_domain = inverse(s.edges);
        const Vec<D> reach     = reach_of_domain(s);
        double count           = 1;
        for (int a = 0; a < D; ++a) count *= std::ceil(2 * reach[a] / model_.h[a]) + 1;
        if (!(count <= static_cast<double>(bins_.size()))) {  // the domain has more bins than there are particles
            for (const auto& other : bins_) require_outside(other.second, i, to_domain);
            return;
        }
        Index<D> n{};
        for (int a = 0; a < D; ++a) n[a] = static_cast<int>(std::ceil(2 * reach[a] / model_.h[a])) + 1;
        IndexBox<D>{{}, n}.for_each([&](const Index<D>& k) {
            Vec<D> at{};
            for (int a = 0; a < D; ++a) at[a] = s.x[a] - reach[a] + std::min(k[a] * model_.h[a], 2 * reach[a]);
            const std::uint64_t bin = bin_of(at);
            for (auto it = std::lower_bound(bins_.begin(), bins_.end(), std::pair{bin, 0}); it != bins_.end() && it->first == bin;
                 ++it)
                require_outside(it->second, i, to_domain);
        });
    }

    const std::vector<BodySpec<D>>& bodies_;
    const Model<D>& model_;
    std::vector<Seed<D>> seeds_;
    std::vector<int> body_;  ///< of each
    std::vector<std::pair<std::uint64_t, int>> bins_;
};

/// Boxes that overlap by less than half a particle hold no centre of the other's particles.
template <int D>
void require_boxes_apart(const std::vector<BodySpec<D>>& bodies, const Model<D>& model)
{
    constexpr double bearable = 0.01;  // of a sub-cell
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const auto *one = std::get_if<Bounds<D>>(&bodies[i].shape), *other = std::get_if<Bounds<D>>(&bodies[j].shape);
            if (!one || !other) continue;
            double shared = 1.0, particle = 1.0;
            for (int a = 0; a < D; ++a) {
                shared *= std::max(0.0, std::min(one->upper[a], other->upper[a]) - std::max(one->lower[a], other->lower[a]));
                particle *= model.h[a] / std::max(bodies[i].particles_per_cell[a], bodies[j].particles_per_cell[a]);
            }
            if (shared <= bearable * particle) continue;
            throw SetupError(
                Part::body, static_cast<int>(i), "shape",
                fmt::format("body \"{}\" overlaps body \"{}\": {:.3g} {} would be there twice, the mass of {:.2g} particles; "
                            "move them apart",
                            bodies[i].name, bodies[j].name, shared * model.materials[bodies[i].material].density,
                            std::array{"kg/m^2", "kg/m", "kg"}[D - 1], shared / particle));
        }
}

}  // namespace

template <int D>
void require_apart(const std::vector<BodySpec<D>>& bodies, std::vector<SeedWalk<D>> seeds, const Model<D>& model)
{
    require_boxes_apart(bodies, model);
    if (bodies.size() == 1 && !is_listed(bodies[0])) return;
    // The seed of a mesh cell is a box of its volume, which reaches out of slender cells: less than half of it counts.
    for (std::size_t k = 0; k < bodies.size(); ++k)
        if (is_mesh(bodies[k]))
            seeds[k] = [whole = std::move(seeds[k])](const auto& f) {
                whole([&](Seed<D> s) {
                    s.edges *= 0.4;
                    f(s);
                });
            };
    Candidates<D>(bodies, seeds, model).require_apart();
}

template void require_apart(const std::vector<BodySpec<1>>&, std::vector<SeedWalk<1>>, const Model<1>&);
template void require_apart(const std::vector<BodySpec<2>>&, std::vector<SeedWalk<2>>, const Model<2>&);
template void require_apart(const std::vector<BodySpec<3>>&, std::vector<SeedWalk<3>>, const Model<3>&);

}  // namespace ordo::setup
