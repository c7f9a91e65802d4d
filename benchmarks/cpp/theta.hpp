// Elliptic integrals and theta series: rpf3d_core/body/{elliptic,theta}.py, in the same order.
#pragma once
#include "vectors.hpp"

struct Four {
    double a, b, c, d;
};

// Powers of a nome q: (q^2, q^6, q^12), and 2 (q, q^4, q^9).
struct Nome {
    Vec odd, even;
};

// Sines and cosines of 1, 3, 5, 7 times an argument, and cosines of 2, 4, 6 times the argument.
struct Waves {
    Four sines, cosines;
    Vec even;
};

struct Phase {
    Four first, second;
    double rate;
};

struct Pair {
    double s, c;
};

INLINED double carlson(double x, double y, double z) {
    const double spread = 6e-3;
    double mean = (x + y + z) / 3.0;
    for (int i = 0; i < 40; ++i) {
        double off = most(std::fabs(mean - x), std::fabs(mean - y), std::fabs(mean - z));
        if (off < spread * mean) break;
        double a = std::sqrt(x), b = std::sqrt(y), c = std::sqrt(z), shift = a * b + b * c + c * a;
        x = 0.25 * (x + shift), y = 0.25 * (y + shift), z = 0.25 * (z + shift);
        mean = (x + y + z) / 3.0;
    }
    double a = (mean - x) / mean, b = (mean - y) / mean, c = -a - b;
    double e2 = a * b - c * c, e3 = a * b * c;
    double low = -e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 / 44.0 * e2 * e3;
    double high = -5.0 / 208.0 * e2 * e2 * e2 + 3.0 / 104.0 * e3 * e3 + e2 * e2 * e3 / 16.0;
    return (1.0 + (low + high)) / std::sqrt(mean);
}

INLINED double complete(double m1) {
    double a = 1.0, b = std::sqrt(m1);
    for (int i = 0; i < 12 && !(std::fabs(a - b) < 1e-9 * a); ++i) {
        double mean = 0.5 * (a + b);
        b = std::sqrt(a * b), a = mean;
    }
    return M_PI / (a + b);
}

INLINED double first_kind(double s, double c2, double m, double m1) {
    return s * carlson(c2, m > 0.5 ? c2 + m1 * s * s : 1.0 - m * s * s, 1.0);
}

INLINED double exponential(double x) {
    const double ln2_high = 0.693147180369123816490, ln2_low = 1.90821492927058770002e-10;
    int64_t n = int64_t(std::floor(x * 1.4426950408889634 + 0.5));
    double r = (x - double(n) * ln2_high) - double(n) * ln2_low;
    double total = ((((1.0 / 6227020800.0) * r + 1.0 / 479001600.0) * r + 1.0 / 39916800.0) * r + 1.0 / 3628800.0) * r;
    total = ((((total + 1.0 / 362880.0) * r + 1.0 / 40320.0) * r + 1.0 / 5040.0) * r + 1.0 / 720.0) * r;
    total = ((((total + 1.0 / 120.0) * r + 1.0 / 24.0) * r + 1.0 / 6.0) * r + 0.5) * r;
    total = (total + 1.0) * r + 1.0;
    double power = 1.0, twice = 2.0;
    for (; n > 0; n >>= 1, twice *= twice)
        if (n & 1) power *= twice;
    return total * power;
}

INLINED Pair hyperbolic_pair(double x) {
    if (std::fabs(x) < 0.5) {
        double z = x * x;
        double inner = 1.0 + z / 72.0 * (1.0 + z / 110.0 * (1.0 + z / 156.0 * (1.0 + z / 210.0)));
        double s = x * (1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * inner)));
        return {s, std::sqrt(1.0 + s * s)};
    }
    double e = exponential(std::fabs(x)), s = 0.5 * (e - 1.0 / e);
    return {x > 0.0 ? s : -s, 0.5 * (e + 1.0 / e)};
}

INLINED double nome_of(double m, double m1) {
    double k1 = std::sqrt(m1), root = 1.0 + std::sqrt(k1);
    double a = 0.5 * m / ((1.0 + k1) * root * root), b = a * a * a * a;
    return a * (1.0 + b * (2.0 + b * (15.0 + b * (150.0 + 1707.0 * b))));
}

INLINED Nome powers_of(double q) {
    double q2 = q * q, q4 = q2 * q2;
    return {{q2, q2 * q4, q4 * q4 * q4}, {2.0 * q, 2.0 * q4, 2.0 * q * q4 * q4}};
}

INLINED Waves multiples(double s, double c, double c2) {
    double d = 2.0 * c2, s3 = d * s + s, c3 = d * c - c, c4 = d * c2 - 1.0, s5 = d * s3 - s, c5 = d * c3 - c;
    return {{s, s3, s5, d * s5 - s3}, {c, c3, c5, d * c5 - c3}, {c2, c4, d * c4 - c2}};
}

INLINED Waves circular(double v) {
    double s = std::sin(v), c = std::cos(v);
    return multiples(s, c, (c - s) * (c + s));
}

INLINED Waves hyperbolic(double x) {
    Pair p = hyperbolic_pair(x);
    return multiples(p.s, p.c, 1.0 + 2.0 * p.s * p.s);
}

INLINED double alternating(Four f, Vec q) { return f.a - (q.x * f.b - (q.y * f.c - q.z * f.d)); }
INLINED double plain(Four f, Vec q) { return f.a + (q.x * f.b + (q.y * f.c + q.z * f.d)); }
INLINED double theta_3(Vec even, Vec q) { return 1.0 + (q.x * even.x + (q.y * even.y + q.z * even.z)); }
INLINED double theta_4(Vec even, Vec q) { return 1.0 - (q.x * even.x - (q.y * even.y - q.z * even.z)); }
INLINED double combined(Four f, Four g) { return f.a * g.a + (f.b * g.b + (f.c * g.c + f.d * g.d)); }

INLINED Phase circular_phase(double q, double b) {
    Pair p = hyperbolic_pair(least(b, 300.0));
    double h = 1.0 / (p.s + p.c), beta = h * h, s0 = 2.0 * p.s * h, a = q / beta, q2 = q * q;
    double w1 = a * q, w2 = a * a * q2 * q2, w3 = a * a * a * q2 * q2 * q2 * q2 * q;
    double b2 = beta * beta, b3 = beta * beta * beta;
    double c1 = w1 * (1.0 + b3), c2 = w2 * (1.0 + b2 * b3), c3 = w3 * (1.0 + b2 * b2 * b3);
    double t3 = 1.0 + (beta + b2), t5 = 1.0 + (beta + (b2 + (b3 + b2 * b2)));
    double s1 = w1 * s0 * t3, s2 = w2 * s0 * t5, s3 = w3 * s0 * (t5 + b2 * b3 * (1.0 + beta));
    double rate = (s0 + (3.0 * s1 + (5.0 * s2 + 7.0 * s3))) / ((1.0 + beta) + (c1 + (c2 + c3)));
    return {{1.0 + beta, -c1, c2, -c3}, {s0, -s1, s2, -s3}, rate};
}

INLINED Phase hyperbolic_phase(double q, double y) {
    Waves w = circular(y);
    Nome powers = powers_of(q);
    Vec o = powers.odd, e = powers.even;
    Four s = w.sines, c = w.cosines;
    double s2 = 2.0 * s.a * c.a, s4 = 2.0 * s2 * w.even.x, s6 = 2.0 * w.even.x * s4 - s2;
    double rate = (2.0 * e.x * s2 - (4.0 * e.y * s4 - 6.0 * e.z * s6)) / theta_4(w.even, e);
    return {{s.a, -o.x * s.b, o.y * s.c, -o.z * s.d}, {-c.a, o.x * c.b, -o.y * c.c, o.z * c.d}, rate};
}
