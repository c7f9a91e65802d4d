// The time in which no corner of a body can reach a plane: rpf3d_core/body/clearance.py, in the same order.
#pragma once
#include "quaternions.hpp"

const double TURNING = 0.5 + std::sqrt(0.25 + 1.0 / 3.0);

struct Sweep {
    Vec x, v, w;
    Quaternion q;
    double gravity, spin_bound;
};

struct Plane {
    Vec n;
    double d;
};

// The corners of a body: their positions and distances from the centre of mass, in four rows.
struct Arms {
    const double *x, *y, *z, *length;
    int count;
};

struct Descent {
    Vec up, across;
    double centre, rate, fall, turning;
};

// The lower bound height + rate t - bend t^2 / 2 of the height of a corner above the plane.
struct Bound {
    double height, rate, bend;
};

inline double reach_time(double height, double rate, double fall) {
    double square = rate * rate + 2.0 * fall * height;
    if (square < 0.0 || (rate >= 0.0 && fall <= 0.0)) return INF;
    double root = std::sqrt(square);
    return rate > 0.0 ? (rate + root) / fall : 2.0 * height / (root - rate);
}

inline Descent descent_of(const Sweep& sweep, Plane plane) {
    Vec n = plane.n;
    return {
        turned_back(sweep.q, n), turned_back(sweep.q, cross(n, sweep.w)),
        dot(n, sweep.x) - plane.d, dot(n, sweep.v),
        sweep.gravity * n.z, TURNING * sweep.spin_bound * sweep.spin_bound,
    };
}

inline Bound bound_of(const Arms& arms, int i, const Descent& descent) {
    Vec arm = {arms.x[i], arms.y[i], arms.z[i]};
    return {
        descent.centre + dot(descent.up, arm), descent.rate + dot(descent.across, arm),
        descent.fall + descent.turning * arms.length[i],
    };
}

// Whether all bounds stay above the plane. There is no branch, so several corners can be processed at a time.
inline bool all_clear(const Arms& arms, const Descent& descent, double longest) {
    int64_t clear = 0;
    for (int i = 0; i < arms.count; ++i) {
        Bound b = bound_of(arms, i, descent);
        clear += (b.height > 0.0) & (b.bend >= 0.0) & (b.height + longest * (b.rate - 0.5 * b.bend * longest) > 0.0);
    }
    return clear == arms.count;
}

inline double clear_time(const Arms& arms, const Sweep& sweep, Plane plane, double longest) {
    Descent descent = descent_of(sweep, plane);
    if (all_clear(arms, descent, longest)) return INF;
    double time = longest, farthest = 0.0;
    for (int i = 0; i < arms.count; ++i) {
        Bound b = bound_of(arms, i, descent);
        if (b.height <= 0.0) return 0.0;
        farthest = most(farthest, arms.length[i]);
        if (b.bend < 0.0 || !(b.height + time * (b.rate - 0.5 * b.bend * time) > 0.0))
            time = least(time, reach_time(b.height, b.rate, b.bend));
    }
    if (!(time < longest)) return INF;
    if (descent.centre <= farthest) return time;
    return most(time, reach_time(descent.centre - farthest, descent.rate, descent.fall));
}
