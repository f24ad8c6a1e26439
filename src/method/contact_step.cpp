#include "method/contact_step.hpp"

#include "method/contact_points.hpp"
#include "method/vertex_rows.hpp"
#include "shape/curved_face.hpp"

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

constexpr double kPushOut = 0.025;  ///< of an overlap in the time h/c
constexpr double kClose   = 0.3;    ///< of the gap of a point that has pressed, in the same
constexpr double kAnchor  = 0.3;    ///< of the slip of a point that sticks, in the same

/// A matrix by rows, of which the columns are wanted: for each column its entries, rows ascending.
struct Columns {
    std::vector<int> first, row;  ///< of each column, and the end of the last: where its entries begin; of each entry
    std::vector<double> weight;

    /// for_each(f) calls f(row, column, weight) for all entries, rows ascending.
    template <class ForEach>
    Columns(std::size_t columns, const ForEach& for_each) : first(columns + 1, 0)
    {
        for_each([&](int, int column, double) { ++first[column + 1]; });
        for (std::size_t k = 0; k < columns; ++k) first[k + 1] += first[k];
        row.resize(static_cast<std::size_t>(first.back()));
        weight.resize(row.size());
        std::vector<int> next(first.begin(), first.end() - 1);
        for_each([&](int of, int column, double value) {
            const int e = next[column]++;
            row[e]      = of;
            weight[e]   = value;
        });
    }
    /// to[column] = sum of weight from[row], in parallel; each sum in the order of the rows.
    template <class T>
    void sum(const std::vector<T>& from, std::vector<T>& to) const
    {
        sum_by(from, to, [](double value) { return value; });
    }
    /// The same with the weights' sizes.
    template <class T>
    void sum_of_sizes(const std::vector<T>& from, std::vector<T>& to) const
    {
        sum_by(from, to, [](double value) { return std::fabs(value); });
    }

  private:
    template <class T, class F>
    void sum_by(const std::vector<T>& from, std::vector<T>& to, const F& of_weight) const
    {
        to.resize(first.size() - 1);
        parallel_for_each(static_cast<std::ptrdiff_t>(to.size()), [&](std::ptrdiff_t k) {
            T total{};
            for (int e = first[k]; e < first[k + 1]; ++e) total += of_weight(weight[e]) * from[row[e]];
            to[k] = total;
        });
    }
};

/// The contacts of a step.
template <int D>
class Meeting {
  public:
    /// `before`: obstacles before the kick.
    Meeting(const Model<D>& model, State<D>& s, Lanes* nodes, double dt, double dt_kick, std::vector<ObstacleMotion<D>> before)
        : model_(model), s_(s), nodes_(nodes), dt_(dt), dt_kick_(dt_kick), motions_before_(std::move(before))
    {}

    /// Finds the points. Returns whether there are any.
    bool find()
    {
        std::vector<std::vector<Vec<D>>> vertices;
        for (const ContactSurface<D>& surface : model_.surfaces) vertices.push_back(vertices_of(surface, model_, s_));
        points_ = find_contact_points(model_, s_, vertices, dt_, contact_reach(model_, s_));
        if (points_.empty()) return false;
        number_vertices(vertices);
        number_nodes();
        return true;
    }

    void solve()
    {
        int sweeps = 1;
        for (const ContactPair<D>& pair : model_.contacts) sweeps = std::max(sweeps, pair.sweeps);
        find_yields();
        std::vector<Vec<D>> u = find_start();
        for (int sweep = 0; sweep < sweeps; ++sweep) {
            if (sweep > 0) u = find_motion();
            find_resistance(u);
            std::vector<Vec<D>> change(points_.size());
            parallel_for_each(count(points_), [&](std::ptrdiff_t q) { change[q] = correct(q, u[q]); });
            add(change);
        }
        after_ = find_motion();
        parallel_for_each(count(points_), [&](std::ptrdiff_t q) { follow(points_[q], after_[q]); });
    }

    /// Gives the nodes their velocities, conditions what they hold, and the state its points.
    void finish(const Moment& when, const ExchangeSums<D>& sums)
    {
        parallel_for_each(count(v_), [&](std::ptrdiff_t k) {
            Lanes& node = nodes_[node_[k]];
            for (int a = 0; a < D; ++a) {
                node[NodeLane::velocity + a] += inverse_mass_[k][a] * impulse_[k][a];
                node[NodeLane::increment + a] += inverse_mass_[k][a] * impulse_[k][a];
            }
        });
        if (sums.is_wanted())
            s_.field.constraints.add_impulses(model_.conditions, when, sums, [&](std::ptrdiff_t node, int a) {
                const int k = s_.contacts.number[node] - 1;
                return k >= 0 ? -impulse_[k][a] : 0.0;
            });
        for (const std::ptrdiff_t node : node_) s_.contacts.number[node] = 0;
        report();
        s_.contacts.dt     = dt_kick_;
        s_.contacts.points = std::move(points_);
    }

  private:
    template <class T>
    static std::ptrdiff_t count(const std::vector<T>& v)
    {
        return static_cast<std::ptrdiff_t>(v.size());
    }
    const ContactPair<D>& pair_of(const ContactPoint<D>& point) const { return model_.contacts[point.key.pair]; }
    int obstacle_of(const ContactPoint<D>& point) const { return pair_of(point).obstacle; }
    /// Of the surface that point q is a vertex of, and of the other.
    int slave_of(const ContactPoint<D>& point) const { return pair_of(point).surface[point.key.side]; }
    int master_of(const ContactPoint<D>& point) const { return pair_of(point).surface[1 - point.key.side]; }
    const auto& master_vertices(const ContactPoint<D>& point) const
    {
        return model_.surfaces[master_of(point)].outline.vertices[point.face];
    }
    /// f(row, weight) for the rows of point q: at its own place with positive weights, at its foot with negative ones.
    template <class F>
    void for_each_row(std::ptrdiff_t q, const F& f) const
    {
        for (int i = first_row_[q]; i < first_row_[q + 1]; ++i) f(rows_of_points_[i].row, rows_of_points_[i].weight);
    }
    /// Of the foot: none on an obstacle.
    int corner_count(const ContactPoint<D>& point) const
    {
        return obstacle_of(point) < 0 ? model_.surfaces[master_of(point)].outline.faces[point.face].count : 0;
    }

    /// Numbers the vertices that the points use, and finds their rows.
    void number_vertices(const std::vector<std::vector<Vec<D>>>& vertices)
    {
        std::vector<std::vector<int>> number(vertices.size());
        struct Used {
            Vec<D> x;
            int body;
        };
        std::vector<Used> used;
        for (std::size_t k = 0; k < vertices.size(); ++k) number[k].assign(vertices[k].size(), -1);
        auto row_of = [&](int surface, int vertex) {
            int& r = number[surface][vertex];
            if (r < 0) {
                r = static_cast<int>(used.size());
                used.push_back({vertices[surface][vertex], model_.surfaces[surface].body});
            }
            return r;
        };
        first_row_.reserve(points_.size() + 1);
        rows_of_points_.reserve(points_.size() * (1 + Face<D>::max_corners));
        first_row_.push_back(0);
        for (const ContactPoint<D>& point : points_) {
            const int slave = slave_of(point), of = point.key.of;
            if (slave < 0) {  // a particle
                rows_of_points_.push_back({static_cast<int>(used.size()), 1.0});
                used.push_back({point.x, pair_of(point).body});
            } else if (pair_of(point).on_faces) {
                const Outline<D>& outline  = model_.surfaces[slave].outline;
                const FacePoint<D>& inside = face_points<D>(outline.faces[of].count)[point.key.ordinal];
                for (int c = 0; c < outline.faces[of].count; ++c)
                    rows_of_points_.push_back({row_of(slave, outline.vertices[of][c]), inside.weight[c]});
            } else {
                rows_of_points_.push_back({row_of(slave, of), 1.0});
            }
            for (int c = 0; c < corner_count(point); ++c)
                rows_of_points_.push_back({row_of(master_of(point), master_vertices(point)[c]), -point.weight[c]});
            first_row_.push_back(static_cast<int>(rows_of_points_.size()));
        }
        rows_.emplace(s_, used.size());
        row_count_ = used.size();
        parallel_for_each(count(used), [&](std::ptrdiff_t k) {
            const int field = model_.field_of(used[k].body);
            rows_->set(static_cast<std::size_t>(k), used[k].x, s_.field.tiles.first_node(field));
        });
        points_of_.emplace(row_count_, [&](auto&& f) {
            for (int q = 0; q < static_cast<int>(points_.size()); ++q)
                for_each_row(q, [&](int row, double weight) { f(q, row, weight); });
        });
    }

    /// Numbers the nodes of these rows.
    void number_nodes()
    {
        Array<int>& number = s_.contacts.number;
        if (number.size() != s_.field.nodes.size()) number = Array<int>(s_.field.nodes.size(), Pages::own);
        node_of_row_.resize(row_count_ * rows_->size());
        for (std::size_t k = 0; k < row_count_; ++k)
            for (std::size_t n = 0; n < rows_->size(); ++n) {
                const std::ptrdiff_t node = rows_->node(k, n);
                if (number[node] == 0) {
                    node_.push_back(node);
                    number[node] = static_cast<int>(node_.size());
                }
                node_of_row_[k * rows_->size() + n] = number[node] - 1;
            }
        rows_of_.emplace(node_.size(), [&](auto&& f) {
            for (std::size_t k = 0; k < row_count_; ++k)
                for (std::size_t n = 0; n < rows_->size(); ++n)
                    f(static_cast<int>(k), node_of_row_[k * rows_->size() + n], rows_->weight(k, n));
        });
        v_.resize(node_.size());
        records_.resize(node_.size());
        inverse_mass_.resize(node_.size());
        impulse_.assign(node_.size(), {});
        const std::vector<Met> met = met_nodes();
        parallel_for_each(count(node_), [&](std::ptrdiff_t k) {
            const Lanes& node = records_[k] = met[k].record;
            v_[k]                           = velocity_of<D>(node);
            const double m                  = node[NodeLane::mass];
            for (int a = 0; a < D; ++a) inverse_mass_[k][a] = m > 0 && !met[k].is_held[a] ? 1 / m : 0.0;
        });
    }

    /// A node of contact.
    struct Met {
        Lanes record;
        Vec<D, bool> is_held{};  ///< components, by conditions
        int number = 0;          ///< in node_
    };
    /// Of all of them, which several ranks may hold: all ranks solve the same contact.
    std::vector<Met> met_nodes() const
    {
        std::vector<Met> met(node_.size());
        parallel_for_each(count(met), [&](std::ptrdiff_t k) {
            met[k].record = nodes_[node_[k]];
            met[k].number = static_cast<int>(k);
        });
        s_.field.constraints.for_each([&](std::ptrdiff_t node, int a, bool) {
            if (const int k = s_.contacts.number[node] - 1; k >= 0) met[k].is_held[a] = true;
        });
        if (s_.ranks->is_alone()) return met;
        std::vector<Met> mine;
        for (const Met& one : met)
            if (s_.field.tiles.counts_record(node_[one.number])) mine.push_back(one);
        for (const std::vector<Met>& of_rank : gather_all(*s_.ranks, mine))
            for (const Met& one : of_rank) met[one.number] = one;
        return met;
    }

    /// The values of nodes at the vertices.
    template <class T>
    std::vector<T> at_vertices(const std::vector<T>& of_nodes) const
    {
        std::vector<T> r(row_count_);
        parallel_for_each(count(r), [&](std::ptrdiff_t k) {
            const auto row  = static_cast<std::size_t>(k);
            const int* node = &node_of_row_[row * rows_->size()];
            T sum{};
            for (std::size_t n = 0; n < rows_->size(); ++n) sum += rows_->weight(row, n) * of_nodes[node[n]];
            r[row] = sum;
        });
        return r;
    }
    /// The difference at point q of values at the vertices.
    template <class T>
    T jump_at(std::ptrdiff_t q, const std::vector<T>& at) const
    {
        T sum{};
        for_each_row(q, [&](int row, double weight) { sum += weight * at[row]; });
        return sum;
    }

    /// The relative velocities at the points.
    std::vector<Vec<D>> find_motion() const
    {
        const std::vector<Vec<D>> v = at_vertices(v_);
        std::vector<Vec<D>> u(points_.size());
        parallel_for_each(count(points_), [&](std::ptrdiff_t q) {
            u[q] = jump_at(q, v);
            if (const int k = obstacle_of(points_[q]); k >= 0) u[q] -= velocity_at(s_.contacts.obstacles[k], points_[q].at);
        });
        return u;
    }
    /// The same before the sweeps; and before_, those before the kick.
    std::vector<Vec<D>> find_start()
    {
        const std::vector<Lanes> at = at_vertices(records_);
        std::vector<Vec<D>> u(points_.size());
        before_.resize(points_.size());
        parallel_for_each(count(points_), [&](std::ptrdiff_t q) {
            const Lanes both = jump_at(q, at);
            u[q]             = velocity_of<D>(both);
            before_[q]       = u[q];
            for (int a = 0; a < D; ++a) before_[q][a] -= both[NodeLane::increment + a];
            if (const int k = obstacle_of(points_[q]); k >= 0) {
                u[q] -= velocity_at(s_.contacts.obstacles[k], points_[q].at);
                before_[q] -= velocity_at(motions_before_[k], points_[q].at);
            }
        });
        return u;
    }

    /// The inverse inertias of the obstacles that forces move, and how much they yield at the points.
    void find_yields()
    {
        inertias_.resize(model_.obstacles.size());
        for (std::size_t k = 0; k < inertias_.size(); ++k)
            inertias_[k] = {model_.obstacles[k].is_moved(), inverse_inertia(model_.obstacles[k], s_.contacts.obstacles[k])};
        yields_.resize(points_.size());
        parallel_for_each(count(points_), [&](std::ptrdiff_t q) {
            const int k = obstacle_of(points_[q]);
            yields_[q]  = k >= 0 && inertias_[k].is_moved ? yield_of(points_[q], k) : Yield{};
        });
    }

    /// At a point q of an obstacle an impulse along e at q' gives the velocity e.(M^-1 e') + (r x e).J^-1 (r' x e') along e, which
    /// is at most the sum of two products of root(e.M^-1 e) and root((r x e).J^-1 (r x e)) at q and q'.
    struct Yield {
        double pushed = 0.0, turned = 0.0;              ///< along the normal
        double pushed_along = 0.0, turned_along = 0.0;  ///< along tangents: at least the largest
    };
    Yield yield_of(const ContactPoint<D>& point, int k) const
    {
        const Vec<3> r = padded(point.at - s_.contacts.obstacles[k].center), n = padded(point.normal);
        auto turned = [&](const Vec<3>& e) { return dot(cross(r, e), inertias_[k].inverse * cross(r, e)); };
        Yield y;
        double most = 0.0, all = 0.0;
        for (int a = 0; a < D; ++a) {
            const double yields = model_.obstacles[k].inverse_mass[a];
            y.pushed += yields * n[a] * n[a];
            most = std::max(most, yields);
            Vec<3> axis{};
            axis[a] = 1.0;
            all += turned(axis);
        }
        const double across = turned(n);
        y.turned_along      = std::sqrt(std::max(0.0, all - across));
        y.turned            = std::sqrt(across);
        y.pushed            = std::sqrt(y.pushed);
        y.pushed_along      = std::sqrt(most);
        return y;
    }

    /// The velocity that the gap asks for along the normal, or the anchor of a tied point, m/s.
    double wanted_across(const ContactPoint<D>& point) const
    {
        if (point.is_tied) return kAnchor * rate(point) * dot(point.anchor, point.normal);
        if (point.gap > 0 && !point.has_pressed) return point.gap / dt_;
        return (point.gap > 0 ? kClose : kPushOut) * rate(point) * point.gap;
    }
    /// The velocity that the anchor asks for along the face, m/s.
    Vec<D> wanted_along(const ContactPoint<D>& point) const
    {
        return kAnchor * rate(point) * (point.anchor - dot(point.anchor, point.normal) * point.normal);
    }
    /// c/h
    double rate(const ContactPoint<D>& point) const
    {
        return pair_of(point).wave_speed / *std::min_element(model_.h.c, model_.h.c + D);
    }
    bool is_active(const ContactPoint<D>& point, const Vec<D>& u) const
    {
        return point.is_tied || point.p > 0 || dot(u, point.normal) + wanted_across(point) < 0;
    }

    /// The rows' sums D of the points.
    void find_resistance(const std::vector<Vec<D>>& u)
    {
        std::vector<double> areas(points_.size()), of_vertices, of_nodes;
        parallel_for_each(count(points_),
                          [&](std::ptrdiff_t q) { areas[q] = is_active(points_[q], u[q]) ? points_[q].area : 0.0; });
        points_of_->sum_of_sizes(areas, of_vertices);
        rows_of_->sum(of_vertices, of_nodes);
        std::vector<Vec<D>> response(node_.size());
        parallel_for_each(count(node_), [&](std::ptrdiff_t k) { response[k] = of_nodes[k] * inverse_mass_[k]; });
        const std::vector<Vec<D>> at = at_vertices(response);
        resistance_.resize(points_.size());
        parallel_for_each(count(points_), [&](std::ptrdiff_t q) {
            const Vec<D>& n = points_[q].normal;
            Vec<D> d{};
            for_each_row(q, [&](int row, double weight) { d += std::fabs(weight) * at[row]; });
            double across = 0.0;
            for (int a = 0; a < D; ++a) across += n[a] * n[a] * d[a];
            resistance_[q] = {across, largest_along(n, d, across)};
        });
        add_resistance_of_obstacles(areas);
    }

    /// Adds what moved obstacles resist. Along normals and tangents either is an upper bound of its part of the operator, and
    /// twice both of the whole, so that sweeps do not diverge.
    void add_resistance_of_obstacles(const std::vector<double>& areas)
    {
        std::vector<Yield> sum(inertias_.size());
        for (std::size_t q = 0; q < points_.size(); ++q) {
            const int k = obstacle_of(points_[q]);
            if (k < 0 || !inertias_[k].is_moved) continue;
            sum[k].pushed += areas[q] * yields_[q].pushed;
            sum[k].turned += areas[q] * yields_[q].turned;
            sum[k].pushed_along += areas[q] * yields_[q].pushed_along;
            sum[k].turned_along += areas[q] * yields_[q].turned_along;
        }
        for (std::size_t q = 0; q < points_.size(); ++q) {
            const int k = obstacle_of(points_[q]);
            if (k < 0 || !inertias_[k].is_moved) continue;
            const Yield& y = yields_[q];
            resistance_[q].across += y.pushed * sum[k].pushed + y.turned * sum[k].turned;
            resistance_[q].along += y.pushed_along * sum[k].pushed_along + y.turned_along * sum[k].turned_along;
        }
    }

    /// The largest D along a tangent: they differ where conditions hold some components of nodes, and the mean would correct too much
    /// along one. In 3D by the invariants of diag(D) between tangents.
    static double largest_along(const Vec<D>& n, const Vec<D>& d, double across)
    {
        double sum = -across;
        for (int a = 0; a < D; ++a) sum += d[a];
        if (D == 2 || (d[0] == d[1] && d[1] == d[D - 1])) return sum / (D - 1);
        double squares = 0.0;
        for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) {
                const double tangent = (a == b ? 1.0 : 0.0) - n[a] * n[b];
                squares += d[a] * d[b] * tangent * tangent;
            }
        return 0.5 * (sum + std::sqrt(std::max(0.0, 2 * squares - sum * sum)));
    }
    /// Changes the impulse of point q in a sweep. Returns the change of the impulse, N s.
    Vec<D> correct(std::ptrdiff_t q, const Vec<D>& u)
    {
        ContactPoint<D>& point     = points_[q];
        const ContactPair<D>& pair = pair_of(point);
        const Resistance& d        = resistance_[q];
        const Vec<D>& n            = point.normal;
        const double u_n = dot(u, n), p = point.p;
        const Vec<D> u_t = u - u_n * n, t = point.t;
        if (d.acts_across()) {
            point.p = p - (u_n + wanted_across(point)) / d.across;
            if (!point.is_tied) point.p = std::max(0.0, point.p);
        }
        const bool grips = point.is_tied || pair.type == ContactType::no_slip || pair.type == ContactType::tied;
        point.sticks     = point.is_tied || (point.p > 0 && pair.type != ContactType::frictionless);
        if (point.sticks && d.acts_along()) {
            point.t -= (1 / d.along) * (u_t + wanted_along(point));
            const double limit = pair.friction * point.p + dt_kick_ * pair.adhesion, size = norm(point.t);
            if (!grips && size > limit) {
                point.t *= limit / size;
                point.sticks = false;
            }
        }
        if (!(point.p > 0) && !point.is_tied) point.t = {};
        return point.area * ((point.p - p) * n + (point.t - t));
    }

    /// Adds changes of impulses to nodes.
    void add(const std::vector<Vec<D>>& change)
    {
        std::vector<Vec<D>> of_vertices, of_nodes;
        points_of_->sum(change, of_vertices);
        rows_of_->sum(of_vertices, of_nodes);
        parallel_for_each(count(node_), [&](std::ptrdiff_t k) {
            impulse_[k] += of_nodes[k];
            for (int a = 0; a < D; ++a) v_[k][a] += inverse_mass_[k][a] * of_nodes[k][a];
        });
        push_obstacles(change);
    }

    /// Adds the reactions to the obstacles that they move.
    void push_obstacles(const std::vector<Vec<D>>& change)
    {
        std::vector<Vec<D>> impulse(inertias_.size(), Vec<D>{});
        std::vector<Vec<3>> moment(inertias_.size(), Vec<3>{});
        for (std::size_t q = 0; q < points_.size(); ++q) {
            const int k = obstacle_of(points_[q]);
            if (k < 0 || !inertias_[k].is_moved) continue;
            impulse[k] -= change[q];
            moment[k] -= cross(padded(points_[q].at - s_.contacts.obstacles[k].center), padded(change[q]));
        }
        for (std::size_t k = 0; k < inertias_.size(); ++k) {
            ObstacleMotion<D>& motion = s_.contacts.obstacles[k];
            for (int a = 0; a < D; ++a) motion.velocity[a] += model_.obstacles[k].inverse_mass[a] * impulse[k][a];
            motion.spin += inertias_[k].inverse * moment[k];
        }
    }

    /// The anchor after the step, in which the point moves with u.
    void follow(ContactPoint<D>& point, const Vec<D>& u) const
    {
        point.slip = u - dot(u, point.normal) * point.normal;
        if (point.is_tied)
            point.anchor += dt_ * u;
        else if (point.sticks)
            point.anchor += dt_ * point.slip;
        else
            point.anchor = {};
    }

    /// Adds forces and work to the account of the contacts. Impulses work on the mean of the velocities before the kick and after
    /// contact, like the forces that act in the same step: on bodies at rest they take nothing, though they undo a kick.
    void report() const
    {
        s_.contacts.clear_forces();
        for (std::size_t q = 0; q < points_.size(); ++q) {
            const ContactPoint<D>& point = points_[q];
            const int k                  = obstacle_of(point);
            ContactExchange& to          = k < 0 ? s_.contacts.pairs[point.key.pair] : s_.contacts.obstacles[k].exchange;
            const Vec<D> mean = 0.5 * (before_[q] + after_[q]), impulse = point.area * (point.p * point.normal + point.t);
            const Vec<3> force = ((k < 0 && point.key.side == 0 ? 1.0 : -1.0) / dt_kick_) * padded(impulse);
            to.force += force;
            if (k < 0) {
                to.moment += cross(padded(point.x), force);
            } else {
                ObstacleMotion<D>& motion = s_.contacts.obstacles[k];
                to.moment += cross(padded(point.at - motion.center), force);
                motion.work -= 0.5 * dot(impulse, velocity_at(motions_before_[k], point.at) + velocity_at(motion, point.at));
            }
            to.dissipated -= point.area * point.p * dot(point.normal, mean);
            to.friction -= point.area * dot(point.t, mean);
        }
    }

    /// Of an obstacle.
    struct Inertia {
        bool is_moved = false;
        Mat<3> inverse{};  ///< 1/(kg m^2)
    };
    /// A row sum, along the normal and at most along a tangent, m^(D-1)/kg.
    struct Resistance {
        double across = 0.0, along = 0.0;
        /// Where neither the other nor rounding is all there is.
        bool acts_across() const { return across > 1e-9 * (across + (D - 1) * along); }
        bool acts_along() const { return along > 1e-9 * (across + (D - 1) * along); }
    };

    const Model<D>& model_;
    State<D>& s_;
    Lanes* nodes_;
    double dt_, dt_kick_;
    std::vector<ContactPoint<D>> points_;
    struct RowOfPoint {
        int row;
        double weight;
    };
    std::vector<int> first_row_;  ///< of each point, and the end of the last
    std::vector<RowOfPoint> rows_of_points_;
    std::size_t row_count_ = 0;
    std::optional<VertexRows<D>> rows_;
    std::vector<int> node_of_row_;      ///< their nodes, numbers in node_
    std::optional<Columns> points_of_;  ///< by vertices
    std::optional<Columns> rows_of_;    ///< by nodes
    std::vector<std::ptrdiff_t> node_;  ///< records of the nodes
    std::vector<Lanes> records_;        ///< of the nodes, after the kick
    std::vector<Vec<D>> v_, inverse_mass_, impulse_;
    std::vector<Vec<D>> before_, after_;  ///< at the points
    std::vector<Resistance> resistance_;  ///< likewise
    std::vector<Inertia> inertias_;
    std::vector<Yield> yields_;  ///< at the points
    std::vector<ObstacleMotion<D>> motions_before_;
};

}  // namespace

template <int D>
void meet(const Model<D>& model, State<D>& s, Lanes* nodes, const Moment& when, double dt, const ExchangeSums<D>& sums)
{
    std::vector<ObstacleMotion<D>> before = s.contacts.obstacles;
    kick(model.obstacles, s.contacts.obstacles, model.gravity, when.t, dt);
    Meeting<D> meeting(model, s, nodes, when.dt, dt, std::move(before));
    if (!meeting.find()) {
        s.contacts.points.clear();
        s.contacts.clear_forces();
        return;
    }
    meeting.solve();
    meeting.finish(when, sums);
}

template void meet(const Model<2>&, State<2>&, Lanes*, const Moment&, double, const ExchangeSums<2>&);
template void meet(const Model<3>&, State<3>&, Lanes*, const Moment&, double, const ExchangeSums<3>&);

}  // namespace ordo
