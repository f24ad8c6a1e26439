// The ghost penalty for splines on part of the grid: jumps of the highest derivative at the faces of cut cells. It couples
// functions with almost no part of the body in their support to their neighbours, so that no cut, however small, makes a system
// singular (Burman 2010, Comptes Rendus Mathematique 348, 1217; for splines Sticko, Ludvigsson & Kreiss 2020, BIT 60, 1067). It
// is zero for polynomials of the splines' degree, so it does not change the order of fits and mass matrices, nor momentum.
#pragma once

#include "base/gauss_rule.hpp"
#include "grid/cox_de_boor.hpp"
#include "spline/axis.hpp"
#include "spline/cut_rule.hpp"
#include "spline/matrix.hpp"

#include <cstddef>
#include <vector>

namespace ordo {

/// g(u, v) = sum over faces of the integral of [d^P u/dn^P] [d^P v/dn^P], lengths in cells. Its matrix is G.
template <int D>
class GhostPenalty {
  public:
    GhostPenalty() = default;
    /// `cover` is that of all cells, the first axis fastest. The faces are those between a cut cell and another cell that is
    /// not empty.
    GhostPenalty(const SplineSpace<D>& space, const Index<D>& cells, const std::vector<Cover>& cover) : space_(space)
    {
        IndexBox<D>{{}, cells}.for_each([&](const Index<D>& cell) {
            const Cover here = cover[number_of(cell, cells)];
            if (here == Cover::none) return;
            for (int a = 0; a < D; ++a) {
                Index<D> next = cell;
                if (++next[a] == cells[a]) {
                    if (!space.axis[a].periodic) continue;
                    next[a] = 0;
                }
                const Cover there = cover[number_of(next, cells)];
                if (there == Cover::none || (here == Cover::all && there == Cover::all)) continue;
                if (space.axis[a].span_of(cell[a]) != space.axis[a].span_of(next[a])) faces_.push_back({cell, a});
            }
        });
        with_degree(space.axis[0].degree, [&]<int P>() {
            for (int a = 0; a < D; ++a) set_axis<P>(a, cells[a]);
        });
    }

    /// to += factor G from.
    template <class T, class Factor>
    void multiply(const Factor& factor, const T* from, T* to) const
    {
        with_degree(space_.axis[0].degree, [&]<int P>() {
            for (const Face& face : faces_) {
                constexpr int width = P + 1;
                T jump[power_of(width, D - 1)];
                for (T& j : jump) j = T(0.0);
                visit<P>(face, [&](std::size_t function, int across, double d) { jump[across] += from[function] * d; });
                auto gram = [&](int b) { return gram_[b].data() + face.cell[b] * width * width; };
                if constexpr (D > 1) multiply_gram<P, 1>(gram(face.axis() == 0 ? 1 : 0), jump);
                if constexpr (D > 2) multiply_gram<P, width>(gram(face.axis() == 2 ? 1 : 2), jump);
                for (T& j : jump) j = j * factor;
                visit<P>(face, [&](std::size_t function, int across, double d) { to[function] += jump[across] * d; });
            }
        });
    }

    /// Adds `weights` times G to a matrix with one column more on each side than the degree.
    void add_to(SplineMatrix<D>& matrix, const double* weights) const
    {
        with_degree(space_.axis[0].degree, [&]<int P>() {
            for (const Face& face : faces_) {
                const double* jump = jumps_[face.axis()].data() + face.cell[face.axis()] * (P + 2);
                double across[(P + 2) * (P + 2)];
                for (int i = 0; i < P + 2; ++i)
                    for (int j = 0; j < P + 2; ++j) across[i * (P + 2) + j] = jump[i] * jump[j];
                Vec<D, const double*> matrices{};
                for (int b = 0; b < D; ++b)
                    matrices[b] = b == face.axis() ? across : gram_[b].data() + face.cell[b] * (P + 1) * (P + 1);
                matrix.add(space_.first_of(face.cell), size_at<P>(face), matrices, weights);
            }
        });
    }

  private:
    struct Face {
        Index<D> cell;  ///< on the lower side of the face
        int normal;     ///< the axis normal to it, see axis()

        /// In 1D the compiler must know that this is axis 0: otherwise it also unrolls the other case and warns about it.
        int axis() const { return D == 1 ? 0 : normal; }
    };

    template <int P>
    static Index<D> size_at(const Face& face)
    {
        Index<D> size     = Index<D>::filled(P + 1);
        size[face.axis()] = P + 2;
        return size;
    }

    template <int P>
    void set_axis(int a, int cells)
    {
        const SplineAxis& axis = space_.axis[a];
        for (int cell = 0; cell < cells; ++cell) {
            double before[P + 1], after[P + 1] = {}, jump[P + 2] = {};
            const int span = axis.span_of(cell);
            highest_derivative<P>(axis, span, before);
            if (axis.periodic || span + 1 < axis.spans()) highest_derivative<P>(axis, span + 1, after);
            for (int j = 0; j <= P; ++j) {
                jump[j] -= before[j];
                jump[j + 1] += after[j];
            }
            jumps_[a].insert(jumps_[a].end(), jump, jump + P + 2);
            double gram[(P + 1) * (P + 1)] = {}, w[P + 1], dw[P + 1];
            for (const auto& [at, weight] : gauss_rule(P + 1)) {
                axis.row<P>(span, cell + at, w, dw);
                for (int i = 0; i <= P; ++i)
                    for (int j = 0; j <= P; ++j) gram[i * (P + 1) + j] += weight * w[i] * w[j];
            }
            gram_[a].insert(gram_[a].end(), gram, gram + (P + 1) * (P + 1));
        }
    }

    /// f(function, its number within the face, jump of its derivative) for the functions with a jump at a face.
    template <int P, class F>
    void visit(const Face& face, const F& f) const
    {
        const double* jump   = jumps_[face.axis()].data() + face.cell[face.axis()] * (P + 2);
        const Index<D> first = space_.first_of(face.cell);
        IndexBox<D>{{}, size_at<P>(face)}.for_each([&](const Index<D>& k) {
            Index<D> at{};
            int across = 0;
            for (int b = D - 1; b >= 0; --b) {
                at[b] = space_.axis[b].wrapped(first[b] + k[b]);
                if (b != face.axis()) across = across * (P + 1) + k[b];
            }
            f(space_.number(at), across, jump[k[face.axis()]]);
        });
    }

    /// Applies a Gram matrix of P + 1 rows to one axis of a block of values.
    template <int P, int stride, class T, std::size_t N>
    static void multiply_gram(const double* gram, T (&values)[N])
    {
        constexpr std::size_t width = P + 1;
        for (std::size_t outer = 0; outer < N; outer += width * stride)
            for (std::size_t first = outer; first < outer + stride; ++first) {
                T line[width];
                for (std::size_t i = 0; i < width; ++i) line[i] = values[first + i * stride];
                for (std::size_t i = 0; i < width; ++i) {
                    T sum = line[0] * gram[i * width];
                    for (std::size_t j = 1; j < width; ++j) sum = sum + line[j] * gram[i * width + j];
                    values[first + i * stride] = sum;
                }
            }
    }

    SplineSpace<D> space_{};
    std::vector<Face> faces_;
    Vec<D, std::vector<double>> jumps_{}, gram_{};  ///< [cell][function], [cell][function][function]
};

}  // namespace ordo
