#include "implicit/tangent_matrix.hpp"

#include <algorithm>

namespace ordo {

namespace {

/// y += sum_n of[n] x_n of vectors of a length, one x_n after the other.
template <std::size_t N>
void add_combination(const double (&of)[N], const double* x, double* y, std::size_t length)
{
    for (std::size_t k = 0; k < length; ++k) {
        double sum = y[k];
        for (std::size_t n = 0; n < N; ++n) sum += of[n] * x[n * length + k];
        y[k] = sum;
    }
}

}  // namespace

/// The particles of a body in a cell of the grid, and a matrix between all nodes of theirs. One serves many cells in turn.
template <int D>
struct TangentMatrix<D>::Cell {
    struct Weight {
        std::size_t node;  ///< in patch->row
        double value;
        Vec<D> slope;
    };
    Patch* patch = nullptr;
    std::span<const int> particle;
    std::vector<NodeWeight<D>> listed;         ///< of a particle
    std::vector<Weight> weights;               ///< of all particles, at nodes with a row
    std::vector<std::size_t> begin;            ///< of each particle in weights, and the end
    std::vector<double> mean, change, stress;  ///< room of add_averaged

    std::span<const Weight> weights_of(std::size_t q) const { return {weights.data() + begin[q], begin[q + 1] - begin[q]}; }
    std::size_t width() const { return D * patch->row.size(); }
    double* entries(std::size_t row, int a) { return patch->value.data() + (D * row + a) * width(); }
};

template <int D>
TangentMatrix<D>::TangentMatrix(const Sweep<D>& view, const Passes<D>& passes, const NodeRows<D>& rows, bool is_averaged)
    : view_(view), passes_(passes), rows_(rows), is_averaged_(is_averaged)
{
    const ParticleView<D>& p = view.p;
    std::vector<std::array<std::ptrdiff_t, 3>> order(p.count);  // body, cell, particle
    parallel_for_each(p.count, [&](std::ptrdiff_t i) {
        Index<D> cell{};
        for (int a = 0; a < D; ++a) cell[a] = static_cast<int>(view.lattice.cell_coordinate(a, p.x[i][a]));
        order[i] = {p.body[i], view.lattice.offset(cell), i};
    });
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < order.size(); ++k) {
        if (k > 0 && (order[k][0] != order[k - 1][0] || order[k][1] != order[k - 1][1])) begin_.push_back(std::ssize(particle_));
        particle_.push_back(static_cast<int>(order[k][2]));
    }
    begin_.push_back(std::ssize(particle_));
}

/// Adds what fill(cell) leaves in the patches of cells.
template <int D>
template <class Fill>
void TangentMatrix<D>::add(const Fill& fill, BlockRows<D>& to) const
{
    const std::ptrdiff_t count = std::ssize(begin_) - 1, at_once = (D == 3 ? 8 : 64) * thread_count();
    std::vector<Patch> patches;
    std::vector<Cell> rooms(static_cast<std::size_t>(thread_count()));
    for (std::ptrdiff_t first = 0; first < count; first += at_once) {
        patches.resize(std::min(at_once, count - first));
        parallel_for(std::ssize(patches), [&](std::ptrdiff_t k) {
            Cell& cell    = rooms[static_cast<std::size_t>(thread_index())];
            cell.patch    = &patches[k];
            cell.particle = {particle_.data() + begin_[first + k], particle_.data() + begin_[first + k + 1]};
            find_weights(cell);
            fill(cell);
        });
        to.add(patches);
    }
}

/// Finds the nodes of a cell's particles and the weights there, and empties the matrix.
template <int D>
void TangentMatrix<D>::find_weights(Cell& cell) const
{
    cell.weights.clear();
    cell.begin.assign(1, 0);
    std::vector<int>& row = cell.patch->row;
    row.clear();
    for (const int i : cell.particle) {
        passes_.list_weights(view_, i, cell.listed);
        for (const NodeWeight<D>& w : cell.listed)
            if (const int r = rows_.row(w.node); r > 0) {
                row.push_back(r - 1);
                cell.weights.push_back({static_cast<std::size_t>(r - 1), w.value, w.slope});
            }
        cell.begin.push_back(cell.weights.size());
    }
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    for (auto& w : cell.weights)
        w.node = static_cast<std::size_t>(std::lower_bound(row.begin(), row.end(), static_cast<int>(w.node)) - row.begin());
    cell.patch->value.assign(cell.width() * cell.width(), 0.0);
}

template <int D>
void TangentMatrix<D>::add_own(const ParticleForces<D>& forces, Cell& cell) const
{
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const Tangent<D>& A = forces.tangent(cell.particle[q]);
        for (const auto& from : cell.weights_of(q)) {
            double part[D * D][D];  // A contracted with the slope of the column
            for (int ab = 0; ab < D * D; ++ab)
                for (int c = 0; c < D; ++c) {
                    part[ab][c] = 0.0;
                    for (int d = 0; d < D; ++d) part[ab][c] += A.c[ab][D * c + d] * from.slope[d];
                }
            for (const auto& to : cell.weights_of(q))
                for (int a = 0; a < D; ++a) {
                    double* entry = cell.entries(to.node, a) + D * from.node;
                    for (int c = 0; c < D; ++c)
                        for (int b = 0; b < D; ++b) entry[c] += part[D * a + b][c] * to.slope[b];
                }
        }
    }
}

/// Averaged steps change by s (df + (mean theta - theta) f/D) with theta = f^-T : df: a particle has all nodes of its cell.
template <int D>
void TangentMatrix<D>::add_averaged(const ParticleForces<D>& forces, Cell& cell) const
{
    constexpr std::size_t square = D * D;
    const std::size_t width      = cell.width();
    auto dilation_of             = [&](int i) { return (1 / det(forces.step(i))) * cofactor(forces.step(i)); };  // times a slope
    cell.mean.assign(width, 0.0);
    double total = 0.0;
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const double weight   = forces.weight(cell.particle[q]);
        const Mat<D> dilation = dilation_of(cell.particle[q]);
        total += weight;
        for (const auto& w : cell.weights_of(q)) {
            const Vec<D> one = dilation * w.slope;
            for (int c = 0; c < D; ++c) cell.mean[D * w.node + c] += weight * one[c];
        }
    }
    // Rows D a + b of the change of the step's component ab, and of the stress; columns are unknowns.
    cell.change.resize(square * width);
    cell.stress.resize(square * width);
    double *change = cell.change.data(), *stress = cell.stress.data();
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const int i           = cell.particle[q];
        const Mat<D>& step    = forces.step(i);
        const Tangent<D>& A   = forces.tangent(i);
        const double factor   = forces.scale(i) * forces.scale(i);
        const Mat<D> dilation = dilation_of(i);
        for (std::size_t ab = 0; ab < square; ++ab) {
            const double part = step(static_cast<int>(ab) / D, static_cast<int>(ab) % D) / D;
            for (std::size_t k = 0; k < width; ++k) change[ab * width + k] = part * cell.mean[k] / total;
        }
        for (const auto& w : cell.weights_of(q)) {
            const Vec<D> own = dilation * w.slope;
            for (int c = 0; c < D; ++c) {
                double* column = change + D * w.node + c;
                for (std::size_t ab = 0; ab < square; ++ab)
                    column[ab * width] -= own[c] / D * step(static_cast<int>(ab) / D, static_cast<int>(ab) % D);
                for (int d = 0; d < D; ++d) column[(D * c + d) * width] += w.slope[d];
            }
        }
        std::fill(cell.stress.begin(), cell.stress.end(), 0.0);
        for (std::size_t ab = 0; ab < square; ++ab) {
            double of[square];
            for (std::size_t cd = 0; cd < square; ++cd) of[cd] = factor * A.c[ab][cd];
            add_combination(of, change, stress + ab * width, width);
        }
        for (std::size_t m = 0; m < width; ++m) {
            double of[square];
            for (std::size_t ab = 0; ab < square; ++ab) of[ab] = change[ab * width + m];
            add_combination(of, stress, cell.patch->value.data() + m * width, width);
        }
    }
}

template <int D>
void TangentMatrix<D>::add_stiffness(const ParticleForces<D>& forces, BlockRows<D>& to) const
{
    add([&](Cell& cell) { is_averaged_ ? add_averaged(forces, cell) : add_own(forces, cell); }, to);
}

template <int D>
void TangentMatrix<D>::add_mass(double factor, const std::vector<unsigned char>& is_coupled, BlockRows<D>& to) const
{
    add(
        [&](Cell& cell) {
            for (std::size_t q = 0; q < cell.particle.size(); ++q)
                for (const auto& row : cell.weights_of(q))
                    for (const auto& column : cell.weights_of(q)) {
                        if (!is_coupled[cell.patch->row[row.node]] || !is_coupled[cell.patch->row[column.node]]) continue;
                        const double one = factor * view_.p.m[cell.particle[q]] * row.value * column.value;
                        for (int a = 0; a < D; ++a) cell.entries(row.node, a)[D * column.node + a] += one;
                    }
        },
        to);
}

template class TangentMatrix<1>;
template class TangentMatrix<2>;
template class TangentMatrix<3>;

}  // namespace ordo
