// Which pixel is at a place of the tile. Pixels are in their order, or in the list of a pass of adaptive sampling (MODEL.md
// section 11.3). The host decides which pixels a pass has (common/render/adaptive_sampling.cpp).
#ifndef PIXEL_LIST_GLSL
#define PIXEL_LIST_GLSL

#include "made/constant_ids.glsl"

layout(constant_id = id_lists_pixels) const bool lists_pixels = false;  // some dispatches of the job do

// Behind the counters: devices with 32 storage buffers a stage have no room for another.
layout(std430, set = 3, binding = 2) readonly restrict buffer PixelList { uint listed_pixels[]; };
const uint counters_before = 4;

uint pixel_at(uint place) {
    const bool listed = lists_pixels && both(settings.listed != 0, place < settings.pixel_count);
    return listed ? listed_pixels[counters_before + place % max(settings.listed, 1u)] : settings.first_pixel + place;
}

// How many blocks of samples after the dispatch's first that is, where kernels that sum up whole paths stack the list.
uint block_at(uint place) {
    return lists_pixels ? uint(settings.listed != 0) * (place / max(settings.listed, 1u)) : 0u;
}

#endif
