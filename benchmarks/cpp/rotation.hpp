// Torque-free rotation of a rigid body in closed form: rpf3d_core/body/rotation.py, in the same order.
#pragma once
#include "cycle.hpp"

constexpr double FARTHEST = 40.0;

struct Turning {
    Quaternion q;
    Vec w;
    double fastest;
    Axes axes;
    Cycle cycle;
    Quaternion start;
};

struct Placed {
    Quaternion turn;
    Vec spin;
};

// (cos, sin) of half the angle atan2(y, x), or both with the opposite sign.
INLINED Pair half_of(double x, double y) {
    double length = std::sqrt(x * x + y * y), k = std::sqrt(0.5 * (1.0 + std::fabs(x) / length));
    double j = 0.5 * y / (length * k);
    return x >= 0.0 ? Pair{k, j} : Pair{j, k};
}

INLINED Quaternion nutation(Vec moments, Vec w) {
    Vec M = {moments.x * w.x, moments.y * w.y, moments.z * w.z};
    Pair a = half_of(M.z, M.y), b = half_of(std::sqrt(M.y * M.y + M.z * M.z), -M.x);
    return {b.s * a.s, b.s * a.c, b.c * a.s, -b.c * a.c};
}

// The turn from the relabelled axes to axes fixed in space, and the spin, after t seconds.
INLINED Placed placed(const Axes& axes, const Cycle& cycle, double t) {
    double x = cycle.rate * t + cycle.start, half_angle = 0.5 * cycle.precession * t, sign = 1.0;
    double real, imaginary, k, c;
    const Phase& f = cycle.phase;
    const Nome& q = cycle.nome;
    Waves waves;
    if (cycle.kind == CIRCULAR) {
        waves = circular(x);
        real = combined(f.first, waves.sines), imaginary = combined(f.second, waves.cosines);
        k = 1.0 / theta_4(waves.even, q.even);
        c = plain(waves.cosines, q.odd);
    } else {
        int64_t periods = int64_t(std::floor(0.5 * (x / cycle.half_period + 1.0)));
        double n = double(periods);
        half_angle += 0.5 * n * cycle.per_period;
        sign = periods % 2 != 0 ? -1.0 : 1.0;
        waves = hyperbolic(most(-FARTHEST, least(FARTHEST, x - 2.0 * n * cycle.half_period)));
        real = sign * combined(f.first, waves.cosines), imaginary = sign * combined(f.second, waves.sines);
        k = 1.0 / plain(waves.cosines, q.odd);
        c = theta_4(waves.even, q.even);
    }
    double s = alternating(waves.sines, q.odd);
    Vec A = cycle.amplitudes;
    Vec w = {sign * A.x * c * k, sign * A.y * s * k, A.z * theta_3(waves.even, q.even) * k};
    Pair a = half_of(real, cycle.sense * imaginary);
    double cos = std::cos(half_angle), sin = std::sin(half_angle);
    Quaternion precession = {cos * a.s - sin * a.c, 0.0, 0.0, sin * a.s + cos * a.c};
    return {multiply(precession, nutation(axes.moments, w)), w};
}

INLINED Turning turning_of(Vec moments, Quaternion q, Vec w) {
    double energy = moments.x * w.x * w.x + moments.y * w.y * w.y + moments.z * w.z * w.z;
    double L = norm({moments.x * w.x, moments.y * w.y, moments.z * w.z}), fastest = std::sqrt(energy / moments.x);
    double excess = beyond_separatrix(moments, w);
    Turning turning = {q, w, fastest, axes_of(moments, w, excess < 0.0), {}, q};
    if (is_steady(moments, w)) return turning;
    const Axes& axes = turning.axes;
    turning.cycle = cycle_of(axes, relabelled(axes, w), std::fabs(excess), energy, L);
    turning.start = multiply(q, inverse(multiply(placed(axes, turning.cycle, 0.0).turn, axes.turn)));
    return turning;
}

// The orientation and the spin, in the body's axes, after t seconds.
INLINED Placed turned_for(const Turning& turning, double t) {
    Vec w = turning.w;
    if (t == 0.0) return {turning.q, w};
    if (turning.cycle.kind == STEADY) return {normalised(multiply(turning.q, turn_by(scale(t, w)))), w};
    const Axes& axes = turning.axes;
    Placed now = placed(axes, turning.cycle, t);
    return {normalised(multiply(turning.start, multiply(now.turn, axes.turn))), labelled_back(axes, now.spin)};
}
