#include "spline/body.hpp"

#include "base/parallel.hpp"
#include "method/state.hpp"
#include "spline/cell.hpp"

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

/// f(cell number) for a cell and its neighbours.
template <int D, class F>
void for_each_neighbour(const Model<D>& model, const Index<D>& cell, const F& f)
{
    for_each_cell_of(model, IndexBox<D>::around(cell, 1), f);
}

/// The level sets of the surface in a cell, as functions of positions in cells.
template <int D, int P>
std::vector<LevelSet<D>> surface_in(std::size_t count, const SplineSpace<D>& space, const SplineCell<D, P>& cell,
                                    const Index<D>& at)
{
    std::vector<LevelSet<D>> r;
    for (std::size_t k = 0; k < count; ++k)
        r.push_back([&, at, k](const Vec<D>& y) {
            double w[D * (P + 1)], row[P + 1], slopes[P + 1];
            for (int a = 0; a < D; ++a) {
                space.axis[a].template row<P>(space.axis[a].span_of(at[a]), y[a], row, slopes);
                std::copy(row, row + P + 1, w + a * (P + 1));
            }
            return cell.collect(w)[static_cast<int>(k)];
        });
    return r;
}

/// Appends the values and slopes, per m, of the functions of a space at a position in a cell.
template <int D>
void add_rows(const Model<D>& model, const SplineSpace<D>& space, const Index<D>& cell, const Vec<D>& y,
              std::vector<double>* values, std::vector<double>* slopes)
{
    with_degree(space.axis[0].degree, [&]<int P>() {
        double w[P + 1], dw[P + 1];
        for (int a = 0; a < D; ++a) {
            space.axis[a].template row<P>(space.axis[a].span_of(cell[a]), y[a], w, dw);
            values->insert(values->end(), w, w + P + 1);
            if (!slopes) continue;
            for (double& slope : dw) slope /= model.h[a];
            slopes->insert(slopes->end(), dw, dw + P + 1);
        }
    });
}

template <int D>
std::vector<Index<D>> all_cells(const Model<D>& model)
{
    std::vector<Index<D>> r;
    IndexBox<D>{{}, model.cells}.for_each([&](const Index<D>& k) { r.push_back(k); });
    return r;
}

}  // namespace

template <int D>
std::vector<Cover> cover_by_particles(const Model<D>& model, const Particles<D>& p, const Array<int>& order,
                                      const std::vector<int>& first)
{
    const std::vector<Index<D>> cells = all_cells(model);
    std::vector<Cover> cover(cells.size(), Cover::none);
    for (std::size_t c = 0; c < cells.size(); ++c) {
        unsigned parts  = 0;  // a bit for each sub-cell with a particle
        bool has_around = true;
        for_each_neighbour(model, cells[c], [&](int n) { has_around = has_around && first[n] < first[n + 1]; });
        for (int k = first[c]; k < first[c + 1]; ++k) {
            unsigned part = 0;
            for (int a = 0; a < D; ++a) {
                const double y = (p.x[order[k]][a] - model.origin[a]) / model.h[a];
                if (y - std::floor(y) >= 0.5) part |= 1U << a;
            }
            parts |= 1U << part;
        }
        if (first[c] < first[c + 1])
            for_each_neighbour(model, cells[c], [&](int n) { cover[n] = std::max(cover[n], Cover::part); });
        if (has_around || parts + 1 == 1U << (1U << D)) cover[c] = Cover::all;
    }
    return cover;
}

template <int D>
void find_body(const Model<D>& model, const SplineSpace<D>& v_space, const SplineSpace<D>& s_space, const Lanes* surface,
               const std::vector<Cover>& rough, int points, SplineBody<D>& body)
{
    struct Point {
        Vec<D> y;
        double weight;
    };
    const std::vector<Index<D>> cells = all_cells(model);
    std::vector<std::vector<Point>> in_cell(cells.size());
    double volume = 1.0;
    for (int a = 0; a < D; ++a) volume *= model.h[a];
    body.cover.assign(cells.size(), Cover::none);
    parallel_for(static_cast<std::ptrdiff_t>(cells.size()), [&](std::ptrdiff_t c) {
        if (rough[c] == Cover::none) return;
        bool is_deep = true;
        for_each_neighbour(model, cells[c], [&](int n) { is_deep = is_deep && rough[n] == Cover::all; });
        if (is_deep) {
            body.cover[c] = Cover::all;
            return;
        }
        with_degree(v_space.axis[0].degree, [&]<int P>() {
            SplineCell<D, P> cell(v_space, cells[c]);
            cell.load(surface);
            Vec<D> lower{};
            for (int a = 0; a < D; ++a) lower[a] = cells[c][a];
            const Vec<D> upper   = lower + Vec<D>::filled(1.0);
            const auto functions = surface_in<D, P>(model.surface.size(), v_space, cell, cells[c]);
            body.cover[c]        = cover_of(functions, lower, upper);
            if (body.cover[c] != Cover::part) return;
            for_each_point_inside(functions, lower, upper, points, [&](const Vec<D>& y, double weight) {
                in_cell[c].push_back({y, weight * volume});
            });
            if (in_cell[c].empty()) body.cover[c] = Cover::none;
        });
    });
    CutPoints& to = body.points;
    to            = {};
    to.v_width    = D * (v_space.axis[0].degree + 1);
    to.s_width    = D * (s_space.axis[0].degree + 1);
    for (std::size_t c = 0; c < cells.size(); ++c) {
        to.first.push_back(to.count());
        for (const Point& point : in_cell[c]) {
            to.weights.push_back(point.weight);
            add_rows(model, v_space, cells[c], point.y, &to.v_values, &to.v_slopes);
            add_rows(model, s_space, cells[c], point.y, &to.s_values, nullptr);
        }
    }
    to.first.push_back(to.count());
    body.v = GhostPenalty<D>(v_space, model.cells, body.cover);
    body.s = GhostPenalty<D>(s_space, model.cells, body.cover);
}

#define ORDO_SPLINE_BODY(D)                                                                                 \
    template std::vector<Cover> cover_by_particles(const Model<D>&, const Particles<D>&, const Array<int>&, \
                                                   const std::vector<int>&);                                \
    template void find_body(const Model<D>&, const SplineSpace<D>&, const SplineSpace<D>&, const Lanes*,    \
                            const std::vector<Cover>&, int, SplineBody<D>&);
ORDO_SPLINE_BODY(1)
ORDO_SPLINE_BODY(2)
ORDO_SPLINE_BODY(3)
#undef ORDO_SPLINE_BODY

}  // namespace ordo
