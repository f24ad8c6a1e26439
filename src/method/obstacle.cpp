#include "method/obstacle.hpp"

#include "base/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ordo {

namespace {

using Quaternion = std::array<double, 4>;

Quaternion product(const Quaternion& a, const Quaternion& b)
{
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// The rotation by a vector, radians.
Quaternion turn_by(const Vec<3>& angle)
{
    const double size = norm(angle);
    if (!(size > 0)) return {1, 0, 0, 0};
    const double part = std::sin(size / 2) / size;
    return {std::cos(size / 2), part * angle[0], part * angle[1], part * angle[2]};
}

Vec<3> evaluate(const std::array<Field, 3>& f, double t)
{
    Vec<3> r{};
    for (int a = 0; a < 3; ++a) r[a] = f[static_cast<std::size_t>(a)]({{}, {}, t});
    return r;
}

}  // namespace

Mat<3> rotation_of(const Quaternion& q)
{
    const auto [w, x, y, z] = q;
    Mat<3> r{};
    r(0, 0) = 1 - 2 * (y * y + z * z);
    r(0, 1) = 2 * (x * y - w * z);
    r(0, 2) = 2 * (x * z + w * y);
    r(1, 0) = 2 * (x * y + w * z);
    r(1, 1) = 1 - 2 * (x * x + z * z);
    r(1, 2) = 2 * (y * z - w * x);
    r(2, 0) = 2 * (x * z - w * y);
    r(2, 1) = 2 * (y * z + w * x);
    r(2, 2) = 1 - 2 * (x * x + y * y);
    return r;
}

template <int D>
ObstacleMotion<D> start_of(const Obstacle<D>& obstacle, double t)
{
    ObstacleMotion<D> r;
    r.center   = obstacle.center;
    r.velocity = evaluate<D>(obstacle.velocity, {{}, {}, t});
    r.spin     = evaluate(obstacle.spin, t);
    return r;
}

template <int D>
Vec<D> velocity_at(const ObstacleMotion<D>& motion, const Vec<D>& x)
{
    return motion.velocity + first_components<D>(cross(motion.spin, padded(x - motion.center)));
}

template <int D>
Vec<D> displacement_at(const ObstacleMotion<D>& motion, const Vec<D>& x, double dt)
{
    const Mat<3> turned = rotation_of(turn_by(dt * motion.spin)) - Mat<3>::identity();
    return dt * motion.velocity + first_components<D>(turned * padded(x - motion.center));
}

template <int D>
std::optional<Clearance<D>> clearance(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion, const Vec<D>& x,
                                      const Vec<D>* n, double reach)
{
    if (motion.turn == Quaternion{1, 0, 0, 0})
        return clearance(obstacle.solid, Vec<D>(x - motion.center + obstacle.center), n, reach);
    const Mat<3> now = rotation_of(motion.turn), back = transpose(now);
    const Vec<D> at  = obstacle.center + first_components<D>(back * padded(x - motion.center));
    const Vec<D> own = n ? first_components<D>(back * padded(*n)) : Vec<D>{};
    auto r           = clearance(obstacle.solid, at, n ? &own : nullptr, reach);
    if (r) r->normal = first_components<D>(now * padded(r->normal));
    return r;
}

template <int D>
Mat<3> inverse_inertia(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion)
{
    const Mat<3> now = rotation_of(motion.turn);
    return now * obstacle.inverse_inertia * transpose(now);
}

template <int D>
Bounds<D> bounds_of(const Obstacle<D>& obstacle, const ObstacleMotion<D>& motion)
{
    const Bounds<D> start = bounds_of(obstacle.solid);
    if (std::holds_alternative<HalfSpace<D>>(obstacle.solid)) return start;
    const Mat<3> now    = rotation_of(motion.turn);
    const Vec<D> half   = 0.5 * (start.upper - start.lower),
                 middle = motion.center + first_components<D>(now * padded(0.5 * (start.lower + start.upper) - obstacle.center));
    Vec<D> size{};
    for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) size[a] += std::fabs(now(a, b)) * half[b];
    return {middle - size, middle + size};
}

template <int D>
void kick(const std::vector<Obstacle<D>>& obstacles, std::vector<ObstacleMotion<D>>& motions, const Vec<D>& gravity, double t,
          double dt)
{
    for (std::size_t k = 0; k < obstacles.size(); ++k) {
        const Obstacle<D>& o       = obstacles[k];
        ObstacleMotion<D>& motion  = motions[k];
        const ObstacleMotion<D> is = start_of(o, t);
        for (int a = 0; a < D; ++a) motion.velocity[a] = o.is_free(a) ? motion.velocity[a] + dt * gravity[a] : is.velocity[a];
        if (!o.turns_freely()) motion.spin = is.spin;
        if (!std::isfinite(norm(motion.velocity) + norm(motion.spin)))
            throw NumericalError(
                fmt::format("t = {:.6g} s: the velocity or rotation of obstacle \"{}\" is not a finite number", t, o.name));
    }
}

template <int D>
void move(const std::vector<Obstacle<D>>& obstacles, const std::vector<ContactPair<D>>& pairs, double dt, Contacts<D>& contacts)
{
    std::vector<Mat<3>> turned(obstacles.size());
    for (std::size_t k = 0; k < obstacles.size(); ++k) {
        ObstacleMotion<D>& motion = contacts.obstacles[k];
        const Obstacle<D>& o      = obstacles[k];
        const Vec<3> spin         = motion.spin;
        const Quaternion by       = turn_by(dt * spin);
        turned[k]                 = rotation_of(by);
        motion.center += dt * motion.velocity;
        if (spin == Vec<3>{}) continue;
        const Mat<3> before = inverse_inertia(o, motion);
        motion.turn         = product(by, motion.turn);
        double size         = 0.0;
        for (const double q : motion.turn) size += q * q;
        for (double& q : motion.turn) q /= std::sqrt(size);
        if (D == 3 && o.turns_freely()) motion.spin = inverse_inertia(o, motion) * (inverse(before) * spin);
    }
    for (ContactPoint<D>& point : contacts.points) {
        const int k = pairs[point.key.pair].obstacle;
        if (k < 0) continue;
        for (Vec<D>* v : {&point.normal, &point.anchor, &point.t}) *v = first_components<D>(turned[k] * padded(*v));
    }
}

#define ORDO_OBSTACLE(D)                                                                                                       \
    template ObstacleMotion<D> start_of(const Obstacle<D>&, double);                                                           \
    template Vec<D> velocity_at(const ObstacleMotion<D>&, const Vec<D>&);                                                      \
    template Vec<D> displacement_at(const ObstacleMotion<D>&, const Vec<D>&, double);                                          \
    template std::optional<Clearance<D>> clearance(const Obstacle<D>&, const ObstacleMotion<D>&, const Vec<D>&, const Vec<D>*, \
                                                   double);                                                                    \
    template Mat<3> inverse_inertia(const Obstacle<D>&, const ObstacleMotion<D>&);                                             \
    template Bounds<D> bounds_of(const Obstacle<D>&, const ObstacleMotion<D>&);                                                \
    template void kick(const std::vector<Obstacle<D>>&, std::vector<ObstacleMotion<D>>&, const Vec<D>&, double, double);       \
    template void move(const std::vector<Obstacle<D>>&, const std::vector<ContactPair<D>>&, double, Contacts<D>&);
ORDO_OBSTACLE(1)
ORDO_OBSTACLE(2)
ORDO_OBSTACLE(3)
#undef ORDO_OBSTACLE

}  // namespace ordo
