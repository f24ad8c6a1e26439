#include "method/mass_matrix.hpp"

#include "kernels/nodes.hpp"
#include "solve/conjugate_gradients.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace ordo {

namespace {

/// f(first row, end) over pieces of the rows.
template <int D, class F>
void for_each_run(const NodeRows<D>& rows, F&& f)
{
    parallel_pieces(rows.count(),
                    [&](std::ptrdiff_t begin, std::ptrdiff_t end) { f(static_cast<int>(begin) + 1, static_cast<int>(end) + 1); });
}

template <int D, class F>
void for_each_row(const NodeRows<D>& rows, F&& f)
{
    for_each_run(rows, [&](int begin, int end) {
        for (int i = begin; i < end; ++i) f(i);
    });
}

/// The sum of f(first row, end) over pieces of the rows, the same for any number of threads.
template <int D, class F>
Lanes sum_of_runs(const NodeRows<D>& rows, F&& f)
{
    std::vector<Lanes> partial(static_cast<std::size_t>(rows.count() / kPiece + 1), Lanes{});
    for_each_run(rows, [&](int begin, int end) { partial[static_cast<std::size_t>(begin / kPiece)] = f(begin, end); });
    Lanes total{};
    for (const Lanes& p : partial) total += p;
    return total;
}

/// For each set of bits, Lanes with 1 in the lanes whose bits are set, else 0.
const Lanes* masks()
{
    static const std::vector<Lanes> all = [] {
        std::vector<Lanes> r(256, Lanes{});
        for (int bits = 0; bits < 256; ++bits)
            for (int k = 0; k < NodeLane::end; ++k) r[static_cast<std::size_t>(bits)][k] = bits >> k & 1;
        return r;
    }();
    return all.data();
}

bool is_finite(const Lanes& norm, const std::vector<int>& lanes)
{
    return std::all_of(lanes.begin(), lanes.end(), [&](int a) { return std::isfinite(norm[a]); });
}
bool is_below(const Lanes& norm, double part, const Lanes& whole, const std::vector<int>& lanes)
{
    return std::all_of(lanes.begin(), lanes.end(), [&](int a) { return norm[a] <= part * part * whole[a]; });
}

}  // namespace

template <int D>
void MassSolver<D>::apply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const
{
    clear(to, s.field.tiles);
    Sweep<D> view = sweep;
    view.nodes    = to;
    if (is_of_points_) {
        view.p = s.points.view();
        s.points.for_each_by_colour([&](const Tile& tile) { passes_.apply_mass_points(view, from, tile.begin, tile.end); });
    } else {
        s.field.tiles.for_each_by_colour([&](const Tile& tile) { passes_.apply_mass(view, from, tile.begin, tile.end); });
    }
    s.field.halo.add(to, 0, NodeLane::end);
}

template <int D>
MassSolver<D>::Components::Components(unsigned parts, const std::vector<HeldNode<D>>& held_) : held(held_)
{
    if (parts & kVelocity) firsts.push_back(NodeLane::velocity);
    if (parts & kAcceleration) firsts.push_back(NodeLane::increment);
    for (const int first : firsts)
        for (int a = 0; a < D; ++a) lanes.push_back(first + a);
    for (const int a : lanes) mask[a] = 1.0;
    ORDO_EXPECT(held.empty() || firsts.size() == 1);
}

template <int D>
Lanes MassSolver<D>::Components::joined(const Lanes& sums) const
{
    if (held.empty()) return sums;
    double all = 0.0;
    for (const int a : lanes) all += sums[a];
    return mask * all;
}

template <int D>
void MassSolver<D>::project(const NodeRows<D>& rows, const Components& c, Lanes* x)
{
    for (const HeldNode<D>& h : c.held) {
        Lanes& own = x[rows.row(h.node)];
        Vec<D> u{};
        for (int a = 0; a < D; ++a) u[a] = own[c.firsts[0] + a];
        u = h.free * u;
        for (int a = 0; a < D; ++a) own[c.firsts[0] + a] = u[a];
    }
}

template <int D>
void MassSolver<D>::prepare(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const
{
    MassSystem<D>& m  = s.field.mass;
    auto mass         = [&](std::ptrdiff_t i) { return nodes[i][NodeLane::mass]; };
    const int reach   = std::max(rows_.reach, 1);  // lines of rows need the next node
    const bool is_new = m.rows.assign(s.lattice, s.field.tiles, reach, [&](std::ptrdiff_t i) { return mass(i) > 0; });
    const auto count  = static_cast<std::size_t>(m.rows.end());
    for (Array<Lanes>* a : {&m.r, &m.p, &m.q}) keep_room(*a, count);
    for (Array<double>* a : {&m.diagonal, &m.scale}) keep_room(*a, count);
    keep_room(m.lanes, count);
    if (m.is_formed && !is_new) return;
    for_each_row(m.rows, [&](int i) { m.scale[i] = 1 / std::sqrt(mass(m.rows.node(i))); });
    if (rows_.form)
        form(s, sweep);
    else
        for (Array<Lanes>& a : m.on_grid) make_room(a, s.field.nodes.size());
    find_lumped(s, sweep, nodes);
    if (rows_.form) factor(s);
    m.is_formed = true;
}

template <int D>
void MassSolver<D>::form(State<D>& s, const Sweep<D>& sweep) const
{
    MassSystem<D>& m = s.field.mass;
    const auto size  = static_cast<std::size_t>(rows_.size);
    keep_room(m.entries, size * m.rows.end_with_images());
    double* entries = m.entries.data();
    parallel_pieces(m.rows.end_with_images(), [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
        std::memset(static_cast<void*>(entries + begin * rows_.size), 0, sizeof(double) * size * (end - begin));
    });
    m.rows.part_images();
    const RowView<D> rows = m.rows.view();
    Sweep<D> view         = sweep;
    auto add              = [&](const Tile& tile) { rows_.form(view, rows, entries, tile.begin, tile.end); };
    if (is_of_points_) {
        view.p = s.points.view();
        s.points.for_each_by_colour(add);
    } else {
        s.field.tiles.for_each_by_colour(add);
    }
    m.rows.join_images([&](int row, int image) {
        for (std::size_t k = 0; k < size; ++k) entries[row * size + k] += entries[image * size + k];
    });
}

template <int D>
void MassSolver<D>::multiply(State<D>& s, const Sweep<D>& sweep, const Lanes* from, Lanes* to) const
{
    MassSystem<D>& m = s.field.mass;
    if (rows_.form) {
        const RowView<D> rows = m.rows.view();
        for_each_run(m.rows, [&](int begin, int end) { rows_.multiply(rows, m.entries.data(), from, to, begin, end); });
        return;
    }
    Lanes *grid_from = m.on_grid[0].data(), *grid_to = m.on_grid[1].data();
    clear(grid_from, s.field.tiles);
    for_each_row(m.rows, [&](int i) { grid_from[m.rows.node(i)] = from[i]; });
    s.field.halo.copy(grid_from);
    apply(s, sweep, grid_from, grid_to);
    for_each_row(m.rows, [&](int i) { to[i] = grid_to[m.rows.node(i)]; });
}

/// Finds the lumped rows and what is added to the diagonals of the others.
template <int D>
void MassSolver<D>::find_lumped(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const
{
    MassSystem<D>& m      = s.field.mass;
    constexpr int coupled = NodeLane::mass;
    const Lanes lumped    = sum_of_runs(m.rows, [&](int begin, int end) {
        Lanes count{};
        for (int i = begin; i < end; ++i) {
            const bool is_lumped = filled_part(s.lattice, nodes, s.lattice.index(m.rows.node(i))) < lump_below_;
            m.lanes[i]           = is_lumped ? 0 : MassRowParts::coupled;
            m.diagonal[i]        = 0.0;
            m.p[i]               = Lanes{};
            m.p[i][coupled]      = is_lumped ? 0.0 : 1.0;
            count[0] += is_lumped;
        }
        return count;
    });
    if (lumped[0] == 0) return;
    multiply(s, sweep, m.p.data(), m.q.data());  // the part of each row sum that stays coupled
    for_each_row(m.rows,
                 [&](int i) { m.diagonal[i] = nodes[m.rows.node(i)][NodeLane::mass] - m.p[i][coupled] * m.q[i][coupled]; });
}

/// Sets p to the first u: known values, else those of the lumped matrix, which solve lumped rows. Also sets the lanes of each row
/// that are solved for.
template <int D>
void MassSolver<D>::set_first(State<D>& s, Lanes* nodes, const Lanes* known, const Components& c) const
{
    MassSystem<D>& m  = s.field.mass;
    unsigned char all = MassRowParts::coupled;
    for (const int a : c.lanes) all |= static_cast<unsigned char>(1u << a);
    for_each_row(m.rows, [&](int i) {
        m.lanes[i] = m.parts().is_coupled(i) ? all : 0;
        m.p[i]     = nodes[m.rows.node(i)] * c.mask * (m.scale[i] * m.scale[i]);
    });
    s.field.constraints.for_each([&](std::ptrdiff_t node, int component, bool is_prescribed) {
        const int row = m.rows.row(node);
        if (row > 0 && m.rows.node(row) != node) return;  // images have no rows of their own
        for (const int first : c.firsts) {
            if (first == NodeLane::velocity && is_prescribed) continue;
            const int a                           = first + component;
            const double value                    = first == NodeLane::velocity ? 0.0 : known[node][a];
            (row > 0 ? m.p[row] : nodes[node])[a] = value;  // nodes without mass get known values too
            if (row > 0) m.lanes[row] &= static_cast<unsigned char>(~(1u << a));
        }
    });
    project(m.rows, c, m.p.data());
    for (const HeldNode<D>& h : c.held)
        for (int a = 0; a < D; ++a) m.p[m.rows.row(h.node)][c.firsts[0] + a] += h.known[a];
    const Lanes others = masks()[255] - c.mask;
    const auto parts   = m.parts();
    for_each_row(m.rows, [&](int i) {
        if (parts.is_coupled(i)) return;
        Lanes& n = nodes[m.rows.node(i)];
        n        = n * others + m.p[i];
        m.p[i]   = Lanes{};
    });
}

/// r = b - A u with u = p, which is stored in the nodes; z = r over the roots of the masses.
template <int D>
typename MassSolver<D>::Norms MassSolver<D>::find_residual(State<D>& s, const Sweep<D>& sweep, Lanes* nodes,
                                                           const Components& c) const
{
    MassSystem<D>& m   = s.field.mass;
    const Lanes* of    = masks();
    const Lanes others = of[255] - c.mask;
    Lanes* z           = m.q.data();
    multiply(s, sweep, m.p.data(), m.q.data());
    Norms norms;
    norms.b = sum_of_runs(m.rows, [&](int begin, int end) {
        Lanes sum{};
        for (int i = begin; i < end; ++i) {
            Lanes& n         = nodes[m.rows.node(i)];
            const Lanes mask = of[m.lanes[i]] * c.mask, b = n * mask * m.scale[i];
            sum += b * b;
            m.r[i] = mask * (n - m.q[i] - m.p[i] * m.diagonal[i]);
            z[i]   = m.r[i] * m.scale[i];
            if (m.parts().is_coupled(i)) n = n * others + m.p[i];
            m.p[i] = Lanes{};
        }
        return sum;
    });
    project(m.rows, c, m.r.data());
    project(m.rows, c, z);
    norms.r = sum_of_runs(m.rows, [&](int begin, int end) {
        Lanes sum{};
        for (int i = begin; i < end; ++i) sum += z[i] * z[i];
        return sum;
    });
    norms.b = c.joined(norms.b);
    norms.r = c.joined(norms.r);
    for (const int a : c.lanes) norms.b[a] = std::max(norms.b[a], norms.r[a]);
    return norms;
}

template <int D>
void MassSolver<D>::factor(State<D>& s) const
{
    MassSystem<D>& m = s.field.mass;
    keep_room(m.factors, static_cast<std::size_t>(rows_.factor_size) * m.rows.end());
    const RowView<D> rows    = m.rows.view();
    const MassRowParts parts = m.parts();
    float* T                 = m.factors.data();
    for_each_run(m.rows, [&](int begin, int end) { rows_.sum(rows, m.entries.data(), parts, T, begin, end); });
    for (int a = 0; a < D; ++a) {
        const RowLines& lines = m.rows.lines(a);
        lines.for_each([&](int begin, int end) { rows_.factor(lines.rows.data() + begin, end - begin, a, T); });
    }
}

/// z = P r from z = r over the roots of the masses; returns r z. The factors of different axes commute only if M is a tensor
/// product. Applying them in turn and then in reverse order makes P symmetric for any matrix.
template <int D>
Lanes MassSolver<D>::precondition(State<D>& s, const Components& c) const
{
    MassSystem<D>& m = s.field.mass;
    Lanes* z         = m.q.data();
    auto solve       = [&](int a, unsigned passes) {
        const RowLines& lines = m.rows.lines(a);
        lines.for_each(
            [&](int begin, int end) { rows_.solve(lines.rows.data() + begin, end - begin, a, m.factors.data(), z, passes); });
    };
    if (rows_.form) {
        for (int a = 0; a < D - 1; ++a) solve(a, kForward);
        solve(D - 1, kForward | kBackward);
        for (int a = D - 2; a >= 0; --a) solve(a, kBackward);
    }
    const Lanes* of   = masks();
    const Lanes total = sum_of_runs(m.rows, [&](int begin, int end) {
        Lanes sum{};
        for (int i = begin; i < end; ++i) {
            z[i] = z[i] * of[m.lanes[i]] * m.scale[i];
            sum += m.r[i] * z[i];
        }
        return sum;
    });
    project(m.rows, c, z);  // r has no part along the held directions, so r z stays
    return c.joined(total);
}

/// q = A p on the rows that are solved for; returns p q.
template <int D>
Lanes MassSolver<D>::multiply_direction(State<D>& s, const Sweep<D>& sweep, const Components& c) const
{
    MassSystem<D>& m      = s.field.mass;
    const RowView<D> rows = m.rows.view();
    const Lanes *of = masks(), *p = m.p.data();
    Lanes* q = m.q.data();
    if (!rows_.form) multiply(s, sweep, p, q);
    const Lanes total = sum_of_runs(m.rows, [&](int begin, int end) {
        if (rows_.form) rows_.multiply(rows, m.entries.data(), p, q, begin, end);
        Lanes sum{};
        for (int i = begin; i < end; ++i) {
            q[i] = of[m.lanes[i]] * (q[i] + p[i] * m.diagonal[i]);
            sum += p[i] * q[i];
        }
        return sum;
    });
    project(m.rows, c, q);  // p has no part along the held directions, so p q stays
    return c.joined(total);
}

/// u += alpha p, r -= alpha q, z = r over the roots of the masses; returns z z.
template <int D>
Lanes MassSolver<D>::add_direction(State<D>& s, Lanes* nodes, const Lanes& alpha) const
{
    MassSystem<D>& m = s.field.mass;
    return sum_of_runs(m.rows, [&](int begin, int end) {
        Lanes sum{};
        for (int i = begin; i < end; ++i) {
            nodes[m.rows.node(i)] += m.p[i] * alpha;
            const Lanes r = m.r[i] - m.q[i] * alpha;
            const Lanes z = r * m.scale[i];
            m.r[i]        = r;
            m.q[i]        = z;
            sum += z * z;
        }
        return sum;
    });
}

template <int D>
void MassSolver<D>::solve(State<D>& s, const Sweep<D>& sweep, Lanes* nodes, const Lanes* known, unsigned parts,
                          const std::vector<HeldNode<D>>& held) const
{
    constexpr int max_iterations = 3000;                  // the condition number of cubic splines in 3D is some thousands
    constexpr double tolerance = 1e-13, bearable = 1e-9;  // of the norm of b
    const Components c(parts, held);
    prepare(s, sweep, nodes);
    set_first(s, nodes, known, c);
    Norms norms = find_residual(s, sweep, nodes, c);
    struct System {
        const MassSolver& solver;
        State<D>& s;
        const Sweep<D>& sweep;
        Lanes* nodes;
        const Components& c;
        Norms& norms;

        bool is_done() const { return !is_finite(norms.r, c.lanes) || is_below(norms.r, tolerance, norms.b, c.lanes); }
        Lanes precondition() { return solver.precondition(s, c); }
        void turn(const Lanes& beta)
        {
            MassSystem<D>& m = s.field.mass;
            for_each_row(m.rows, [&](int i) { m.p[i] = m.q[i] + m.p[i] * beta; });
        }
        Lanes multiply() { return solver.multiply_direction(s, sweep, c); }
        void add_direction(const Lanes& alpha) { norms.r = c.joined(solver.add_direction(s, nodes, alpha)); }
    };
    iterations_ = conjugate_gradients(System{*this, s, sweep, nodes, c, norms}, max_iterations);
    if (is_finite(norms.r, c.lanes) && !is_below(norms.r, bearable, norms.b, c.lanes))  // if not finite, particles report it
        throw NumericalError(fmt::format(
            "step {}, t = {:.6g} s: the consistent mass matrix was not solved in {} iterations: there are too few particles for "
            "its nodes; use more and smaller particles per cell, a larger method.lump_below (now {}) or method.mass = "
            "\"lumped\"",
            s.n, s.t, iterations_, lump_below_));
    s.field.halo.copy(nodes);
}

template <int D>
void MassSolver<D>::multiply_solution(State<D>& s, const Sweep<D>& sweep, const Lanes* nodes) const
{
    MassSystem<D>& m = s.field.mass;
    const auto parts = m.parts();
    for_each_row(m.rows, [&](int i) { m.p[i] = parts.is_coupled(i) ? nodes[m.rows.node(i)] : Lanes{}; });
    multiply(s, sweep, m.p.data(), m.q.data());
    for_each_row(m.rows, [&](int i) {
        const Lanes& u = nodes[m.rows.node(i)];
        m.q[i]         = parts.is_coupled(i) ? m.q[i] + u * m.diagonal[i] : u * u[NodeLane::mass];
    });
}

template class MassSolver<1>;
template class MassSolver<2>;
template class MassSolver<3>;

}  // namespace ordo
