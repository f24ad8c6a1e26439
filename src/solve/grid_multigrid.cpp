#include "solve/grid_multigrid.hpp"

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "solve/direct_solver.hpp"
#include "solve/scattered.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

namespace ordo {
namespace {

constexpr double kStuck     = 0.8;                   // coarser levels than one that keeps so many of the unknowns do not pay
constexpr double kDependent = 1e-12, kOther = 1e-6;  // a pivot of a node's block that is none, and another; of its diagonal

template <int D>
using Vectors = std::vector<Vec<D>>;

/// Which components of a node are held.
template <int D>
using Held = Vec<D, bool>;

/// Makes rows in parallel. visit(i, touch) calls touch(column, change) for whatever adds to row i; change(value) adds to an entry, which is
/// zero at first. It is called twice: to count the entries, then to fill them.
template <class T, class Visit>
SparseRows<T> make_rows(std::ptrdiff_t count, std::ptrdiff_t columns, const Visit& visit)
{
    SparseRows<T> rows;
    rows.first.assign(count + 1, 0);
    std::vector<std::vector<std::ptrdiff_t>> entry_of(thread_count());  // of each column in the row that a thread is at, or -1
    const auto for_each_row = [&](const auto& f) {
        parallel_pieces(count, [&](std::ptrdiff_t begin, std::ptrdiff_t end) {
            std::vector<std::ptrdiff_t>& entry = entry_of[thread_index()];
            if (entry.empty()) entry.assign(columns, -1);
            std::vector<int> touched;
            for (std::ptrdiff_t i = begin; i < end; ++i) {
                f(i, [&](int column) -> std::ptrdiff_t& {
                    if (entry[column] < 0) {
                        entry[column] = std::ssize(touched);
                        touched.push_back(column);
                    }
                    return entry[column];
                });
                for (const int column : touched) entry[column] = -1;
                touched.clear();
            }
        });
    };
    for_each_row([&](std::ptrdiff_t i, const auto& entry) {
        std::ptrdiff_t most = -1;
        visit(i, [&](int column, const auto&) { most = std::max(most, entry(column)); });
        rows.first[i + 1] = most + 1;
    });
    std::partial_sum(rows.first.begin(), rows.first.end(), rows.first.begin());
    rows.column.resize(rows.first.back());
    rows.value.resize(rows.first.back());
    for_each_row([&](std::ptrdiff_t i, const auto& entry) {
        visit(i, [&](int column, const auto& change) {
            const std::ptrdiff_t k = rows.first[i] + entry(column);
            rows.column[k]         = column;
            change(rows.value[k]);
        });
    });
    return rows;
}

/// The rows of the transposed matrix, each by ascending columns.
SparseRows<double> transposed(const SparseRows<double>& rows, std::ptrdiff_t columns)
{
    SparseRows<double> r;
    r.first.assign(columns + 1, 0);
    for (const int j : rows.column) ++r.first[j + 1];
    std::partial_sum(r.first.begin(), r.first.end(), r.first.begin());
    r.column.resize(rows.column.size());
    r.value.resize(rows.column.size());
    std::vector<std::ptrdiff_t> end(r.first.begin(), r.first.end() - 1);
    for (std::ptrdiff_t i = 0; i < rows.size(); ++i)
        rows.for_each(i, [&](int j, double value) {
            r.column[end[j]]  = static_cast<int>(i);
            r.value[end[j]++] = value;
        });
    return r;
}

/// The nodes of a level on their lattice, of which the indices are not negative.
template <int D>
struct Nodes {
    std::vector<Index<D>> place;
    std::vector<Held<D>> held;
    Vec<D, bool> periodic;
    Index<D> cells;  ///< on periodic axes, where indices are less

    std::ptrdiff_t count() const { return std::ssize(place); }
    std::ptrdiff_t unknowns() const
    {
        std::ptrdiff_t r = 0;
        for (const Held<D>& h : held) r += std::count(h.c, h.c + D, false);
        return r;
    }
};

template <int D>
Nodes<D> nodes_of(std::vector<Index<D>> place, const Vec<D, bool>& periodic, const Index<D>& cells,
                  const std::vector<unsigned char>& held)
{
    Index<D> low = Index<D>::filled(std::numeric_limits<int>::max());
    for (const Index<D>& k : place)
        for (int a = 0; a < D; ++a) low[a] = std::min(low[a], k[a]);
    for (Index<D>& k : place)
        for (int a = 0; a < D; ++a) k[a] = periodic[a] ? (k[a] % cells[a] + cells[a]) % cells[a] : k[a] - low[a];
    std::vector<Held<D>> of_nodes(place.size());
    for (std::size_t i = 0; i < place.size(); ++i)
        for (int a = 0; a < D; ++a) of_nodes[i][a] = held[i * D + a] != 0;
    return {std::move(place), std::move(of_nodes), periodic, cells};
}

/// f(place, weight) for each coarse node whose linear interpolation gives the node at place k.
template <int D, class F>
void for_each_parent(const Nodes<D>& nodes, const Index<D>& k, const F& f)
{
    Index<D> counts{};
    Vec<D, Index<2>> parents{};
    double weight = 1.0;
    for (int a = 0; a < D; ++a) {
        int last = (k[a] + 1) / 2;
        if (nodes.periodic[a] && 2 * last == nodes.cells[a]) last = 0;  // the first node is also the one after the last
        parents[a] = {k[a] / 2, last};
        counts[a]  = parents[a][0] == last ? 1 : 2;
        weight /= counts[a];
    }
    IndexBox<D>{{}, counts}.for_each([&](const Index<D>& which) {
        Index<D> parent{};
        for (int a = 0; a < D; ++a) parent[a] = parents[a][which[a]];
        f(parent, weight);
    });
}

/// The numbers of places, which are not negative.
template <int D>
class PlaceNumbers {
  public:
    explicit PlaceNumbers(const std::vector<Index<D>>& places)
    {
        for (const Index<D>& k : places)
            for (int a = 0; a < D; ++a) counts_[a] = std::max(counts_[a], static_cast<std::int64_t>(k[a]) + 2);
    }
    std::int64_t operator()(const Index<D>& k) const
    {
        std::int64_t r = 0;
        for (int a = D - 1; a >= 0; --a) r = r * counts_[a] + k[a];
        return r;
    }
    Index<D> place(std::int64_t number) const
    {
        Index<D> k{};
        for (int a = 0; a < D; ++a) {
            k[a] = static_cast<int>(number % counts_[a]);
            number /= counts_[a];
        }
        return k;
    }

  private:
    Vec<D, std::int64_t> counts_{};
};

template <int D>
struct Coarsening {
    Nodes<D> nodes;
    SparseRows<double> parents, children;  ///< of fine nodes, of coarse ones: interpolation and its transpose
};

/// Holds what the fine nodes do not determine, so that interpolation loses no coarse unknown. An unknown at a fine node that is free is
/// determined, and so is the only other one that a fine node takes; where only circles are left, one of them is held.
template <int D>
void hold_undetermined(const Nodes<D>& fine, Coarsening<D>& coarse, int a)
{
    const std::ptrdiff_t count = coarse.nodes.count();
    std::vector<char> is_open(count);
    for (std::ptrdiff_t i = 0; i < count; ++i) is_open[i] = !coarse.nodes.held[i][a];
    const auto for_each_open = [&](std::ptrdiff_t i, const auto& f) {
        coarse.parents.for_each(i, [&](int j, double) {
            if (is_open[j]) f(j);
        });
    };
    std::vector<int> open(fine.count(), 0), next;  // undetermined parents of a fine node; nodes with a single one
    const auto close = [&](int j) {
        is_open[j] = false;
        coarse.children.for_each(j, [&](int i, double) {
            if (--open[i] == 1 && !fine.held[i][a]) next.push_back(i);
        });
    };
    for (std::ptrdiff_t i = 0; i < fine.count(); ++i) {
        for_each_open(i, [&](int) { ++open[i]; });
        if (open[i] == 1 && !fine.held[i][a]) next.push_back(static_cast<int>(i));
    }
    for (std::ptrdiff_t j = 0; j < count; ++j) {
        while (!next.empty()) {
            const int i = next.back();
            next.pop_back();
            int parent = -1;
            for_each_open(i, [&](int k) { parent = k; });
            if (parent >= 0) close(parent);
        }
        if (!is_open[j]) continue;
        coarse.nodes.held[j][a] = true;
        close(static_cast<int>(j));
        --j;  // look at what follows from it first
    }
}

/// The next coarser level: the nodes of even index.
template <int D>
Coarsening<D> coarsened(const Nodes<D>& fine)
{
    const PlaceNumbers<D> number(fine.place);
    const auto is_free = [&](std::ptrdiff_t i) { return !(fine.held[i] == Held<D>::filled(true)); };
    std::vector<std::int64_t> numbers;
    for (std::ptrdiff_t i = 0; i < fine.count(); ++i)
        if (is_free(i)) for_each_parent(fine, fine.place[i], [&](const Index<D>& k, double) { numbers.push_back(number(k)); });
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());

    Coarsening<D> r;
    r.nodes.periodic = fine.periodic;
    for (int a = 0; a < D; ++a) r.nodes.cells[a] = (fine.cells[a] + 1) / 2;
    for (const std::int64_t k : numbers) r.nodes.place.push_back(number.place(k));
    r.nodes.held.assign(numbers.size(), Held<D>::filled(true));
    for (std::ptrdiff_t i = 0; i < fine.count(); ++i) {
        if (is_free(i))
            for_each_parent(fine, fine.place[i], [&](const Index<D>& k, double weight) {
                const auto parent = std::lower_bound(numbers.begin(), numbers.end(), number(k)) - numbers.begin();
                r.parents.column.push_back(static_cast<int>(parent));
                r.parents.value.push_back(weight);
                for (int a = 0; a < D; ++a)
                    if (!fine.held[i][a]) r.nodes.held[parent][a] = false;
            });
        r.parents.first.push_back(std::ssize(r.parents.column));
    }
    r.children = transposed(r.parents, r.nodes.count());
    for (int a = 0; a < D; ++a) hold_undetermined(fine, r, a);
    return r;
}

/// Makes rows and columns of held unknowns zero.
template <int D>
void drop_held(SparseRows<Mat<D>>& matrix, const std::vector<Held<D>>& held)
{
    parallel_for_each(matrix.size(), [&](std::ptrdiff_t i) {
        for (std::ptrdiff_t k = matrix.first[i]; k < matrix.first[i + 1]; ++k)
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b)
                    if (held[i][a] || held[matrix.column[k]][b]) matrix.value[k](a, b) = 0.0;
    });
}

/// P^T A P, with P the interpolation.
template <int D>
SparseRows<Mat<D>> galerkin_product(const SparseRows<Mat<D>>& fine, const Coarsening<D>& coarse)
{
    SparseRows<Mat<D>> r =
        make_rows<Mat<D>>(coarse.nodes.count(), coarse.nodes.count(), [&](std::ptrdiff_t row, const auto& touch) {
            coarse.children.for_each(row, [&](int i, double of_row) {
                fine.for_each(i, [&](int j, const Mat<D>& block) {
                    coarse.parents.for_each(j, [&](int column, double of_column) {
                        touch(column, [&](Mat<D>& sum) { sum += (of_row * of_column) * block; });
                    });
                });
            });
        });
    drop_held(r, coarse.nodes.held);
    return r;
}

/// R of R A R^T = 1 for a node's block A: the inverse of its lower Cholesky factor, zero where the node is held or has no diagonal. Where
/// a pivot is not positive, R is that of another block, which will do; returns if it is.
template <int D>
bool find_root(const Mat<D>& block, const Held<D>& held, Mat<D>& root)
{
    bool is_other = false;
    Mat<D> l{};
    root = {};
    for (int a = 0; a < D; ++a) {
        const double whole = std::abs(block(a, a));
        if (held[a] || whole == 0) continue;
        double pivot = block(a, a);
        for (int b = 0; b < a; ++b) {
            double sum = block(a, b);
            for (int c = 0; c < b; ++c) sum -= l(a, c) * l(b, c);
            l(a, b) = l(b, b) > 0 ? sum / l(b, b) : 0.0;
            pivot -= l(a, b) * l(a, b);
        }
        if (!(pivot > kDependent * whole)) {
            pivot    = kOther * whole;
            is_other = true;
        }
        l(a, a) = std::sqrt(pivot);
        for (int c = 0; c <= a; ++c) {
            double sum = a == c ? 1.0 : 0.0;
            for (int b = c; b < a; ++b) sum -= l(a, b) * root(b, c);
            root(a, c) = sum / l(a, a);
        }
    }
    return is_other;
}

/// A bound of the 2-norm, from those of rows and columns and that of Frobenius.
template <int D>
double norm_bound(const Mat<D>& m)
{
    double rows = 0.0, columns = 0.0;
    for (int a = 0; a < D; ++a) {
        double row = 0.0, column = 0.0;
        for (int b = 0; b < D; ++b) {
            row += std::abs(m(a, b));
            column += std::abs(m(b, a));
        }
        rows    = std::max(rows, row);
        columns = std::max(columns, column);
    }
    return std::sqrt(std::min(rows * columns, ddot(m, m)));
}

/// A polynomial that smooths: its degree, and the largest eigenvalue over the least one that it damps.
struct Smoothing {
    int degree;
    double range;
};

/// For matrices that join nodes up to 1, 2 or 3 apart along each axis: B-splines have rough functions of little energy, the more so where
/// a body ends, which only polynomials of higher degree damp. Measured: hats converge in as few products with degrees 2 and 3 and ranges
/// from 6 to 20, quadratic splines with degrees 4 to 8; below, they need more.
template <int D>
Smoothing smoothing_of(const SparseRows<Mat<D>>& matrix)
{
    std::ptrdiff_t longest = 0;
    for (std::ptrdiff_t i = 0; i < matrix.size(); ++i) longest = std::max(longest, matrix.first[i + 1] - matrix.first[i]);
    if (longest <= power_of(3, D)) return {2, 12};
    return longest <= power_of(5, D) ? Smoothing{4, 30} : Smoothing{8, 100};
}

/// A level of the hierarchy: the nodes, their matrix, its smoother, and the vectors of a cycle.
template <int D>
struct Level {
    Nodes<D> nodes;
    SparseRows<Mat<D>> matrix;
    std::vector<Mat<D>> inverse;  ///< of the blocks that scale the smoother
    Smoothing smoothing{};
    SparseRows<double> parents, children;
    Vectors<D> b, x, r, d, e;

    Vec<D> product(const Vectors<D>& of, std::ptrdiff_t i) const
    {
        Vec<D> sum{};
        matrix.for_each(i, [&](int j, const Mat<D>& block) { sum += block * of[j]; });
        return sum;
    }
    template <class F>
    void for_each_node(const F& f) const
    {
        parallel_for_each(nodes.count(), f);
    }
};

/// Sets the scale of the smoother: blocks s_i A_ii, with the sum s_i of |R_i A_ij R_j^T| over j. They are then at least A for a symmetric
/// matrix, since 2 x_i B_ij x_j <= |B_ij| (x_i^2 + x_j^2): no eigenvalue of the scaled matrix is above 1, whatever the stiffness of
/// nodes beside each other. Estimates of the largest by power iterations miss single nodes at the rim of bodies.
/// Returns the number of blocks without a root.
template <int D>
std::ptrdiff_t set_up_smoother(Level<D>& l)
{
    const std::ptrdiff_t n = l.nodes.count();
    std::vector<Mat<D>> root(n);
    const std::ptrdiff_t rootless = parallel_reduce(
        n, std::ptrdiff_t{0},
        [&](std::ptrdiff_t i) {
            Mat<D> block{};
            l.matrix.for_each(i, [&](int j, const Mat<D>& m) {
                if (j == i) block = m;
            });
            return std::ptrdiff_t{find_root(block, l.nodes.held[i], root[i])};
        },
        [](std::ptrdiff_t& total, std::ptrdiff_t term) { total += term; });
    l.inverse.resize(n);
    l.for_each_node([&](std::ptrdiff_t i) {
        double sum = 0.0;
        l.matrix.for_each(i, [&](int j, const Mat<D>& m) { sum += norm_bound(root[i] * m * transpose(root[j])); });
        l.inverse[i] = (sum > 0 ? 1 / sum : 0.0) * (transpose(root[i]) * root[i]);
    });
    return rootless;
}

/// Improves x of A x = b by a Chebyshev polynomial (Saad 2003, algorithm 12.1) for eigenvalues of the scaled matrix up to 1. Leaves the
/// residual r of the x before the last correction d.
template <int D>
void smooth(Level<D>& l, bool from_zero)
{
    const double low = 1 / l.smoothing.range, middle = (1 + low) / 2, half = (1 - low) / 2;
    l.for_each_node([&](std::ptrdiff_t i) {
        if (from_zero) l.x[i] = {};
        l.r[i] = from_zero ? l.b[i] : l.b[i] - l.product(l.x, i);
        l.d[i] = (1 / middle) * (l.inverse[i] * l.r[i]);
    });
    double rho = half / middle;
    for (int k = 1; k < l.smoothing.degree; ++k) {
        const double next = 1 / (2 * middle / half - rho), old_part = next * rho, new_part = 2 * next / half;
        l.for_each_node([&](std::ptrdiff_t i) {
            l.x[i] += l.d[i];
            l.r[i] -= l.product(l.d, i);
            l.e[i] = old_part * l.d[i] + new_part * (l.inverse[i] * l.r[i]);
        });
        std::swap(l.d, l.e);
        rho = next;
    }
    l.for_each_node([&](std::ptrdiff_t i) { l.x[i] += l.d[i]; });
}

/// The solver of the coarsest level, for its free unknowns.
template <int D>
class CoarsestSolver {
  public:
    bool factor(const Level<D>& l, double tolerance, bool is_symmetric)
    {
        free_.clear();
        const std::ptrdiff_t count = l.nodes.count();
        std::vector<int> number(count * D, -1), free_at(count, 0);
        std::vector<Index<3>> place;
        for (int i = 0; i < std::ssize(number); ++i)
            if (!l.nodes.held[i / D][i % D]) {
                number[i] = static_cast<int>(std::ssize(free_));
                ++free_at[i / D];
                free_.push_back(i);
                std::copy_n(l.nodes.place[i / D].c, D, place.emplace_back().c);
            }
        SparseRows<double> rows;
        rows.first.resize(free_.size() + 1);
        for (std::size_t k = 0; k < free_.size(); ++k) {
            rows.first[k + 1] = rows.first[k];
            l.matrix.for_each(free_[k] / D, [&](int j, const Mat<D>&) { rows.first[k + 1] += free_at[j]; });
        }
        rows.column.resize(rows.first.back());
        rows.value.resize(rows.first.back());
        parallel_for_each(std::ssize(free_), [&](std::ptrdiff_t k) {
            std::ptrdiff_t at = rows.first[k];
            l.matrix.for_each(free_[k] / D, [&](int j, const Mat<D>& block) {
                for (int b = 0; b < D; ++b)
                    if (const int column = number[j * D + b]; column >= 0) {
                        rows.column[at]  = column;
                        rows.value[at++] = block(free_[k] % D, b);
                    }
            });
        });
        side_.resize(free_.size());
        result_.resize(free_.size());
        return solver_.factor(rows, place, tolerance, is_symmetric);
    }

    /// x = A^-1 b, zero where it is held.
    void solve(const Vectors<D>& b, Vectors<D>& x)
    {
        for (std::size_t k = 0; k < free_.size(); ++k) side_[k] = b[free_[k] / D][free_[k] % D];
        solver_.solve(side_, result_);
        std::fill(x.begin(), x.end(), Vec<D>{});
        for (std::size_t k = 0; k < free_.size(); ++k) x[free_[k] / D][free_[k] % D] = result_[k];
    }

  private:
    std::vector<int> free_;  ///< unknowns, node * D + component
    DirectSolver solver_;
    std::vector<double> side_, result_;
};

}  // namespace

template <int D>
struct GridMultigrid<D>::Parts {
    MultigridChoices choices;
    std::vector<Level<D>> levels;
    CoarsestSolver<D> direct;
    std::ptrdiff_t rootless = 0;  ///< blocks

    /// x = one cycle for A x = b from x = 0.
    void cycle(std::size_t at)
    {
        Level<D>& l = levels[at];
        if (at + 1 == levels.size()) {
            direct.solve(l.b, l.x);
            return;
        }
        Level<D>& coarse = levels[at + 1];
        smooth(l, true);
        l.for_each_node([&](std::ptrdiff_t i) { l.r[i] -= l.product(l.d, i); });
        coarse.for_each_node([&](std::ptrdiff_t i) {
            Vec<D> sum{};
            l.children.for_each(i, [&](int child, double weight) { sum += weight * l.r[child]; });
            for (int a = 0; a < D; ++a) coarse.b[i][a] = coarse.nodes.held[i][a] ? 0.0 : sum[a];
        });
        cycle(at + 1);
        l.for_each_node([&](std::ptrdiff_t i) {
            Vec<D> sum{};
            l.parents.for_each(i, [&](int parent, double weight) { sum += weight * coarse.x[parent]; });
            for (int a = 0; a < D; ++a)
                if (!l.nodes.held[i][a]) l.x[i][a] += sum[a];
        });
        smooth(l, false);
    }
};

template <int D>
GridMultigrid<D>::GridMultigrid(const MultigridChoices& choices) : parts_(std::make_unique<Parts>())
{
    parts_->choices = choices;
    if (choices.direct_unknowns == 0) parts_->choices.direct_unknowns = D == 1 ? 100000 : D == 2 ? 4000 : 1500;
}
template <int D>
GridMultigrid<D>::~GridMultigrid() = default;
template <int D>
GridMultigrid<D>::GridMultigrid(GridMultigrid&&) noexcept = default;
template <int D>
GridMultigrid<D>& GridMultigrid<D>::operator=(GridMultigrid&&) noexcept = default;

template <int D>
bool GridMultigrid<D>::set_up(SparseRows<Mat<D>> matrix, const std::vector<Index<D>>& place, const Vec<D, bool>& periodic,
                              const Index<D>& cells, const std::vector<unsigned char>& held, bool is_symmetric)
{
    ORDO_EXPECT(matrix.first.size() == place.size() + 1 && held.size() == place.size() * D);
    std::vector<Level<D>>& levels = parts_->levels;
    levels.clear();
    parts_->rootless = 0;
    levels.emplace_back();
    levels[0].nodes  = nodes_of(place, periodic, cells, held);
    levels[0].matrix = std::move(matrix);
    drop_held(levels[0].matrix, levels[0].nodes.held);
    for (;;) {
        Level<D>& l            = levels.back();
        const std::ptrdiff_t n = l.nodes.count(), unknowns = l.nodes.unknowns();
        const MultigridChoices& chosen = parts_->choices;
        l.b.resize(n);
        l.x.resize(n);
        if (unknowns <= chosen.direct_unknowns) break;
        Coarsening<D> coarse = coarsened(l.nodes);
        if (static_cast<double>(coarse.nodes.unknowns()) > kStuck * static_cast<double>(unknowns)) break;
        for (Vectors<D>* v : {&l.r, &l.d, &l.e}) v->resize(n);
        l.smoothing = smoothing_of(l.matrix);
        if (chosen.degree > 0) l.smoothing.degree = chosen.degree;
        if (chosen.range > 0) l.smoothing.range = chosen.range;
        parts_->rootless += set_up_smoother(l);
        Level<D> next;
        next.matrix = galerkin_product(l.matrix, coarse);
        next.nodes  = std::move(coarse.nodes);
        l.parents   = std::move(coarse.parents);
        l.children  = std::move(coarse.children);
        levels.push_back(std::move(next));
    }
    const double rounding = 1e-14 * std::sqrt(static_cast<double>(levels[0].nodes.unknowns() + 1));
    return parts_->direct.factor(levels.back(), rounding, is_symmetric);
}

template <int D>
void GridMultigrid<D>::multiply(std::span<const double> x, std::span<double> y) const
{
    const Level<D>& l = parts_->levels.front();
    l.for_each_node([&](std::ptrdiff_t i) {
        Vec<D> sum{};
        l.matrix.for_each(i, [&](int j, const Mat<D>& block) {
            for (int a = 0; a < D; ++a)
                for (int b = 0; b < D; ++b) sum[a] += block(a, b) * x[j * D + b];
        });
        for (int a = 0; a < D; ++a) y[i * D + a] = l.nodes.held[i][a] ? x[i * D + a] : sum[a];
    });
}

template <int D>
void GridMultigrid<D>::apply(std::span<const double> r, std::span<double> z)
{
    Level<D>& l = parts_->levels.front();
    l.for_each_node([&](std::ptrdiff_t i) {
        for (int a = 0; a < D; ++a) l.b[i][a] = l.nodes.held[i][a] ? 0.0 : r[i * D + a];
    });
    parts_->cycle(0);
    l.for_each_node([&](std::ptrdiff_t i) {
        for (int a = 0; a < D; ++a) z[i * D + a] = l.nodes.held[i][a] ? r[i * D + a] : l.x[i][a];
    });
}

template <int D>
std::vector<std::ptrdiff_t> GridMultigrid<D>::unknowns() const
{
    std::vector<std::ptrdiff_t> r;
    for (const Level<D>& l : parts_->levels) r.push_back(l.nodes.unknowns());
    return r;
}

template <int D>
double GridMultigrid<D>::operator_complexity() const
{
    double sum = 0.0;
    for (const Level<D>& l : parts_->levels) sum += static_cast<double>(l.matrix.column.size());
    return sum / static_cast<double>(parts_->levels.front().matrix.column.size());
}

template <int D>
std::ptrdiff_t GridMultigrid<D>::blocks_without_root() const
{
    return parts_->rootless;
}

template class GridMultigrid<1>;
template class GridMultigrid<2>;
template class GridMultigrid<3>;

}  // namespace ordo
