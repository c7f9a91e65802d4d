// The kernels of rocks with a shape, each over all its recorded calls; benchmarks/cpp_blocks.py calls these functions.
//
// Arrays are those of benchmarks/block_calls.py, row by row; the last arrays of each function are written.
#include "clearance.hpp"
#include "distance.hpp"
#include "inelastic.hpp"
#include "rotation.hpp"

extern "C" {

void solve_impacts(int64_t calls, const int64_t* first, const Vec* moments, const double* within, Row* rows,
                   Contact* contacts, Velocity* motion) {
    for (int64_t i = 0; i < calls; ++i) {
        int count = int(first[i + 1] - first[i]);
        motion[i] = inelastic(contacts + first[i], rows, count, moments[i], motion[i], within[i]);
    }
}

void find_distances(int64_t calls, const Vec* corners, const int64_t* ends, const double* size, const Triangle* facets,
                    const Vec* guesses, double* out) {
    for (int64_t i = 0; i < calls; ++i) {
        const int64_t* of = ends + 2 * i;
        Separation found = separation(corners, int(of[0]), int(of[1]), size[i], facets[i], guesses[i]);
        const Vec parts[3] = {found.normal, found.on_facet, found.on_body};
        double* row = out + 11 * i;
        row[0] = found.distance, row[10] = found.overlap ? 1.0 : 0.0;
        for (int k = 0; k < 3; ++k)
            row[1 + 3 * k] = parts[k].x, row[2 + 3 * k] = parts[k].y, row[3 + 3 * k] = parts[k].z;
    }
}

void find_clear_times(int64_t calls, const double* arms, const int64_t* corners, const int64_t* body,
                      const Sweep* sweeps, const Plane* planes, const double* longest, double* out) {
    for (int64_t i = 0; i < calls; ++i) {
        int64_t count = corners[2 * body[i]], columns = corners[2 * body[i] + 1];
        const double* x = arms + 4 * columns * body[i];
        Arms of = {x, x + columns, x + 2 * columns, x + 3 * columns, int(count)};
        out[i] = clear_time(of, sweeps[i], planes[i], longest[i]);
    }
}

void find_rotations(int64_t flights, const Vec* moments, const Quaternion* q, const Vec* w, const int64_t* first,
                    const double* times, Placed* out) {
    for (int64_t i = 0; i < flights; ++i) {
        Turning turning = turning_of(moments[i], q[i], w[i]);
        for (int64_t k = first[i]; k < first[i + 1]; ++k) out[k] = turned_for(turning, times[k]);
    }
}
}
