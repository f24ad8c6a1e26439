#include "implicit/obstacle_forces.hpp"

#include "method/contact_points.hpp"
#include "method/obstacle.hpp"
#include "method/vertex_rows.hpp"
#include "shape/curved_face.hpp"

#include <algorithm>
#include <cmath>

namespace ordo {

template <int D>
ObstacleForces<D>::ObstacleForces(const Model<D>& model, State<D>& s, const NodeRows<D>& rows, double dt, double stiffness)
    : ObstacleForces(model, s, rows, dt, stiffness, contact_reach(model, s))
{}

template <int D>
ObstacleForces<D>::ObstacleForces(const Model<D>& model, State<D>& s, const NodeRows<D>& rows, double dt, double stiffness,
                                  double reach)
    : model_(model), s_(s), rows_(rows), dt_(dt), reach_(reach), first_{0}
{
    if constexpr (D > 1) {
        if (model.obstacles.empty()) return;
        kick(model.obstacles, s.contacts.obstacles, model.gravity, s.t + 0.5 * dt, dt);
        const double h = *std::min_element(model.h.c, model.h.c + D);
        touching_      = 1e-9 * h;
        std::vector<double> modulus;  // of each body
        for (int i = 0; i < s.particles.count; ++i) {
            const auto body = static_cast<std::size_t>(s.particles.body[i]);
            if (body >= modulus.size()) modulus.resize(body + 1, 0.0);
            modulus[body] = std::max(modulus[body], model.materials[s.particles.material[i]].p_wave_modulus());
        }
        std::vector<std::vector<Vec<D>>> vertices;
        for (const ContactSurface<D>& surface : model.surfaces) vertices.push_back(vertices_of(surface, model, s));
        points_ = find_contact_points(model, s, vertices, dt, reach);
        VertexRows<D> one(s, 1);
        auto add_weights = [&](const Vec<D>& x, double part) {
            one.set(0, x, 0);
            for (std::size_t n = 0; n < one.size(); ++n)
                if (const int row = rows.row(one.node(0, n)); row > 0 && one.weight(0, n) != 0.0)
                    weights_.push_back({row, part * one.weight(0, n)});
        };
        for (const ContactPoint<D>& point : points_) {
            const int surface = pair_of(point).surface[point.key.side];
            if (surface < 0) {
                add_weights(point.x, 1.0);
            } else if (pair_of(point).on_faces) {
                const Outline<D>& outline  = model.surfaces[surface].outline;
                const FacePoint<D>& inside = face_points<D>(outline.faces[point.key.of].count)[point.key.ordinal];
                for (int c = 0; c < outline.faces[point.key.of].count; ++c)
                    add_weights(vertices[surface][outline.vertices[point.key.of][c]], inside.weight[c]);
            } else {
                add_weights(vertices[surface][point.key.of], 1.0);
            }
            first_.push_back(static_cast<int>(weights_.size()));
            k_.push_back(stiffness / h * modulus[static_cast<std::size_t>(pair_of(point).body)]);
            obstacle_moves_.push_back(motion_of_obstacle(point));
        }
        moved_.resize(points_.size());
        traction_.resize(points_.size());
        stiffness_.resize(points_.size());
    }
}

template <int D>
Vec<D> ObstacleForces<D>::motion_of(std::size_t q, std::span<const double> u) const
{
    Vec<D> r{};
    for (int i = first_[q]; i < first_[q + 1]; ++i)
        for (int a = 0; a < D; ++a) r[a] += weights_[i].value * u[D * (weights_[i].row - 1) + a];
    return r;
}

template <int D>
Vec<D> ObstacleForces<D>::motion_of_obstacle(const ContactPoint<D>& point) const
{
    const ObstacleMotion<D>& motion = s_.contacts.obstacles[pair_of(point).obstacle];
    const Vec<D> way = displacement_at(motion, point.at, dt_), by_velocity = dt_ * velocity_at(motion, point.at);
    return point.is_tied ? way : way + dot(by_velocity - way, point.normal) * point.normal;
}

/// The anchor is the slip since a point sticks, of tied points all of their motion.
template <int D>
auto ObstacleForces<D>::response_to(std::size_t q, const Vec<D>& d) const -> Response
{
    const ContactPoint<D>& point = points_[q];
    const ContactPair<D>& pair   = pair_of(point);
    const Vec<D>& n              = point.normal;
    const double k               = k_[q];
    const Mat<D> across = outer(n, n), along = Mat<D>::identity() - across;
    const double open = point.is_tied ? dot(point.anchor + d, n) : point.gap + dot(d, n), p = -k * open;
    const bool presses = point.is_tied || open <= touching_;  // a body that only lies there at first is held too
    if (!presses) return {};
    if (pair.type == ContactType::frictionless && !point.is_tied) return {p * n, k * across};
    Vec<D> t           = -k * (along * (point.anchor + d));
    Mat<D> K           = k * across;
    const double limit = pair.friction * std::max(p, 0.0) + pair.adhesion, size = norm(t);
    const bool grips = point.is_tied || pair.type == ContactType::no_slip || pair.type == ContactType::tied;
    if (grips || size <= limit) {
        K += k * along;
    } else {
        const Vec<D> way = (1 / size) * t;
        t                = limit * way;
        K += (k * limit / size) * (along - outer(way, way)) + pair.friction * k * outer(way, n);
    }
    return {p * n + t, K};
}

template <int D>
void ObstacleForces<D>::add(std::size_t q, const Vec<D>& force, std::span<double> r) const
{
    for (int i = first_[q]; i < first_[q + 1]; ++i)
        for (int a = 0; a < D; ++a) r[D * (weights_[i].row - 1) + a] += weights_[i].value * force[a];
}

template <int D>
void ObstacleForces<D>::add_forces(std::span<const double> u, std::span<double> r)
{
    for (std::size_t q = 0; q < points_.size(); ++q) {
        moved_[q]         = motion_of(q, u) - obstacle_moves_[q];
        const Response of = response_to(q, moved_[q]);
        traction_[q]      = of.traction;
        stiffness_[q]     = points_[q].area * of.stiffness;
        add(q, points_[q].area * traction_[q], r);
    }
}

template <int D>
void ObstacleForces<D>::add_product(double factor, std::span<const double> x, std::span<double> y) const
{
    for (std::size_t q = 0; q < points_.size(); ++q) add(q, -factor * (stiffness_[q] * motion_of(q, x)), y);
}

template <int D>
int ObstacleForces<D>::misses(std::span<const double> u) const
{
    if (model_.obstacles.empty()) return -1;
    double way = 0.0;
    for (std::size_t k = 0; k + D <= u.size(); k += D) {
        Vec<D> of_node;
        for (int a = 0; a < D; ++a) of_node[a] = u[k + a];
        way = std::max(way, norm(of_node));
    }
    if (way <= reach_) return -1;
    const ObstacleForces further(model_, s_, rows_, dt_, 0.0, way);
    for (std::size_t q = 0; q < further.points_.size(); ++q) {
        const ContactPoint<D>& point = further.points_[q];
        const bool is_known =
            std::binary_search(points_.begin(), points_.end(), point, [](const auto& a, const auto& b) { return a.key < b.key; });
        if (!is_known && point.gap + dot(further.motion_of(q, u) - further.obstacle_moves_[q], point.normal) < 0)
            return pair_of(point).obstacle;
    }
    return -1;
}

/// A point that slides keeps the part of its slip that its shear stress holds.
template <int D>
void ObstacleForces<D>::finish()
{
    if constexpr (D > 1) {
        if (model_.obstacles.empty()) return;
        s_.contacts.clear_forces();
        for (std::size_t q = 0; q < points_.size(); ++q) {
            ContactPoint<D>& point    = points_[q];
            ObstacleMotion<D>& motion = s_.contacts.obstacles[pair_of(point).obstacle];
            const Vec<D>& n           = point.normal;
            const double p            = dot(traction_[q], n);
            const Vec<D> t = traction_[q] - p * n, slip = moved_[q] - dot(moved_[q], n) * n, force = point.area * traction_[q];
            motion.exchange.force += padded(-force);
            motion.exchange.moment += cross(padded(point.at - motion.center), padded(-force));
            motion.exchange.dissipated -= point.area * p * dot(moved_[q], n);
            motion.exchange.friction -= point.area * dot(t, slip);
            motion.work -= dot(force, obstacle_moves_[q]);
            point.sticks = p > 0 && norm(t + k_[q] * (point.anchor + slip - dot(point.anchor, n) * n)) <= 1e-9 * norm(t);
            point.slip   = (1 / dt_) * slip;
            if (!point.is_tied) point.anchor = (-1 / k_[q]) * t;
            point.p = dt_ * p;
            point.t = dt_ * t;
        }
        s_.contacts.dt     = dt_;
        s_.contacts.points = std::move(points_);
        move(model_.obstacles, model_.contacts, dt_, s_.contacts);
        for (std::size_t q = 0; q < moved_.size(); ++q)  // at the end of the step, where `move` has turned the anchor
            if (ContactPoint<D>& point = s_.contacts.points[q]; point.is_tied) point.anchor += moved_[q];
    }
}

template class ObstacleForces<1>;
template class ObstacleForces<2>;
template class ObstacleForces<3>;

}  // namespace ordo
