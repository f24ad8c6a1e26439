// Least squares on moments: the one engine of Shepard, MLS, IMLS, CPLS, IMPM and TLS.
//
// At a target y, with monomials p of (x_s - y)/h, samples s of weight w_s and values u_s,
//
//     M = sum_s w_s p p^T      B = sum_s w_s p u_s      fit(x) = p((x - y)/h) . M^-1 B
//
// A record holds the entries of M, which are moments up to twice the degree, and of B. One scatter of the samples fills the
// records of all targets, and one small solve per target evaluates them; nothing is stored for pairs of sample and target.
#pragma once

#include "base/lanes.hpp"
#include "kernels/ldl.hpp"
#include "kernels/monomials.hpp"
#include "shape/weights.hpp"

#include <array>
#include <cstddef>

namespace ordo {

/// Records for polynomials of a degree in D coordinates and `fields` values per sample; of `totals` values more only the
/// weighted sum is kept.
template <int D, int degree, int fields, int totals = 0>
struct Moments {
    static constexpr int unknowns = Monomials<D, degree>::count;
    static constexpr int products = Monomials<D, 2 * degree>::count;  ///< distinct entries of M
    static constexpr int values   = fields + totals;                  ///< of a sample
    static constexpr int numbers  = products + fields * unknowns + totals;
    static constexpr int size     = (numbers + 7) / 8;  ///< Lanes of a record

    using Record = Lanes[size];

    /// The numbers that a sample of weight 1 at a distance from the target adds to its record.
    template <class T>
    ORDO_FLAT static void evaluate(const Vec<D, T>& distance, const T (&u)[values], T (&number)[numbers])
    {
        T p[products];
        Monomials<D, 2 * degree>::evaluate(distance, p);
        for (int k = 0; k < products; ++k) number[k] = p[k];
        for (int f = 0; f < fields; ++f)
            for (int k = 0; k < unknowns; ++k) number[products + f * unknowns + k] = u[f] * p[k];
        for (int f = 0; f < totals; ++f) number[products + fields * unknowns + f] = u[fields + f];
    }
    /// Adds a sample: the plain form of `spread`.
    ORDO_HD static void add(Lanes* record, const Vec<D>& distance, double weight, const double (&u)[values])
    {
        double number[numbers];
        evaluate(distance, u, number);
        for (int k = 0; k < numbers; ++k) at(record, k) += weight * number[k];
    }

    /// Adds a sample at cell coordinates y to the records of all its targets; record k of the lattice starts at
    /// records[k * size]. Each number of a record is a product of one factor per axis: weight times a power of the distance.
    template <class Places, int W>
    ORDO_FLAT static void spread(const Lattice<D>& g, Lanes* records, const Vec<D>& y, const double (&u)[values])
    {
        constexpr int capacity = Places::template capacity<W>;
        Lanes factor[D][capacity][size];
        int count[D];
        std::ptrdiff_t first = 0;
        for (int a = 0; a < D; ++a) {
            WeightRow<capacity> row;
            Places::template fill<W>(g, a, y[a], row);
            count[a] = Places::is_even ? capacity : row.count;
            first += g.stride[a] * row.first;
            for (int k = 0; k < (Places::is_even ? capacity : row.count); ++k)
                for (int q = 0; q < size; ++q) {
                    Lanes power = masks.power[a][2 * degree][q];
                    for (int e = 2 * degree - 1; e >= 0; --e) power = power * row.distance[k] + masks.power[a][e][q];
                    factor[a][k][q] = power * row.weight[k];
                }
        }
        for (int q = 0; q < size; ++q) {
            Lanes value = masks.field[values][q];
            for (int f = 0; f < values; ++f) value += masks.field[f][q] * u[f];
            for (int k = 0; k < (Places::is_even ? capacity : count[D - 1]); ++k)
                factor[D - 1][k][q] = factor[D - 1][k][q] * value;
        }
        spread_axis<D - 1, Places::is_even>(g, records + first * size, factor, count, factor[D - 1][0]);
    }

    /// The lower half of M. Diagonal entries within the round-off of the sums become zero: samples on a line through the
    /// target do not determine a slope across it.
    ORDO_HD static void matrix(const Lanes* record, double (&M)[unknowns][unknowns])
    {
        constexpr Products at;
        constexpr double round_off = 1e-15;
        for (int i = 0; i < unknowns; ++i)
            for (int j = 0; j <= i; ++j) M[i][j] = get(record, at.of[i][j]);
        for (int i = 1; i < unknowns; ++i)
            if (M[i][i] <= round_off * M[0][0]) M[i][i] = 0.0;
    }
    /// The right-hand side of a field.
    ORDO_HD static void right_side(const Lanes* record, int field, double (&b)[unknowns])
    {
        for (int k = 0; k < unknowns; ++k) b[k] = get(record, products + field * unknowns + k);
    }
    /// The sum of weights.
    ORDO_HD static double weight(const Lanes* record) { return get(record, 0); }
    /// Degree 0: the weighted mean of a field.
    ORDO_HD static double mean(const Lanes* record, int field)
    {
        return get(record, products + field * unknowns) / weight(record);
    }
    /// The weighted sum of value f of `totals`.
    ORDO_HD static double total(const Lanes* record, int f) { return get(record, products + fields * unknowns + f); }
    ORDO_FLAT static double get(const Lanes* record, int k) { return record[k / 8][k % 8]; }
    ORDO_FLAT static double& at(Lanes* record, int k) { return record[k / 8][k % 8]; }

  private:
    /// The places of products of two monomials among the moments.
    struct Products {
        int of[unknowns][unknowns]{};

        ORDO_HD constexpr Products()
        {
            constexpr Monomials<D, degree> single;
            constexpr Monomials<D, 2 * degree> pair;
            for (int i = 0; i < unknowns; ++i)
                for (int j = 0; j < unknowns; ++j) {
                    Index<D> e = single.exponent[i];
                    for (int a = 0; a < D; ++a) e[a] += single.exponent[j][a];
                    of[i][j] = pair.find(e);
                }
        }
    };

    /// For each number of a record: the powers of the distances, and the field that it is multiplied by, -1 for none.
    struct Number {
        Index<D> power;
        int field;
    };
    static constexpr std::array<Number, size * 8> make_numbers()
    {
        std::array<Number, size * 8> r{};
        for (int k = 0; k < size * 8; ++k) {
            if (k < products)
                r[k] = {monomials<D, 2 * degree>.exponent[k], -1};
            else if (k < products + fields * unknowns)
                r[k] = {monomials<D, degree>.exponent[(k - products) % unknowns], (k - products) / unknowns};
            else if (k < numbers)
                r[k] = {{}, k - products - fields * unknowns + fields};
            else
                r[k] = {{}, values};  // spare
        }
        return r;
    }
    static constexpr std::array<Number, size* 8> factors = make_numbers();

    /// power[a][e][q] is 1 in the lanes of part q of a record whose power along axis a is e; field[f][q] is 1 in those that are
    /// multiplied by value f, where f = values stands for none.
    struct Masks {
        Lanes power[D][2 * degree + 1][size]{};
        Lanes field[values + 1][size]{};

        Masks()
        {
            for (int k = 0; k < numbers; ++k) {
                for (int a = 0; a < D; ++a) power[a][factors[k].power[a]][k / 8][k % 8] = 1.0;
                field[factors[k].field < 0 ? values : factors[k].field][k / 8][k % 8] = 1.0;
            }
        }
    };
    static inline const Masks masks{};

    template <int A, bool is_even, int capacity>
    ORDO_FLAT static void spread_axis(const Lattice<D>& g, Lanes* record, const Lanes (&factor)[D][capacity][size],
                                      const int (&count)[D], const Lanes* outer)
    {
        for (int k = 0; k < (is_even ? capacity : count[A]); ++k) {
            Lanes product[size];
            for (int q = 0; q < size; ++q) product[q] = A == D - 1 ? factor[A][k][q] : factor[A][k][q] * outer[q];
            if constexpr (A == 0)
                for (int q = 0; q < size; ++q) record[k * size + q] += product[q];
            else
                spread_axis<A - 1, is_even>(g, record + k * g.stride[A] * size, factor, count, product);
        }
    }
};

}  // namespace ordo
