// The contacts of a body and the solver's row of each: rpf3d_core/body/contacts.py, in the same order.
#pragma once
#include "vectors.hpp"

// A row of the array of contacts; all vectors are in the body's axes.
struct Contact {
    Vec arm, normal;
    double mu, rolling, restitution;
    Vec goal, impulse;
    double gap, facet;
};
static_assert(sizeof(Contact) == 17 * sizeof(double));

// The solver's row of a contact: directions (normal, two tangents), their levers, and the spins by unit impulses.
struct Row {
    Vec axes[3], lever[3], turn[3];
    double nn, nt, ns, tt, ts, ss;
    double mean, half, cos, sin, a, b;
    Vec local, aim, last, change;
};
static_assert(sizeof(Row) == 51 * sizeof(double));

struct Velocity {
    Vec v, w;
};

inline Vec times(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Vec over(Vec a, Vec b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }

inline void set_tangents(Row& row) {
    Vec n = row.axes[0];
    Vec flat = std::fabs(n.x) < 0.6 ? Vec{0.0, n.z, -n.y} : Vec{-n.z, 0.0, n.x};
    row.axes[1] = scale(1.0 / norm(flat), flat);
    row.axes[2] = cross(n, row.axes[1]);
}

inline void set_matrix(Row& row) {
    const Vec *lever = row.lever, *turn = row.turn;
    row.nn = 1.0 + dot(lever[0], turn[0]), row.nt = dot(lever[0], turn[1]), row.ns = dot(lever[0], turn[2]);
    row.tt = 1.0 + dot(lever[1], turn[1]), row.ts = dot(lever[1], turn[2]), row.ss = 1.0 + dot(lever[2], turn[2]);
}

// Eigenvalues and eigenvectors of the matrix, reduced to the tangents.
inline void reduce(Row& row) {
    double tt = row.tt - row.nt * row.nt / row.nn, ts = row.ts - row.nt * row.ns / row.nn;
    double ss = row.ss - row.ns * row.ns / row.nn;
    double mean = 0.5 * (tt + ss), off = 0.5 * (tt - ss);
    double half = std::sqrt(off * off + ts * ts), cos = 1.0, sin = 0.0;
    if (half > 0.0) {
        cos = std::sqrt(most(0.5 * (1.0 + off / half), 0.0));
        sin = std::sqrt(most(0.5 * (1.0 - off / half), 0.0));
        if (ts < 0.0) sin = -sin;
    }
    row.mean = mean, row.half = half, row.cos = cos, row.sin = sin;
    row.a = cos * row.nt + sin * row.ns, row.b = cos * row.ns - sin * row.nt;
}

inline Vec in_axes(Vec a, const Row& row) { return {dot(a, row.axes[0]), dot(a, row.axes[1]), dot(a, row.axes[2])}; }

inline void prepare(const Contact& contact, Row& row, Vec inverse) {
    row.axes[0] = contact.normal;
    set_tangents(row);
    for (int k = 0; k < 3; ++k) {
        row.lever[k] = cross(contact.arm, row.axes[k]);
        row.turn[k] = times(inverse, row.lever[k]);
    }
    row.local = row.last = in_axes(contact.impulse, row);
    row.change = {0.0, 0.0, 0.0};
    row.aim = in_axes(contact.goal, row);
    set_matrix(row);
    reduce(row);
}
