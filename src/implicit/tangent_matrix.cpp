#include "implicit/tangent_matrix.hpp"

#include <algorithm>

namespace ordo {

/// The particles of a body in a cell of the grid, and a matrix between all nodes of theirs.
template <int D>
struct TangentMatrix<D>::Cell {
    struct Weight {
        std::size_t node;  ///< in patch.row
        double value;
        Vec<D> slope;
    };
    Patch& patch;
    std::vector<int> particle;
    std::vector<std::vector<Weight>> weights;  ///< of each particle

    std::size_t width() const { return D * patch.row.size(); }
    double* entries(std::size_t row, int a) { return patch.value.data() + (D * row + a) * width(); }
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
    for (std::ptrdiff_t first = 0; first < count; first += at_once) {
        patches.resize(std::min(at_once, count - first));
        parallel_for(std::ssize(patches), [&](std::ptrdiff_t k) {
            const std::ptrdiff_t begin = begin_[first + k], end = begin_[first + k + 1];
            Cell cell{patches[k], {particle_.begin() + begin, particle_.begin() + end}, {}};
            std::vector<std::vector<NodeWeight<D>>> listed(cell.particle.size());
            std::vector<int>& row = cell.patch.row;
            row.clear();
            for (std::size_t q = 0; q < listed.size(); ++q) {
                passes_.list_weights(view_, cell.particle[q], listed[q]);
                for (const NodeWeight<D>& w : listed[q])
                    if (const int r = rows_.row(w.node); r > 0) row.push_back(r - 1);
            }
            std::sort(row.begin(), row.end());
            row.erase(std::unique(row.begin(), row.end()), row.end());
            cell.patch.value.assign(cell.width() * cell.width(), 0.0);
            cell.weights.resize(listed.size());
            for (std::size_t q = 0; q < listed.size(); ++q)
                for (const NodeWeight<D>& w : listed[q])
                    if (const int r = rows_.row(w.node); r > 0)
                        cell.weights[q].push_back(
                            {static_cast<std::size_t>(std::lower_bound(row.begin(), row.end(), r - 1) - row.begin()), w.value,
                             w.slope});
            fill(cell);
        });
        to.add(patches);
    }
}

template <int D>
void TangentMatrix<D>::add_own(const ParticleForces<D>& forces, Cell& cell) const
{
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const Tangent<D>& A = forces.tangent(cell.particle[q]);
        for (const auto& from : cell.weights[q]) {
            double part[D * D][D];  // A contracted with the slope of the column
            for (int ab = 0; ab < D * D; ++ab)
                for (int c = 0; c < D; ++c) {
                    part[ab][c] = 0.0;
                    for (int d = 0; d < D; ++d) part[ab][c] += A.c[ab][D * c + d] * from.slope[d];
                }
            for (const auto& to : cell.weights[q])
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
    auto dilation_of             = [&](std::size_t q, const Vec<D>& slope) {
        const Mat<D>& step = forces.step(cell.particle[q]);
        return (1 / det(step)) * (cofactor(step) * slope);
    };
    std::vector<double> mean(width, 0.0);
    double total = 0.0;
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const double weight = forces.weight(cell.particle[q]);
        total += weight;
        for (const auto& w : cell.weights[q]) {
            const Vec<D> one = dilation_of(q, w.slope);
            for (int c = 0; c < D; ++c) mean[D * w.node + c] += weight * one[c];
        }
    }
    // Rows D a + b of the change of the step's component ab, and of the stress; columns are unknowns.
    std::vector<double> change(square * width), stress(square * width);
    for (std::size_t q = 0; q < cell.particle.size(); ++q) {
        const int i         = cell.particle[q];
        const Mat<D>& step  = forces.step(i);
        const Tangent<D>& A = forces.tangent(i);
        const double factor = forces.scale(i) * forces.scale(i);
        for (std::size_t ab = 0; ab < square; ++ab) {
            const double part = step(static_cast<int>(ab) / D, static_cast<int>(ab) % D) / D;
            for (std::size_t k = 0; k < width; ++k) change[ab * width + k] = part * mean[k] / total;
        }
        for (const auto& w : cell.weights[q]) {
            const Vec<D> own = dilation_of(q, w.slope);
            for (int c = 0; c < D; ++c) {
                double* column = change.data() + D * w.node + c;
                for (std::size_t ab = 0; ab < square; ++ab)
                    column[ab * width] -= own[c] / D * step(static_cast<int>(ab) / D, static_cast<int>(ab) % D);
                for (int d = 0; d < D; ++d) column[(D * c + d) * width] += w.slope[d];
            }
        }
        std::fill(stress.begin(), stress.end(), 0.0);
        for (std::size_t ab = 0; ab < square; ++ab)
            for (std::size_t cd = 0; cd < square; ++cd)
                for (std::size_t k = 0; k < width; ++k) stress[ab * width + k] += factor * A.c[ab][cd] * change[cd * width + k];
        for (std::size_t m = 0; m < width; ++m) {
            double* entry = cell.patch.value.data() + m * width;
            for (std::size_t ab = 0; ab < square; ++ab) {
                const double of_row = change[ab * width + m];
                for (std::size_t k = 0; k < width; ++k) entry[k] += of_row * stress[ab * width + k];
            }
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
                for (const auto& row : cell.weights[q])
                    for (const auto& column : cell.weights[q]) {
                        if (!is_coupled[cell.patch.row[row.node]] || !is_coupled[cell.patch.row[column.node]]) continue;
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
