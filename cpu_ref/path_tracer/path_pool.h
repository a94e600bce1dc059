// How the path tracer begins paths and ends them. A free slot of the pool takes the camera ray of the next sample
// (MODEL.md section 4). A finished path adds its radiance to the batch. Included by path_tracer.h alone.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "cpu_ref/path_tracer/path_tracer.h"

namespace tandem::cpu {

// Begins paths in the free slots, as far as the batch has samples left.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::refill() {
    while (!free_.empty() && next_path_ < batch_.paths()) {
        const std::uint32_t count =
            std::min({width, static_cast<std::uint32_t>(free_.size()), batch_.paths() - next_path_});
        SampleId<Real> id;
        id.sample_high = I(static_cast<U>(batch_.first_sample >> 32));
        for (std::uint32_t i = 0; i < width; ++i) {
            const std::uint32_t path = next_path_ + std::min(i, count - 1);
            id.pixel.v[i] = batch_.pixel(batch_.first_pixel + path / batch_.sample_count);
            id.sample_low.v[i] = static_cast<std::uint32_t>(batch_.first_sample) + path % batch_.sample_count;
        }
        CameraFrame<V> frame = camera_at_rest(tables_.camera);
        [[maybe_unused]] V time(Real(0));
        if constexpr (moving) {
            if (tables_.moves || tables_.camera.moves) time = numbers<Real>(id, I(U{time_block}))[0];
            if (planted(PlantedBug::time_dimension_shared)) time = numbers<Real>(id, I(U{dimension::film_and_lens}))[3];
            if (tables_.camera.moves) frame = camera_at(tables_.camera, time);
        }
        const CameraRay<Real> ray = camera_ray(tables_, id, frame, numbers<Real>(id, I(U{dimension::film_and_lens})));
        const std::array<V, 6> values{
            ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z};
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t slot = free_.back();
            free_.pop_back();
            for (std::size_t c = 0; c < 3; ++c) {
                paths_.origin[c][slot] = values[c].v[i];
                paths_.direction[c][slot] = values[c + 3].v[i];
                paths_.throughput[c][slot] = Real(1);
                paths_.radiance[c][slot] = Real(0);
            }
            paths_.density[slot] = Real(0);
            paths_.pixel[slot] = id.pixel.v[i];
            paths_.sample[slot] = id.sample_low.v[i];
            paths_.vertex[slot] = 0;
            paths_.primitive[slot] = no_primitive;
            paths_.inside[slot] = 0;
            paths_.path[slot] = next_path_ + i;
            if constexpr (moving) paths_.motion.time[slot] = time.v[i];
            if constexpr (general) {
                paths_.interiors.medium[slot] = tables_.medium;
                paths_.interiors.count[slot] = 0;
                paths_.interiors.lead[slot] = Real(0);
            }
        }
        next_path_ += count;
    }
}

// Ends the paths `ended` of the slots from `first` on.
template <class Real, std::uint64_t effects, class Recorder, class Shade>
void PathTracer<Real, effects, Recorder, Shade>::retire(std::uint32_t first, M ended) {
    for (unsigned left = ended.to_bits(); left != 0; left &= left - 1) {
        const std::uint32_t slot = first + static_cast<std::uint32_t>(std::countr_zero(left));
        std::array<Real, 3>& sum = radiance_[paths_.path[slot]];
        for (std::size_t c = 0; c < 3; ++c) sum[c] = paths_.radiance[c][slot];
        paths_.vertex[slot] = idle;
        free_.push_back(slot);
    }
}

}  // namespace tandem::cpu
