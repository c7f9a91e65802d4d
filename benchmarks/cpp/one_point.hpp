// The exact solution of one contact, and the rolling moment: rpf3d_core/body/{one_point,rolling_limit}.py.
#pragma once
#include "body_contacts.hpp"

constexpr int CONE_STEPS = 60, ROLLING_STEPS = 40;
constexpr double CLOSE = 1e-15, NEARLY = 1e-9;

inline double root_before(const Row& row, double first, double second) {
    double t = row.local.y, s = row.local.z;
    double p = -(row.cos * t + row.sin * s), q = row.sin * t - row.cos * s;
    if (std::fabs(p) >= std::fabs(q)) return p != 0.0 && first / p != row.half ? 1.0 / (first / p - row.half) : 0.0;
    return second / q != -row.half ? 1.0 / (second / q + row.half) : 0.0;
}

// The impulse (normal, two tangents) after which a contact with the velocity u does not approach.
inline Vec one_point(const Row& row, Vec u, double mu) {
    if (u.x >= 0.0) return {0.0, 0.0, 0.0};
    if (mu == 0.0) return {-u.x / row.nn, 0.0, 0.0};
    const double nn = row.nn, half = row.half, cos = row.cos, sin = row.sin, a = row.a, b = row.b;
    double first = cos * u.y + sin * u.z - a * u.x / nn, second = cos * u.z - sin * u.y - b * u.x / nn;
    double low = 0.0, high = 1.0 / row.mean, x = high;
    double p = first / (row.mean + half), q = second / (row.mean - half), normal = 0.0;
    bool last = false;
    for (int step = 0; step < CONE_STEPS; ++step) {
        normal = (a * p + b * q - u.x) / nn;
        double size = std::sqrt(p * p + q * q), excess = size - mu * normal;
        if (last || (step == 0 && excess <= 0.0)) break;
        if (std::fabs(excess) <= CLOSE * size || high - low <= CLOSE * high) break;
        (excess > 0.0 ? high : low) = x;
        double guess = step == 0 ? root_before(row, first, second) : 0.0;
        if (0.0 < guess && guess < high) {
            x = guess;
        } else {
            double up = 1.0 + half * x, down = 1.0 - half * x;
            double dp = first / (up * up), dq = second / (down * down);
            double slope = (p * dp + q * dq) / size - mu * (a * dp + b * dq) / nn;
            x = slope != 0.0 ? x - excess / slope : low;
            last = std::fabs(excess) <= NEARLY * size;
        }
        if (!(low < x && x < high)) {
            x = 0.5 * (low + high);
            last = false;
        }
        p = first * x / (1.0 + half * x), q = second * x / (1.0 - half * x);
    }
    return {normal, -(cos * p - sin * q), -(sin * p + cos * q)};
}

// The angular impulse of rolling resistance on a body with the spin w; `limit` is its largest length.
inline Vec rolling_impulse(Vec w, Vec moments, double limit) {
    if (!(limit > 0.0)) return {0.0, 0.0, 0.0};
    Vec full = times(moments, w), parts = full;
    double k = 0.0;
    for (int step = 0; step < ROLLING_STEPS; ++step) {
        double squared = dot(parts, parts), size = std::sqrt(squared);
        if (size <= limit * (1.0 + CLOSE)) break;
        Vec d = {1.0 + k * moments.x, 1.0 + k * moments.y, 1.0 + k * moments.z};
        Vec falls = over(times(times(parts, parts), moments), d);
        double further = (size - limit) / limit * squared / (falls.x + falls.y + falls.z);
        if (!(further > CLOSE * k)) break;
        k += further;
        parts = over(full, {1.0 + k * moments.x, 1.0 + k * moments.y, 1.0 + k * moments.z});
    }
    return {-parts.x, -parts.y, -parts.z};
}
