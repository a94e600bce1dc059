#include "common/stability/ray_judge.h"

#include <algorithm>
#include <cmath>

#include "common/stability/surface_distance.h"
#include "common/stopwatch.h"

namespace tandem::stability {

namespace {

constexpr std::uint64_t batch_rays = 16384;
constexpr std::uint64_t first_batch_rays = 2048;  // in any case

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// The unit in the last place of 1.
double ulp_of_one(Precision precision) { return precision == Precision::double_precision ? 0x1p-52 : 0x1p-23; }

// A NaN, or a normal that is no unit vector.
bool is_sick(const RayHit& hit) {
    return !std::isfinite(hit.t) || !is_finite(hit.point) || !is_finite(hit.normal) || !is_finite(hit.leaving_front) ||
           !is_finite(hit.leaving_back) || !(std::abs(glm::length(hit.normal) - 1.0) < 1e-5);
}

class Judge {
public:
    Judge(const RayWork& work, Precision precision)
        : surfaces_(work.scene), scale_(work.scale), ulp_(ulp_of_one(precision)) {}

    void judge(const JudgedRay& judged, const RayHit& hit, RayTally& tally) const {
        ++tally.rays;
        if (hit.primitive == no_index) {
            if (judged.must == Must::hit) ++tally.misses;
            return;
        }
        if (judged.must == Must::miss) {
            ++(judged.leaves ? tally.self_hits : tally.false_hits);
            return;
        }
        const bool wrong = (judged.primitive != no_index && judged.primitive != hit.primitive) ||
                           (judged.t && *judged.t != hit.t) || hit.primitive >= surfaces_.size() || is_sick(hit);
        if (wrong) {
            ++(judged.leaves && hit.primitive == judged.ray.left_primitive ? tally.self_hits : tally.false_hits);
            return;
        }
        tally.worst_ulp = std::max(tally.worst_ulp, error(judged.ray, hit));
    }

private:
    // Error of the point on the ray, or of the point that the renderer makes of it if that is larger. It is what is off
    // along the normal, and beyond the rim as the ray sees it.
    [[nodiscard]] double error(const GivenRay& ray, const RayHit& hit) const {
        const double length = glm::length(ray.direction);
        const glm::dvec3 d = std::abs(length - 1.0) <= 1e-6 ? ray.direction : ray.direction / length;
        const glm::dvec3 on_ray = ray.origin + hit.t * d;
        const double scale = scale_ > 0.0 ? scale_
                                          : std::max({largest_coordinate(ray.origin), largest_coordinate(on_ray), hit.t,
                                                surfaces_.reach(hit.primitive)});
        double worst = 0.0;
        for (const glm::dvec3& point : {on_ray, hit.point}) {
            const SurfaceOffset off = surfaces_.offset(hit.primitive, point);
            worst = std::max(worst, off.along_normal + off.sideways * std::abs(glm::dot(off.normal, d)));
        }
        return worst / (scale * ulp_);
    }

    Surfaces surfaces_;
    double scale_, ulp_;
};

// Rays of one scene.
class Shooter {
public:
    Shooter(const RayWork& work, Renderer& renderer, const RenderSettings& settings, Precision precision)
        : work_(work), judge_(work, precision), intersector_(renderer.intersector(work.scene, settings)) {
        if (work.scaled_twin) twin_ = renderer.intersector(work.twin, settings);
    }

    void shoot(std::uint64_t count, Dice& dice, RayTally& tally) {
        judged_.clear();
        for (std::uint64_t i = 0; i < count; ++i) judged_.push_back(work_.aim(dice));
        while (!judged_.empty()) {
            given_.clear();
            for (const JudgedRay& ray : judged_) given_.push_back(ray.ray);
            const RayHits found = intersector_->intersect(given_);
            tally.seconds += found.device_seconds.value_or(found.seconds);
            for (std::size_t i = 0; i < judged_.size(); ++i) judge_.judge(judged_[i], found.hits[i], tally);
            if (twin_) compare_twin(found, tally);
            std::vector<JudgedRay> next;
            for (std::size_t i = 0; i < judged_.size(); ++i)
                if (judged_[i].leads_on && found.hits[i].primitive != no_index && !is_sick(found.hits[i]))
                    if (auto ray = work_.follow(judged_[i], found.hits[i], dice)) next.push_back(*ray);
            judged_ = std::move(next);
        }
    }

private:
    void compare_twin(const RayHits& found, RayTally& tally) {
        const double factor = *work_.scaled_twin;
        for (GivenRay& ray : given_) ray.origin *= factor;
        const RayHits twins = twin_->intersect(given_);
        for (std::size_t i = 0; i < given_.size(); ++i) {
            const RayHit &a = found.hits[i], &b = twins.hits[i];
            if (a.primitive != b.primitive || a.t * factor != b.t || a.point * factor != b.point) ++tally.false_hits;
        }
    }

    const RayWork& work_;
    Judge judge_;
    std::unique_ptr<RayIntersector> intersector_, twin_;
    std::vector<JudgedRay> judged_;
    std::vector<GivenRay> given_;
};

}  // namespace

RayTally shoot(const std::vector<RayWork>& work, Renderer& renderer, const RenderSettings& settings,
    Precision precision, std::uint64_t seed, std::uint64_t rays, double seconds, const std::stop_token& stop) {
    RayTally tally;
    const Stopwatch watch;
    for (std::size_t i = 0; i < work.size() && !stop.stop_requested(); ++i) {
        Dice dice(seed * 1000003 + i);
        Shooter shooter(work[i], renderer, settings, precision);
        const std::uint64_t share = (rays + work.size() - 1) / work.size();
        const double end = seconds * static_cast<double>(i + 1) / static_cast<double>(work.size());
        for (std::uint64_t done = 0; done < share && !stop.stop_requested();) {
            if (done > 0 && watch.seconds() > end) {
                tally.cut = true;
                break;
            }
            const std::uint64_t count = std::min(done == 0 ? first_batch_rays : batch_rays, share - done);
            shooter.shoot(count, dice, tally);
            done += count;
        }
    }
    return tally;
}

}  // namespace tandem::stability
