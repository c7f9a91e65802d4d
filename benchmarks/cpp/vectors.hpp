// Three-vectors and the parabola of free flight: rpf3d_core/vectors.py, rpf3d_core/arc.py, in the same order.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>

// For functions that are faster when copied into their callers, which g++ would not do by itself.
#define INLINED __attribute__((always_inline)) inline

constexpr double INF = std::numeric_limits<double>::infinity();

struct Vec {
    double x, y, z;
};

inline Vec add(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec subtract(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec scale(double k, Vec a) { return {k * a.x, k * a.y, k * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double norm(Vec a) { return std::sqrt(dot(a, a)); }
inline Vec without(Vec a, Vec n) { return subtract(a, scale(dot(a, n), n)); }

// Python's min and max: the first argument if the two are equal.
inline double least(double a, double b) { return b < a ? b : a; }
inline double most(double a, double b) { return b > a ? b : a; }
inline double least(double a, double b, double c) { return least(least(a, b), c); }
inline double most(double a, double b, double c) { return most(most(a, b), c); }

inline Vec along(Vec a, Vec n) {
    const double noise = 1e-12;
    Vec part = without(a, n);
    return dot(part, part) > noise * noise * dot(a, a) ? part : Vec{0.0, 0.0, 0.0};
}

struct Motion {
    double t;
    Vec x, v;
};

struct Arc {
    Vec x, v;
    double gravity;
};

inline Vec position(const Arc& arc, double t) {
    return {arc.x.x + arc.v.x * t, arc.x.y + arc.v.y * t, arc.x.z + (arc.v.z - 0.5 * arc.gravity * t) * t};
}

inline Motion advance(const Motion& motion, double gravity, double t) {
    return {motion.t + t, position({motion.x, motion.v, gravity}, t), {motion.v.x, motion.v.y, motion.v.z - gravity * t}};
}

inline double length_term(double h, double u) {
    double speed = std::sqrt(h + u * u);
    if (h <= 0.0) return 0.5 * u * speed;
    double rise = std::log((std::fabs(u) + speed) / std::sqrt(h));
    return 0.5 * (u * speed + h * std::copysign(rise, u));
}

inline double arc_length(const Arc& arc, double t) {
    double horizontal = arc.v.x * arc.v.x + arc.v.y * arc.v.y;
    double end = arc.v.z - arc.gravity * t;
    return (length_term(horizontal, arc.v.z) - length_term(horizontal, end)) / arc.gravity;
}

inline Vec gravity_along(Vec n, double gravity) {
    return {gravity * n.z * n.x, gravity * n.z * n.y, -gravity * (n.x * n.x + n.y * n.y)};
}

inline double fall_time(double z_speed, double height, double gravity) {
    double root = std::sqrt(z_speed * z_speed + 2.0 * gravity * height);
    if (z_speed > 0.0) return (z_speed + root) / gravity;
    return height > 0.0 ? 2.0 * height / (root - z_speed) : 0.0;
}
