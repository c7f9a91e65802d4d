// Fly the rocks of a folder of arrays several times; write their final states and the CPU seconds of each pass there.
//
//     fly FOLDER PASSES
//
// benchmarks/cpp_engine.py writes the arrays of the compiled engine; columns as in simulation/engines.py.
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "march.hpp"

template <typename T>
std::vector<T> read(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) {
        std::fprintf(stderr, "cannot read %s\n", path.c_str());
        std::exit(1);
    }
    std::vector<T> values(file.tellg() / sizeof(T));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), values.size() * sizeof(T));
    return values;
}

template <typename T>
void write(const std::string& path, const std::vector<T>& values) {
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

int main(int, char** arguments) {
    std::string folder = std::string(arguments[1]) + "/";
    auto geometry = read<double>(folder + "geometry"), box = read<double>(folder + "box");
    auto zone = read<int32_t>(folder + "zone"), ids = read<int32_t>(folder + "ids");
    auto grid = read<double>(folder + "grid"), planes = read<double>(folder + "planes");
    auto starts = read<int64_t>(folder + "starts"), first = read<int64_t>(folder + "first");
    auto boxes = read<uint32_t>(folder + "boxes");
    auto surfaces = read<Surface>(folder + "surfaces");
    auto settings = read<double>(folder + "settings"), x = read<double>(folder + "x"), v = read<double>(folder + "v");
    World world = {
        {geometry.data(), zone.data(), vector_at(&box[0]), vector_at(&box[3]), box[6]},
        {grid[0], grid[1], grid[2], int64_t(grid[3]), int64_t(grid[4]), starts.data(), ids.data(), boxes.data(),
         planes.data(), first.data()},
        surfaces.data(),
        {settings[0], settings[1], settings[2], int64_t(settings[3])},
    };
    size_t rocks = x.size() / 3;
    std::vector<double> finals(8 * rocks), seconds;
    std::vector<int64_t> counts(4 * rocks);
    for (int pass = 0; pass < std::atoi(arguments[2]); ++pass) {
        std::clock_t began = std::clock();
        for (size_t i = 0; i < rocks; ++i) {
            State end = follow(world, vector_at(&x[3 * i]), vector_at(&v[3 * i]));
            const Tally& tally = end.tally;
            double* row = &finals[8 * i];
            row[0] = end.motion.t, row[1] = end.motion.x.x, row[2] = end.motion.x.y, row[3] = end.motion.x.z;
            row[4] = tally.path, row[5] = std::sqrt(tally.speed2), row[6] = tally.height, row[7] = tally.ground_speed;
            int64_t* count = &counts[4 * i];
            count[0] = end.outcome, count[1] = tally.facet, count[2] = tally.impacts, count[3] = tally.pieces;
        }
        seconds.push_back(double(std::clock() - began) / CLOCKS_PER_SEC);
    }
    write(folder + "finals", finals);
    write(folder + "counts", counts);
    write(folder + "seconds", seconds);
}
