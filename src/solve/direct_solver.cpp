#include "solve/direct_solver.hpp"

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "solve/scattered.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace ordo {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = std::vector<double>;

constexpr std::ptrdiff_t kUndivided = 32;  // nodes that are not worth a cut

/// Unknowns that are eliminated together, once their children are. Unknowns have numbers in the order of their elimination.
struct Part {
    int begin, end;             ///< what it eliminates
    std::vector<int> children;  ///< parts
    std::vector<int> rim;       ///< later unknowns that it changes, ascending
    std::vector<int> in_front;  ///< where those of the rim are in the parent's front
    // Of the front, [eliminated, rim] in rows and columns, P A_ee = L U. Of a symmetric matrix A_ee = L L^T, and of the front and the rest there are
    // only lower triangles.
    Eigen::PartialPivLU<Matrix> own;
    Eigen::LLT<Matrix> root;
    Matrix upper, lower;  ///< L^-1 P A_er, A_re U^-1; of a symmetric matrix A_re L^-T is lower, and there is no upper
    Matrix rest;          ///< what its parent is to add, A_rr - lower upper
    bool is_eliminated = false;

    int size() const { return end - begin; }
};

/// The parts of a matrix, children before their parents, with nodes for unknowns: unknowns in a row that have the same place.
class Dissection {
  public:
    Dissection(const SparseRows<double>& matrix, const std::vector<Index<3>>& place)
    {
        std::vector<int> node_of(place.size());
        for (std::size_t i = 0; i < place.size(); ++i) {
            if (i == 0 || !(place[i] == place[i - 1])) {
                place_.push_back(place[i]);
                begin.push_back(static_cast<int>(i));
            }
            node_of[i] = static_cast<int>(std::ssize(begin)) - 1;
        }
        begin.push_back(static_cast<int>(std::ssize(place)));
        neighbours_.resize(place_.size());
        const auto join = [&](int i, int j) {
            if (i != j && (neighbours_[i].empty() || neighbours_[i].back() != j)) neighbours_[i].push_back(j);
        };
        for (std::size_t i = 0; i < place.size(); ++i)
            matrix.for_each(i, [&](int j, double) {
                join(node_of[i], node_of[j]);
                join(node_of[j], node_of[i]);
            });
        parallel_for_each(std::ssize(neighbours_), [&](std::ptrdiff_t i) {
            std::sort(neighbours_[i].begin(), neighbours_[i].end());
            neighbours_[i].erase(std::unique(neighbours_[i].begin(), neighbours_[i].end()), neighbours_[i].end());
        });
        mark_.assign(place_.size(), -1);
        std::vector<int> all(place_.size());
        std::iota(all.begin(), all.end(), 0);
        dissect(std::move(all));
        number.resize(order.size());
        for (std::size_t k = 0; k < order.size(); ++k) number[order[k]] = static_cast<int>(k);
        for (int p = 0; p < std::ssize(parts); ++p) find_rim(p);
    }

    std::vector<int> begin;          ///< the unknowns of each node, and their end
    std::vector<int> order, number;  ///< the node with each number, and the number of each node
    std::vector<Part> parts;

  private:
    /// Cuts across the longest axis: what is below and joined to what is above is eliminated after both. Returns the part's number.
    int dissect(std::vector<int> members)
    {
        Index<3> low = place_[members[0]], high = low;
        for (const int i : members)
            for (int a = 0; a < 3; ++a) {
                low[a]  = std::min(low[a], place_[i][a]);
                high[a] = std::max(high[a], place_[i][a]);
            }
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
        Part part{};
        if (std::ssize(members) > kUndivided && high[axis] > low[axis]) {
            const auto middle = members.begin() + std::ssize(members) / 2;
            std::nth_element(members.begin(), middle, members.end(),
                             [&](int i, int j) { return place_[i][axis] < place_[j][axis]; });
            const int cut = std::max(place_[*middle][axis], low[axis] + 1);
            const auto above =
                std::stable_partition(members.begin(), members.end(), [&](int i) { return place_[i][axis] < cut; });
            for (auto i = above; i != members.end(); ++i) mark_[*i] = 0;
            const auto joined = std::stable_partition(members.begin(), above, [&](int i) {
                return std::none_of(neighbours_[i].begin(), neighbours_[i].end(), [&](int j) { return mark_[j] == 0; });
            });
            for (auto i = above; i != members.end(); ++i) mark_[*i] = -1;
            if (joined != members.begin()) part.children.push_back(dissect({members.begin(), joined}));
            part.children.push_back(dissect({above, members.end()}));
            members = {joined, above};
        }
        part.begin = static_cast<int>(std::ssize(order));
        order.insert(order.end(), members.begin(), members.end());
        part.end = static_cast<int>(std::ssize(order));
        parts.push_back(std::move(part));
        return static_cast<int>(std::ssize(parts)) - 1;
    }

    void find_rim(int p)
    {
        Part& part     = parts[p];
        const auto add = [&](int k) {
            if (k >= part.end && std::exchange(mark_[k], p) != p) part.rim.push_back(k);
        };
        for (int k = part.begin; k < part.end; ++k)
            for (const int j : neighbours_[order[k]]) add(number[j]);
        for (const int c : part.children)
            for (const int k : parts[c].rim) add(k);
        std::sort(part.rim.begin(), part.rim.end());
    }

    std::vector<Index<3>> place_;
    std::vector<std::vector<int>> neighbours_;
    std::vector<int> mark_;  ///< of nodes above a cut, or of numbers: the last part that has them in its rim
};

/// An entry of the matrix in the front of the part that eliminates the first of its unknowns.
struct Entry {
    int row, column;
    std::ptrdiff_t at;  ///< in the rows given
};

}  // namespace

struct DirectSolver::Parts {
    std::vector<std::ptrdiff_t> first;
    std::vector<int> column, order;
    std::vector<Index<3>> place;
    std::vector<Part> parts;
    std::vector<std::vector<int>> ranks;      ///< parts of which none is a child of another, children first
    std::vector<std::vector<Entry>> entries;  ///< of each part
    std::vector<std::vector<double>> rooms;   ///< for fronts, for each thread
    Eigen::VectorXd right;                    ///< aligned, so that bits do not depend on where it lies
    bool has_roots = false;                   ///< parts have Cholesky factors

    bool fits(const SparseRows<double>& m, const std::vector<Index<3>>& at) const
    {
        return m.first == first && m.column == column && at == place;
    }

    Parts(const SparseRows<double>& matrix, const std::vector<Index<3>>& at)
        : first(matrix.first), column(matrix.column), place(at)
    {
        Dissection cut(matrix, place);
        parts = std::move(cut.parts);
        std::vector<int> start{0}, number(place.size()), part_of(place.size()), rank_of(parts.size(), 0);
        for (const int node : cut.order) {
            for (int i = cut.begin[node]; i < cut.begin[node + 1]; ++i) {
                number[i] = static_cast<int>(std::ssize(order));
                order.push_back(i);
            }
            start.push_back(static_cast<int>(std::ssize(order)));
        }
        for (std::size_t p = 0; p < parts.size(); ++p) {
            Part& part = parts[p];
            part.begin = start[part.begin];
            part.end   = start[part.end];
            std::vector<int> rim;
            for (const int k : part.rim)
                for (int i = start[k]; i < start[k + 1]; ++i) rim.push_back(i);
            part.rim = std::move(rim);
            for (int k = part.begin; k < part.end; ++k) part_of[k] = static_cast<int>(p);
            for (const int c : part.children) rank_of[p] = std::max(rank_of[p], rank_of[c] + 1);
            ranks.resize(std::max(ranks.size(), static_cast<std::size_t>(rank_of[p]) + 1));
            ranks[rank_of[p]].push_back(static_cast<int>(p));
        }
        entries.resize(parts.size());
        for (std::size_t i = 0; i < place.size(); ++i)
            for (std::ptrdiff_t k = first[i]; k < first[i + 1]; ++k) {
                const int row = number[i], col = number[column[k]];
                entries[part_of[std::min(row, col)]].push_back({row, col, k});
            }
        std::vector<int> place_in_front(place.size());
        for (std::size_t p = 0; p < parts.size(); ++p) {
            const Part& part = parts[p];
            for (int k = part.begin; k < part.end; ++k) place_in_front[k] = k - part.begin;
            for (std::size_t k = 0; k < part.rim.size(); ++k) place_in_front[part.rim[k]] = part.size() + static_cast<int>(k);
            for (Entry& e : entries[p]) e = {place_in_front[e.row], place_in_front[e.column], e.at};
            for (const int c : part.children)
                for (const int k : parts[c].rim) parts[c].in_front.push_back(place_in_front[k]);
        }
    }

    /// False if a part of a symmetric matrix is not positive definite.
    bool eliminate(const SparseRows<double>& matrix, bool is_symmetric)
    {
        has_roots = is_symmetric;
        rooms.resize(thread_count());
        for (const std::vector<int>& of_rank : ranks) {
            parallel_for(std::ssize(of_rank),
                         [&](std::ptrdiff_t k) { eliminate(parts[of_rank[k]], entries[of_rank[k]], matrix); });
            if (!std::all_of(of_rank.begin(), of_rank.end(), [&](int p) { return parts[p].is_eliminated; })) return false;
        }
        return true;
    }

    void eliminate(Part& part, const std::vector<Entry>& of_part, const SparseRows<double>& matrix)
    {
        const int own = part.size(), all = own + static_cast<int>(part.rim.size());
        std::vector<double>& room = rooms[thread_index()];
        room.assign(std::ptrdiff_t{all} * all, 0.0);
        Eigen::Map<Matrix> front(room.data(), all, all);
        for (const Entry& e : of_part)
            if (!has_roots || e.row >= e.column) front(e.row, e.column) += matrix.value[e.at];
        for (const int c : part.children) {
            Part& child = parts[c];
            for (Eigen::Index j = 0; j < child.rest.cols(); ++j) {
                double* to         = &front(0, child.in_front[j]);
                const double* from = &child.rest(0, j);
                for (Eigen::Index i = has_roots ? j : 0; i < child.rest.rows(); ++i) to[child.in_front[i]] += from[i];
            }
            child.rest.resize(0, 0);
        }
        part.is_eliminated = true;
        part.lower         = front.bottomLeftCorner(all - own, own);
        part.rest          = front.bottomRightCorner(all - own, all - own);
        if (own == 0) return;
        if (has_roots) {
            part.root.compute(front.topLeftCorner(own, own));
            part.is_eliminated = part.root.info() == Eigen::Success;
            if (!part.is_eliminated) return;
            part.root.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(part.lower);
            part.rest.selfadjointView<Eigen::Lower>().rankUpdate(part.lower, -1.0);
            return;
        }
        part.own.compute(front.topLeftCorner(own, own));
        part.upper = part.own.permutationP() * front.topRightCorner(own, all - own);
        part.own.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(part.upper);
        part.own.matrixLU().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(part.lower);
        part.rest.noalias() -= part.lower * part.upper;
    }

    void solve(std::span<const double> b, std::span<double> x)
    {
        right.resize(std::ssize(order));
        for (std::size_t k = 0; k < order.size(); ++k) right[k] = b[order[k]];
        const auto mine = [&](const Part& part) { return right.segment(part.begin, part.size()); };
        Eigen::VectorXd at_rim;
        for (const Part& part : parts) {
            if (part.size() == 0) continue;
            auto own = mine(part);
            if (has_roots) {
                part.root.matrixL().solveInPlace(own);
            } else {
                own = part.own.permutationP() * Eigen::VectorXd(own);
                part.own.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(own);
            }
            at_rim.noalias() = part.lower * own;
            for (std::size_t k = 0; k < part.rim.size(); ++k) right[part.rim[k]] -= at_rim[static_cast<Eigen::Index>(k)];
        }
        for (std::size_t p = parts.size(); p-- > 0;) {
            const Part& part = parts[p];
            if (part.size() == 0) continue;
            auto own = mine(part);
            at_rim.resize(std::ssize(part.rim));
            for (std::size_t k = 0; k < part.rim.size(); ++k) at_rim[static_cast<Eigen::Index>(k)] = right[part.rim[k]];
            if (has_roots) {
                own.noalias() -= part.lower.transpose() * at_rim;
                part.root.matrixU().solveInPlace(own);
            } else {
                own.noalias() -= part.upper * at_rim;
                part.own.matrixLU().triangularView<Eigen::Upper>().solveInPlace(own);
            }
        }
        for (std::size_t k = 0; k < order.size(); ++k) x[order[k]] = right[k];
    }

    /// Whether factors are those of a regular matrix: a load at random moves no unknown too far and leaves a small residual; NaN does neither.
    bool serve(const SparseRows<double>& matrix, double tolerance)
    {
        const std::size_t n = place.size();
        Vector load(n), x(n);
        for (std::size_t i = 0; i < n; ++i) {
            double stiffness = 0.0;
            matrix.for_each(i, [&](int, double value) { stiffness += std::fabs(value); });
            load[i] = scattered(i) * stiffness;
        }
        solve(load, x);
        double residual = 0.0, size = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            double rest = -load[i];
            size += std::fabs(load[i]);
            matrix.for_each(i, [&](int j, double value) {
                const double one = value * x[j];
                rest += one;
                size += std::fabs(one);
            });
            residual += std::fabs(rest);
            if (!(std::fabs(x[i]) < 1 / tolerance)) return false;
        }
        return residual < 1e-6 * size;
    }
};

DirectSolver::DirectSolver()                                   = default;
DirectSolver::~DirectSolver()                                  = default;
DirectSolver::DirectSolver(DirectSolver&&) noexcept            = default;
DirectSolver& DirectSolver::operator=(DirectSolver&&) noexcept = default;

bool DirectSolver::factor(const SparseRows<double>& matrix, const std::vector<Index<3>>& place, double tolerance,
                          bool is_symmetric)
{
    ORDO_EXPECT(matrix.first.size() == place.size() + 1);
    if (place.empty()) return true;
    if (!parts_ || !parts_->fits(matrix, place)) parts_ = std::make_unique<Parts>(matrix, place);
    if (is_symmetric && parts_->eliminate(matrix, true) && parts_->serve(matrix, tolerance)) return true;
    parts_->eliminate(matrix, false);
    return parts_->serve(matrix, tolerance);
}

void DirectSolver::solve(std::span<const double> b, std::span<double> x)
{
    if (!b.empty()) parts_->solve(b, x);
}

}  // namespace ordo
