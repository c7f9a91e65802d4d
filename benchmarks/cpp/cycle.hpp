// The cycle of a free rotation, and the digits that its parameter needs: rpf3d_core/body/{theta,rotation}.py.
#pragma once
#include "quaternions.hpp"
#include "theta.hpp"

enum Kind { STEADY, CIRCULAR, HYPERBOLIC };
constexpr double ENDLESS = 1e300;

// The relabelled axes of a body, about the third of which the spin circles.
struct Axes {
    Vec moments;
    bool low;
    double first, third;
    Quaternion turn;
};

struct Cycle {
    Kind kind;
    Vec amplitudes;
    Nome nome;
    double rate, start, half_period;
    Phase phase;
    double sense, precession, per_period;
};

// A number with twice the digits: its rounded value and the rest.
struct Double {
    double value, rest;
};

INLINED Double difference(double a, double b) {
    double s = a - b, z = s - a;
    return {s, (a - (s - z)) - (b + z)};
}

INLINED Double product(double a, double b) {
    const double splitter = 134217729.0;
    double p = a * b, k = splitter * a, j = splitter * b, a1 = k - (k - a), b1 = j - (j - b), a2 = a - a1, b2 = b - b1;
    return {p, ((a1 * b1 - p) + a1 * b2 + a2 * b1) + a2 * b2};
}

INLINED Double term_of(double moment, Double gap, double w) {
    Double s = product(w, w), p = product(moment, s.value), r = product(gap.value, p.value);
    return {r.value, r.rest + (gap.rest * p.value + gap.value * (p.rest + moment * s.rest))};
}

INLINED double beyond_separatrix(Vec moments, Vec w) {
    double a = moments.z - moments.y, c = moments.y - moments.x;
    double rough_x = moments.z * a * w.z * w.z, rough_y = moments.x * c * w.x * w.x;
    if (std::fabs(rough_x - rough_y) > 0.02 * (rough_x + rough_y)) return rough_x - rough_y;
    Double x = term_of(moments.z, difference(moments.z, moments.y), w.z);
    Double y = term_of(moments.x, difference(moments.y, moments.x), w.x);
    return (x.value - y.value) + (x.rest - y.rest);
}

INLINED bool is_steady(Vec moments, Vec w) {
    double top = most(std::fabs(w.x), std::fabs(w.y), std::fabs(w.z));
    double change = std::fabs((moments.z - moments.y) * w.y * w.z) + std::fabs((moments.z - moments.x) * w.z * w.x) +
                    std::fabs((moments.y - moments.x) * w.x * w.y);
    return top < 1e-60 || change <= 1e-120 * moments.z * top * top;
}

INLINED Axes axes_of(Vec moments, Vec w, bool low) {
    const double root = std::sqrt(0.5);
    double first = (low ? w.z : w.x) >= 0.0 ? 1.0 : -1.0, third = (low ? w.x : w.z) >= 0.0 ? 1.0 : -1.0;
    Quaternion turn = {1.0, 0.0, 0.0, 0.0};
    if (first < 0.0) turn = third < 0.0 ? Quaternion{0.0, 0.0, 1.0, 0.0} : Quaternion{0.0, 0.0, 0.0, 1.0};
    else if (third < 0.0) turn = {0.0, 1.0, 0.0, 0.0};
    if (!low) return {moments, low, first, third, turn};
    return {{moments.z, moments.y, moments.x}, low, first, third, multiply(turn, {0.0, root, 0.0, root})};
}

INLINED Vec relabelled(const Axes& axes, Vec w) {
    double f = axes.first, g = axes.third;
    return axes.low ? Vec{f * w.z, -f * g * w.y, g * w.x} : Vec{f * w.x, f * g * w.y, g * w.z};
}

INLINED Vec labelled_back(const Axes& axes, Vec w) {
    double f = axes.first, g = axes.third;
    return axes.low ? Vec{g * w.z, -f * g * w.y, f * w.x} : Vec{f * w.x, f * g * w.y, g * w.z};
}

// The cycle from the excess |L^2 - 2 T I2|, twice the energy, and the angular momentum L.
INLINED Cycle cycle_of(const Axes& axes, Vec w, double excess, double energy, double L) {
    Vec J = axes.moments, ones = {1.0, 1.0, 1.0};
    double gap1 = std::fabs(J.y - J.x), gap3 = std::fabs(J.z - J.y), span = std::fabs(J.z - J.x);
    double x = J.x * span * w.x * w.x, y = J.y * gap3 * w.y * w.y, p = x + y;
    double r = J.y * gap1 * w.y * w.y + J.z * span * w.z * w.z;
    double m = p * gap1 / (r * gap3), m1 = span * excess / (r * gap3), sense = axes.low ? -1.0 : 1.0;
    Vec A = {std::sqrt(p / (J.x * span)), sense * std::sqrt(p / (J.y * gap3)), std::sqrt(r / (J.z * span))};
    double u = first_kind(w.y / A.y, x / p, m, m1);
    double slant = J.x * p / (J.x * p + J.z * r), rise = J.z * r / (J.x * p + J.z * r);
    double eta = first_kind(std::sqrt(rise), slant, m1, m), rate = std::sqrt(r * gap3 / (J.x * J.y * J.z));
    bool swift = m > 0.5;
    double q = swift ? nome_of(m1, 1.0 - m1) : nome_of(m, 1.0 - m);
    Nome powers = powers_of(q);
    double t3 = theta_3(ones, powers.even), t4 = theta_4(ones, powers.even);
    double odd = 1.0 + (powers.odd.x + powers.odd.y), k = 1.0 / (t3 * t3);
    Cycle cycle;
    cycle.kind = swift ? HYPERBOLIC : CIRCULAR;
    cycle.amplitudes = swift ? Vec{A.x * (odd / t4), A.y * (t3 / t4), A.z * (odd / t3)}
                             : Vec{A.x * (t4 / odd), A.y * (t3 / odd), A.z * (t4 / t3)};
    cycle.nome = powers;
    cycle.rate = k * rate, cycle.start = k * u;
    cycle.half_period = swift && m1 > 0.0 ? k * complete(m1) : ENDLESS;
    cycle.phase = swift ? hyperbolic_phase(q, k * eta) : circular_phase(q, k * eta);
    cycle.sense = sense, cycle.precession = energy / L + sense * k * rate * cycle.phase.rate;
    cycle.per_period = swift ? 2.0 * sense * k * eta : 0.0;
    return cycle;
}
