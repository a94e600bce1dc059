// How surfaces and media scatter, drawn by every tracer: chi-square, densities, weights, energy and reciprocity.
#include "common/scene/materials.h"
#include "tests/suite/effects.h"
#include "tests/suite/samplers.h"

using namespace tandem;
using namespace tandem::test;
using namespace tandem::test::samplers;

namespace {

const dvec3 normal(0.0, 1.0, 0.0);

// MODEL.md section 7.6, with cosines about the normal.
struct Facets {
    double alpha;

    [[nodiscard]] double distribution(const dvec3& h) const {
        const double x = 1.0 + h.y * h.y * (alpha * alpha - 1.0);
        return alpha * alpha / (pi * x * x);
    }
    [[nodiscard]] double lambda(const dvec3& w) const {
        return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 - w.y * w.y) / (w.y * w.y)) - 1.0);
    }
    [[nodiscard]] double g1(const dvec3& i) const { return 1.0 / (1.0 + lambda(i)); }
    [[nodiscard]] double g2(const dvec3& i, const dvec3& o) const { return 1.0 / (1.0 + lambda(i) + lambda(o)); }
    // Density of visible normals.
    [[nodiscard]] double visible(const dvec3& i, const dvec3& h) const {
        return g1(i) * distribution(h) * std::max(0.0, glm::dot(i, h)) / i.y;
    }
};

double conductor_reflectance(double c, double eta, double k) {
    const double s2 = 1.0 - c * c, t0 = eta * eta - k * k - s2;
    const double b = std::sqrt(t0 * t0 + 4.0 * eta * eta * k * k), t1 = b + c * c;
    const double t2 = 2.0 * c * std::sqrt(0.5 * (b + t0)), rs = (t1 - t2) / (t1 + t2);
    const double t3 = c * c * b + s2 * s2, t4 = t2 * s2;
    return 0.5 * (rs + rs * (t3 - t4) / (t3 + t4));
}

double dielectric_reflectance(double c, double eta) {
    const double s2 = eta * eta * (1.0 - c * c);
    if (s2 > 1.0) return 1.0;
    const double ct = std::sqrt(1.0 - s2);
    const double rs = (eta * c - ct) / (eta * c + ct), rp = (c - eta * ct) / (c + eta * ct);
    return 0.5 * (rs * rs + rp * rp);
}

const dvec3 gold_eta(0.2, 0.9, 1.1), gold_k(3.9, 2.4, 2.2);
Material rough_conductor(double roughness) {
    Material material;
    material.kind = MaterialKind::conductor;
    material.roughness = roughness;
    material.eta = gold_eta;
    material.k = gold_k;
    return material;
}

Scene surface_seen(const Material& material, const dvec3& from) {
    SceneBuilder b = looking_from(5.0 * from);
    return b.floor(material, 0.0, 20.0).scene();
}

// What a model says of a direction: its density, and the weight of having drawn it.
struct Answer {
    double density;
    dvec3 weight;
};
using Model = std::function<Answer(const dvec3& i, const dvec3& o)>;

// All of section 8's checks of one lobe, in every tracer; `keeps_density`: backends know its pdf.
void check_lobe(const Scene& scene, const dvec3& from, const Model& model, bool keeps_density) {
    const std::vector<double> shares = shares_of([&](const dvec3& o) { return model(from, o).density; });
    dvec3 albedo(0.0);
    over_sphere([&](const dvec3& o, double angle) {
        const Answer answer = model(from, o);
        if (answer.density > 0.0) albedo += angle * answer.density * answer.weight;
    });
    CHECK(sum_of(shares) <= 1.0 + 2e-3);
    CHECK(albedo.x <= 1.0 + 2e-3);
    for (Tracer& tracer : tracers()) {
        CAPTURE(tracer.name);
        std::vector<dvec3> drawn;
        double worst_density = 0.0, worst_weight = 0.0;
        dvec3 mean(0.0);
        for (const PathTrace& trace : traces_of(tracer, scene, settings_of(1, 1))) {
            const TracedVertex& vertex = trace.vertices.front();
            drawn.push_back(vertex.next_direction);
            if (vertex.end != PathEnd::goes_on) continue;
            const Answer answer = model(-vertex.direction, vertex.next_direction);
            if (keeps_density)
                worst_density = std::max(worst_density, relative_error(vertex.pdf, answer.density));
            else
                CHECK(vertex.pdf == 0.0);
            for (int c = 0; c < 3; ++c)
                worst_weight = std::max(worst_weight, relative_error(weight_of(vertex)[c], answer.weight[c]));
            mean += weight_of(vertex) / static_cast<double>(samples);
        }
        check_directions(drawn, shares);
        CAPTURE(worst_density);
        CAPTURE(worst_weight);
        CHECK(worst_density < tolerance(tracer));
        CHECK(worst_weight < tolerance(tracer));
        // Weights are at most 1, so their mean has a standard error of at most 1/2 over the root of the samples.
        for (int c = 0; c < 3; ++c)
            CHECK(std::abs(mean[c] - albedo[c]) < 6.0 * 0.5 / std::sqrt(double{samples}) + 2e-3);
    }
}

dvec3 direction_at(double cosine) {
    return {0.6 * std::sqrt(1.0 - cosine * cosine), cosine, 0.8 * std::sqrt(1.0 - cosine * cosine)};
}

}  // namespace

TEST_CASE("samplers: diffuse surfaces scatter by the cosine, from any side") {
    const dvec3 colour(0.9, 0.5, 0.1);
    for (const double cosine : {0.9, 0.2, -0.6}) {
        const dvec3 from = direction_at(cosine);
        const double side = cosine > 0.0 ? 1.0 : -1.0;
        check_lobe(
            surface_seen(diffuse(colour), from), from,
            [&](const dvec3&, const dvec3& o) {
                return Answer{std::max(0.0, side * o.y) / pi, colour};
            },
            true);
    }
}

TEST_CASE("samplers: rough diffuse surfaces scatter by the cosine, weighted by Oren and Nayar's share") {
    const dvec3 colour(0.9, 0.5, 0.1);
    for (const double sigma : {0.2, 0.5, 1.0})
        for (const double cosine : {0.9, 0.3, -0.6}) {
            CAPTURE(sigma);
            const double s2 = sigma * sigma, a = 1.0 - s2 / (2.0 * (s2 + 0.33)), b = 0.45 * s2 / (s2 + 0.09);
            const dvec3 from = direction_at(cosine);
            const double side = cosine > 0.0 ? 1.0 : -1.0;
            check_lobe(
                surface_seen(rough_diffuse(colour, sigma), from), from,
                [&](const dvec3& i, const dvec3& o) {
                    if (!(side * o.y > 0.0)) return Answer{0.0, dvec3(0.0)};
                    const double theta_i = std::acos(std::abs(i.y)), theta_o = std::acos(side * o.y);
                    const double between = std::cos(std::atan2(i.z, i.x) - std::atan2(o.z, o.x));
                    const double share = a + b * std::max(0.0, between) * std::sin(std::max(theta_i, theta_o)) *
                                                 std::tan(std::min(theta_i, theta_o));
                    return Answer{side * o.y / pi, share * colour};
                },
                true);
        }
}

TEST_CASE("samplers: rough conductors reflect by their visible microfacets") {
    for (const double roughness : {0.4, 0.7, 1.0})
        for (const double cosine : {0.95, 0.3}) {
            CAPTURE(roughness);
            const Facets facets{roughness * roughness};
            const dvec3 from = direction_at(cosine);
            check_lobe(
                surface_seen(rough_conductor(roughness), from), from,
                [&](const dvec3& i, const dvec3& o) {
                    if (!(o.y > 0.0)) return Answer{0.0, dvec3(0.0)};
                    const dvec3 h = glm::normalize(i + o);
                    dvec3 weight(facets.g2(i, o) / facets.g1(i));
                    for (int c = 0; c < 3; ++c)
                        weight[c] *= conductor_reflectance(glm::dot(i, h), gold_eta[c], gold_k[c]);
                    return Answer{facets.visible(i, h) / (4.0 * glm::dot(i, h)), weight};
                },
                true);
        }
}

TEST_CASE("samplers: rough glass reflects and refracts by its visible microfacets, from both sides") {
    for (const double roughness : {0.4, 0.8})
        for (const double cosine : {0.9, 0.35, -0.8}) {
            CAPTURE(roughness);
            CAPTURE(cosine);
            const Facets facets{roughness * roughness};
            const dvec3 from = direction_at(cosine);
            const double side = cosine > 0.0 ? 1.0 : -1.0, eta = cosine > 0.0 ? 1.0 / 1.5 : 1.5;
            // Mirrored, so that the side it comes from is above.
            const auto model = [&](dvec3 i, dvec3 o) {
                i.y *= side;
                o.y *= side;
                const Answer none{0.0, dvec3(0.0)};
                const dvec3 weight(facets.g2(i, o) / facets.g1(i));
                if (o.y > 0.0) {
                    const dvec3 h = glm::normalize(i + o);
                    const double c = glm::dot(i, h);
                    return Answer{dielectric_reflectance(c, eta) * facets.visible(i, h) / (4.0 * c), weight};
                }
                dvec3 h = -(eta * i + o);  // [Walter 2007, equation 16]
                if (!(glm::dot(h, h) > 0.0)) return none;
                h = glm::normalize(h.y > 0.0 ? h : -h);
                const double c = glm::dot(i, h), t = glm::dot(o, h);
                if (!(c > 0.0 && t < 0.0)) return none;
                const double bend = eta * c + t;
                return Answer{
                    (1.0 - dielectric_reflectance(c, eta)) * facets.visible(i, h) * -t / (bend * bend), weight};
            };
            check_lobe(surface_seen(rough_glass(1.5, roughness), from), from, model, false);
        }
}

TEST_CASE("samplers: media scatter by Henyey and Greenstein's phase function") {
    for (const double g : {0.0, 0.4, -0.7, 0.85}) {
        CAPTURE(g);
        Scene scene = looking_from({3.0, 2.0, 1.0}).scene();
        Medium medium;
        medium.scattering = dvec3(100.0);
        medium.anisotropy = g;
        scene.media.push_back(medium);
        scene.medium = 0;
        const dvec3 from = glm::normalize(dvec3(3.0, 2.0, 1.0));
        check_lobe(
            scene, from,
            [&](const dvec3& i, const dvec3& o) {
                const double x = 1.0 + g * g + 2.0 * g * glm::dot(i, o);
                return Answer{(1.0 - g * g) / (4.0 * pi * x * std::sqrt(x)), dvec3(1.0)};
            },
            true);
    }
}

TEST_CASE("samplers: light goes both ways alike on diffuse, rough diffuse and rough conducting surfaces") {
    // A sun's next event is f cos E: f must not change when sun and camera change places.
    for (const Material& material : {diffuse(dvec3(0.7)), rough_diffuse(dvec3(0.7), 0.3),
             rough_diffuse(dvec3(0.7), 1.0), rough_conductor(0.4), rough_conductor(1.0)})
        for (const auto& [a, b] : {std::pair{direction_at(0.9), dvec3(-0.48, 0.6, 0.64)},
                 {direction_at(0.3), dvec3(-0.6, 0.8, 0.0)}, {direction_at(0.15), direction_at(0.99)}}) {
            CAPTURE(row_of(material.kind).name);
            CAPTURE(material.roughness);
            const auto reflected = [&](Tracer& tracer, const dvec3& camera, const dvec3& sun) {
                Scene scene = surface_seen(material, camera);
                PunctualLight light;
                light.kind = PunctualKind::sun;
                light.direction = -sun;
                light.intensity = dvec3(1.0);
                scene.lights.push_back(light);
                const auto traces = traces_of(tracer, scene, settings_of(1, 1, Integrator::whitted), 1);
                REQUIRE(traces.size() == 1);
                CHECK(glm::distance(traces[0].vertices[0].next_event.direction, sun) < 8.0 * tracer.unit_roundoff);
                return traces[0].vertices[0].light / sun.y;
            };
            for (Tracer& tracer : tracers()) {
                if (tracer.name == "oracle") continue;  // it has no next event to trace
                CAPTURE(tracer.name);
                const dvec3 there = reflected(tracer, a, b), back = reflected(tracer, b, a);
                // The camera's field of 10^-3 degrees moves directions by 2^-17.
                for (int c = 0; c < 3; ++c) CHECK(relative_error(there[c], back[c]) < 20.0 * 0x1p-17);
                CHECK(there.x > 0.0);
            }
        }
}
