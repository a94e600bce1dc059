// How the cost of a ray grows with the number of triangles. Rounds go in random order over both backends and meshes of
// 10^2 to 10^6 triangles. The results are medians with intervals, and the exponent of growth. Minutes, so the test of
// it is a small part; scripts/measure/growth stores results and writes tests/records/growth/GROWTH.md.
//
//     growth [--rounds N] [--most TRIANGLES] [--size PIXELS] [--json FILE] [BACKEND...]    (cpu, vulkan, loops)
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "common/error.h"
#include "cpu_ref/backend.h"
#include "vulkan/backend.h"

using namespace tandem;

namespace {

// A ball with dents in a grey sky, of about `triangles` triangles of equal size; its picture hardly depends on them.
Scene ball(std::uint32_t triangles) {
    Scene scene;
    scene.name = "ball";
    scene.camera.position = {0.0, 1.0, 4.0};
    scene.camera.target = {0.0, 0.0, 0.0};
    scene.background.down = scene.background.up = glm::dvec3(0.5);
    Material material;
    material.name = "clay";
    material.colour = glm::dvec3(0.8);
    scene.materials.push_back(material);
    const auto rows = std::max(3u, static_cast<std::uint32_t>(std::lround(std::sqrt(triangles / 4.0))));
    const std::uint32_t columns = 2 * rows;
    const auto point = [&](std::uint32_t row, std::uint32_t column) {
        const double v = std::numbers::pi * row / rows, u = 2.0 * std::numbers::pi * (column % columns) / columns;
        const double radius = 1.0 + 0.1 * std::sin(5.0 * u) * std::sin(v) * std::sin(6.0 * v);
        return radius * glm::dvec3(std::sin(v) * std::cos(u), std::cos(v), std::sin(v) * std::sin(u));
    };
    for (std::uint32_t row = 0; row <= rows; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) scene.vertices.push_back(point(row, column));
    for (std::uint32_t row = 0; row < rows; ++row)
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t next = (column + 1) % columns, below = (row + 1) * columns, here = row * columns;
            if (row > 0)
                scene.primitives.push_back({PrimitiveKind::triangle, {here + column, here + next, below + next}, 0.0});
            if (row + 1 < rows)
                scene.primitives.push_back(
                    {PrimitiveKind::triangle, {here + column, below + next, below + column}, 0.0});
        }
    Entity entity;
    entity.name = "ball";
    entity.primitive_count = static_cast<std::uint32_t>(scene.primitives.size());
    scene.entities.push_back(entity);
    return scene;
}

struct Arm {
    std::string backend;
    std::uint32_t triangles = 0;
    double make_seconds = 0.0;
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<RenderJob> job;
    SampleRange range{0, 1};
    std::vector<double> milliseconds;  // a sample of every pixel, a round
    bool device_clock = false;

    double measure() {
        const RenderResult result = job->render(range);
        device_clock = result.device_seconds.has_value();
        return 1e3 * result.device_seconds.value_or(result.seconds) / static_cast<double>(range.count());
    }
    // The median, and the order statistics that enclose it with 95 % [Conover 1999]: normal approximation of ranks.
    [[nodiscard]] std::array<double, 3> summary() const {
        std::vector<double> sorted = milliseconds;
        std::ranges::sort(sorted);
        const double n = static_cast<double>(sorted.size()), half = 0.98 * std::sqrt(n);
        const auto at = [&](double rank) { return sorted[static_cast<std::size_t>(std::clamp(rank, 0.0, n - 1.0))]; };
        return {at(std::floor(n / 2.0)), at(std::floor(n / 2.0 - half)), at(std::ceil(n / 2.0 + half))};
    }
};

Arm make_arm(const std::string& backend, std::uint32_t triangles, std::uint32_t size) {
    Arm arm;
    arm.backend = backend;
    const Scene scene = ball(triangles);
    arm.triangles = static_cast<std::uint32_t>(scene.primitives.size());
    RenderSettings settings = default_settings(scene);
    settings.width = settings.height = size;
    settings.bounces = 4;
    arm.renderer = (backend == "cpu"      ? cpu_backend()
                    : backend == "vulkan" ? vulkan_backend(Acceleration::trees)
                                          : vulkan_backend(Acceleration::loops))
                       .create({});
    const auto start = std::chrono::steady_clock::now();
    arm.job = arm.renderer->prepare(scene, settings);
    (void)arm.job->render({0, 1});
    arm.make_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    while (arm.measure() * static_cast<double>(arm.range.count()) < 20.0 && arm.range.end < 65536) arm.range.end *= 2;
    return arm;
}

struct Options {
    std::size_t rounds = 15;
    std::uint32_t most = 1'000'000, size = 256;
    std::string json;
    std::vector<std::string> backends;
};

Options options_from(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const auto value = [&] {
            if (i + 1 == argc) throw InputError(word + " needs a value");
            return std::string(argv[++i]);
        };
        if (word == "--rounds")
            options.rounds = std::stoul(value());
        else if (word == "--most")
            options.most = static_cast<std::uint32_t>(std::stoul(value()));
        else if (word == "--size")
            options.size = static_cast<std::uint32_t>(std::stoul(value()));
        else if (word == "--json")
            options.json = value();
        else if (word == "cpu" || word == "vulkan" || word == "loops")
            options.backends.push_back(word);
        else
            throw InputError("growth: unknown word " + word + "; backends are cpu, vulkan, loops");
    }
    if (options.backends.empty()) options.backends = {"cpu", "vulkan", "loops"};
    return options;
}

// Prints a backend's rows with the local exponent d log(time) / d log(triangles) from the row before.
nlohmann::json report(const std::vector<Arm>& arms, const std::string& backend) {
    nlohmann::json rows = nlohmann::json::array();
    const Arm* before = nullptr;
    for (const Arm& arm : arms) {
        if (arm.backend != backend) continue;
        const auto [median, low, high] = arm.summary();
        fmt::print("{:8} {:9} triangles  {:9.4f} ms a sample ({:.4f} to {:.4f})  made in {:.2f} s", backend,
            arm.triangles, median, low, high, arm.make_seconds);
        const RendererInfo info = arm.renderer->info();
        nlohmann::json row{{"backend", backend}, {"device", info.device}, {"driver", info.driver},
            {"clock", arm.device_clock ? "device" : "wall"}, {"triangles", arm.triangles}, {"milliseconds", median},
            {"milliseconds_low", low}, {"milliseconds_high", high}, {"make_seconds", arm.make_seconds}};
        if (before != nullptr) {
            const double exponent = std::log(median / before->summary()[0]) /
                                    std::log(static_cast<double>(arm.triangles) / before->triangles);
            fmt::print("  exponent {:.3f}", exponent);
            row["exponent"] = exponent;
        }
        fmt::print("\n");
        rows.push_back(row);
        before = &arm;
    }
    return rows;
}

int run(const Options& options) {
    std::vector<Arm> arms;
    constexpr std::uint32_t most_for_loops = 1000;
    for (const std::string& backend : options.backends)
        for (const double n : {1e2, 3e2, 1e3, 1e4, 1e5, 1e6})
            if (n <= options.most && (backend != "loops" || n <= most_for_loops))
                arms.push_back(make_arm(backend, static_cast<std::uint32_t>(n), options.size));
    std::mt19937_64 random(1);
    std::vector<Arm*> order;
    for (Arm& arm : arms) order.push_back(&arm);
    for (std::size_t round = 0; round < options.rounds; ++round) {
        std::ranges::shuffle(order, random);
        for (Arm* arm : order) arm->milliseconds.push_back(arm->measure());
    }
    nlohmann::json all = nlohmann::json::array();
    for (const std::string& backend : options.backends)
        for (const nlohmann::json& row : report(arms, backend)) all.push_back(row);
    if (options.json.empty()) return 0;
    std::ofstream file(options.json);
    file << nlohmann::json{{"size", options.size}, {"bounces", 4}, {"rounds", options.rounds}, {"rows", all}}.dump(1)
         << "\n";
    if (!file.flush()) throw InputError(options.json + " cannot be written; name another file");
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(options_from(argc, argv));
    } catch (const std::exception& error) {
        std::cerr << "growth: " << error.what() << "\n";
        return 2;
    }
}
